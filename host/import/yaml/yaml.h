// The parts of a YAML scene, one file each.
#pragma once

#include "host/import/load.h"
#include "host/import/yaml/fields.h"

// Reads the `materials` mapping; read_material then knows their names.
void yaml_read_materials(YamlReader *reader, const YamlNode *node);

// Reads a material's name or an inline material; the target is a uint32_t, the material's index.
FieldReader read_material;

// Returns the default material's index.
uint32_t material_default_index(YamlReader *reader);

// Returns the path of a file named in the scene, relative to the scene file's folder. Reports an error and
// returns NULL if the node is not a name. The caller frees it.
char *yaml_read_path(YamlReader *reader, const char *name, const YamlNode *node);

void yaml_read_camera(YamlReader *reader, const YamlNode *node);
void yaml_read_lights(YamlReader *reader, const YamlNode *node);
void yaml_read_objects(YamlReader *reader, const YamlNode *node);
void yaml_read_mesh(YamlReader *reader, const YamlNode *mapping); // the value of `mesh:`
