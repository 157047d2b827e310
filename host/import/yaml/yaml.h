// The parts of a native scene, one file each.
#pragma once

#include "host/import/load.h"
#include "host/import/yaml/fields.h"

// The `materials` mapping; names are known to read_material from then on.
void yaml_read_materials(YamlReader *reader, const YamlNode *node);

// Reads a material's name or an inline material to a uint32_t, its index.
FieldReader read_material;

// Whether an object can have its material: pictures lie on spheres, planes, discs and meshes with uv.
bool material_fits(YamlReader *reader, const YamlNode *mapping, const Object *object);

// The material of objects that name none.
uint32_t material_default_index(YamlReader *reader);

// The path of a file named in the scene; a relative name starts where the scene file lies. NULL, reported,
// where the node is no name. Caller frees.
char *yaml_read_path(YamlReader *reader, const char *name, const YamlNode *node);

void yaml_read_camera(YamlReader *reader, const YamlNode *node);
void yaml_read_lights(YamlReader *reader, const YamlNode *node);
void yaml_read_objects(YamlReader *reader, const YamlNode *node);
void yaml_read_mesh(YamlReader *reader, const YamlNode *mapping); // what stands behind `mesh:`
