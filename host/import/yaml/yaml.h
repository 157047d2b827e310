// The parts of a YAML scene, one file each.
#pragma once

#include "host/import/load.h"
#include "host/import/yaml/fields.h"
#include "host/scene/affine.h"
#include "host/scene/daylight.h"

// Reads the `materials` mapping; read_material then knows their names.
void yaml_read_materials(YamlReader *reader, const YamlNode *node);

// Reads a material's name or an inline material; the target is a uint32_t, the material's index.
FieldReader read_material;

// Reads the name of an image, or a mapping with its layer; the target is a uint32_t, as in Material.texture.
FieldReader read_texture;

// Returns the default material's index.
uint32_t material_default_index(YamlReader *reader);

// Returns the path of a file named in the scene, relative to the folder of the file that names it. Reports an
// error and returns NULL if the node is not a name. The caller frees it.
char *yaml_read_path(YamlReader *reader, const char *name, const YamlNode *node);

// Reads a transform, or a list of them that are applied in order, into an Affine that has an inverse.
FieldReader read_transform;

typedef struct {
    const YamlNode *node; // NULL: there is none
    SunPosition position;
    double angle; // of its disc
    bool shines;  // is a light
} Sun;

typedef struct {
    Color horizon;
    Vector3 up;
    Color zenith, nadir;
    uint32_t texture;
    Sun sun;
    double turbidity;
    Color ground;
    double intensity, turn;
    bool is_light;
} Background;

// Reads a color or a sky into a Background.
FieldReader read_background;

// Sets the scene's background, adds the light of its sun and, where `ambient` is NaN, sets the ambient light,
// to 0 where the sky is a light. Nothing after an error.
void yaml_set_background(YamlReader *reader, const Background *background, Color ambient);

void yaml_read_camera(YamlReader *reader, const YamlNode *node);
void yaml_read_lights(YamlReader *reader, const YamlNode *node);
extern const Range range_disc_angle;
// Makes a directional light that of a disc in the sky, of an angle in degrees, unless that is 0.
void light_set_angle(Light *light, double degrees);
void yaml_read_mesh(YamlReader *reader, const YamlNode *mapping); // the value of `mesh:`

// Reads the list of objects of a scene, which shows progress, of a group or of a definition.
void yaml_read_object_list(YamlReader *reader, const YamlNode *list, bool shows_progress);

// Reads the `define` mapping; its names are then known to yaml_read_instance.
void yaml_read_definitions(YamlReader *reader, const YamlNode *node);
void yaml_definitions_free(YamlReader *reader);
void yaml_read_group(YamlReader *reader, const YamlNode *mapping);    // the value of `group:`
void yaml_read_instance(YamlReader *reader, const YamlNode *mapping); // the value of `instance:`

// Transforms the scene's objects from the index `first` on. Reports an error at the node `transform` if it
// does not suit one of them.
void yaml_transform_objects(YamlReader *reader, size_t first, const Affine *affine,
                            const YamlNode *transform);

// Reports an error at the node and returns false if the object cannot have the image of its material.
bool yaml_material_fits(YamlReader *reader, const Object *object, const YamlNode *node);
