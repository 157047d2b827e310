// The stages that change the tree of a YAML scene and the readers of its parts, one file each.
#pragma once

#include "host/import/load.h"
#include "host/import/yaml/fields.h"
#include "host/scene/affine.h"
#include "host/scene/daylight.h"

// Adds the files that the reader's tree includes, directly or indirectly, to the tree, to the scene and to
// the sources after `source`, which is the report's. Their materials, definitions, lights and objects come
// before the scene's. Reports errors and returns false if a file cannot be read.
bool yaml_include(YamlReader *reader, Source *source);
void yaml_included_free(YamlReader *reader);

// Applies, in order, the overrides PATH=VALUE that follow the document in the report's source. Each replaces
// the value at its PATH of the reader's tree, adds it, or removes it if VALUE is empty. Reports errors and
// returns false if an override does not fit.
bool yaml_override(YamlReader *reader);

// Replaces each mapping `{keys: {FRAME: VALUE, …}}` of the reader's tree with its value at the options'
// frame, a number or a list of numbers, and marks the scene as animated. Reports errors and returns false if
// a mapping cannot be read.
bool yaml_animate(YamlReader *reader);
// Returns whether a node of the tree is a mapping whose `keys` are frames.
bool yaml_has_keys(const YamlReader *reader, const YamlNode *node);

// Reads the `materials` mapping, whose names read_material accepts from then on.
void yaml_read_materials(YamlReader *reader, const YamlNode *node);

// Reads a material's name or an inline material into a uint32_t, the material's index.
FieldReader read_material;

// Reads an image's name, or a mapping of an image and its layer, into a uint32_t like Material.texture.
FieldReader read_texture;

// Returns the default material's index.
uint32_t material_default_index(YamlReader *reader);

// Returns the path of a file named in the scene, relative to the folder of the file that names it. Reports an
// error and returns NULL if the node is not a name. The caller frees it.
char *yaml_read_path(YamlReader *reader, const char *name, const YamlNode *node);

// Reads a transform, or a list of them that are applied in order, into an Affine that has an inverse.
FieldReader read_transform;

typedef struct {
    const YamlNode *node; // NULL if there is none
    SunPosition position;
    double angle; // of its disc
    bool shines;  // whether it is a light
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

// Sets the scene's background, ambient light and sky, and adds the light of its sun. If `ambient` is NaN,
// the ambient light is the background's mean, or 0 if the sky is a light. Adds no image or sun after an
// error.
void yaml_set_background(YamlReader *reader, const Background *background, Color ambient);

bool yaml_read_camera(YamlReader *reader, const YamlNode *node); // false with an error
void yaml_read_lights(YamlReader *reader, const YamlNode *node);
extern const Range range_disc_angle;
// Turns a directional light into that of a disc in the sky, of an angle in degrees, unless the angle is 0.
void light_set_angle(Light *light, double degrees);
void yaml_read_mesh(YamlReader *reader, const YamlNode *mapping); // the value of `mesh:`

// Reads the list of objects of a scene, which shows progress, of a group or of a definition.
void yaml_read_object_list(YamlReader *reader, const YamlNode *list, bool shows_progress);

// Reads the `define` mapping, whose names yaml_read_instance accepts from then on.
void yaml_read_definitions(YamlReader *reader, const YamlNode *node);
void yaml_definitions_free(YamlReader *reader);
void yaml_read_group(YamlReader *reader, const YamlNode *mapping);    // the value of `group:`
void yaml_read_instance(YamlReader *reader, const YamlNode *mapping); // the value of `instance:`

// Transforms the scene's objects from the index `first` on if the mapping has a `transform`, which is
// `affine`. Reports an error there if an object does not support it.
void yaml_transform_objects(YamlReader *reader, size_t first, const Affine *affine, const YamlNode *mapping);

// Reports an error at the mapping's `material` and returns false if the object cannot have its image.
bool yaml_material_fits(YamlReader *reader, const Object *object, const YamlNode *mapping);
