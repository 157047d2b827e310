// Checks the JSON types of glTF's members. Readers treat a member of another type as missing.
#include "host/base/array.h"
#include "host/import/mesh/gltf.h"

#include <string.h>

// MEMBER_OBJECTS is an array of objects.
typedef enum { MEMBER_ARRAY, MEMBER_OBJECT, MEMBER_STRING, MEMBER_BOOLEAN, MEMBER_OBJECTS } MemberType;

// Members by their path, in which [] stands for every element. A required member of another type makes the
// file invalid. An optional one is ignored.
static const struct {
    const char *path;
    MemberType type;
    bool is_needed;
} members[] = {
    {"extensionsUsed", MEMBER_ARRAY, false},
    {"extensionsRequired", MEMBER_ARRAY, true},
    {"asset", MEMBER_OBJECT, true},
    {"scenes", MEMBER_OBJECTS, true},
    {"scenes[].nodes", MEMBER_ARRAY, true},
    {"nodes", MEMBER_OBJECTS, true},
    {"nodes[].children", MEMBER_ARRAY, true},
    {"nodes[].extensions", MEMBER_OBJECT, false},
    {"nodes[].extensions.KHR_lights_punctual", MEMBER_OBJECT, false},
    {"meshes", MEMBER_OBJECTS, true},
    {"meshes[].primitives", MEMBER_ARRAY, true},
    {"meshes[].primitives[]", MEMBER_OBJECT, true},
    {"meshes[].primitives[].attributes", MEMBER_OBJECT, true},
    {"accessors", MEMBER_OBJECTS, true},
    {"accessors[].normalized", MEMBER_BOOLEAN, true},
    {"accessors[].sparse", MEMBER_OBJECT, true},
    {"bufferViews", MEMBER_OBJECTS, true},
    {"buffers", MEMBER_OBJECTS, true},
    {"materials", MEMBER_OBJECTS, false},
    {"materials[].alphaMode", MEMBER_STRING, false},
    {"materials[].emissiveTexture", MEMBER_OBJECT, false},
    {"materials[].pbrMetallicRoughness", MEMBER_OBJECT, false},
    {"materials[].pbrMetallicRoughness.baseColorTexture", MEMBER_OBJECT, false},
    {"materials[].pbrMetallicRoughness.baseColorTexture.extensions", MEMBER_OBJECT, false},
    {"materials[].pbrMetallicRoughness.baseColorTexture.extensions.KHR_texture_transform", MEMBER_OBJECT,
     false},
    {"materials[].extensions", MEMBER_OBJECT, false},
    {"materials[].extensions.KHR_materials_emissive_strength", MEMBER_OBJECT, false},
    {"materials[].extensions.KHR_materials_ior", MEMBER_OBJECT, false},
    {"materials[].extensions.KHR_materials_transmission", MEMBER_OBJECT, false},
    {"materials[].extensions.KHR_materials_volume", MEMBER_OBJECT, false},
    {"textures", MEMBER_OBJECTS, false},
    {"samplers", MEMBER_OBJECTS, false},
    {"images", MEMBER_OBJECTS, false},
    {"images[].uri", MEMBER_STRING, false},
    {"cameras", MEMBER_OBJECTS, false},
    {"cameras[].perspective", MEMBER_OBJECT, false},
    {"cameras[].orthographic", MEMBER_OBJECT, false},
    {"extensions", MEMBER_OBJECT, false},
    {"extensions.KHR_lights_punctual", MEMBER_OBJECT, false},
    {"extensions.KHR_lights_punctual.lights", MEMBER_OBJECTS, false},
    {"extensions.KHR_lights_punctual.lights[].spot", MEMBER_OBJECT, false},
};

static bool type_check(Gltf *gltf, const GltfItem *item, MemberType type)
{
    static const char *const names[] = {"an array", "an object", "a string", "true or false"};
    const json_t *json = item->json;
    // null is an empty value that some writers have for a missing member
    const bool is_sound = !json || json_is_null(json) ||
                          (type == MEMBER_ARRAY    ? json_is_array(json)
                           : type == MEMBER_OBJECT ? json_is_object(json)
                           : type == MEMBER_STRING ? json_is_string(json)
                                                   : json_is_boolean(json));
    return is_sound || gltf_fails(gltf, item, "must be %s", names[type]);
}

// Checks the members below the item to which the path leads.
static bool path_check(Gltf *gltf, const GltfItem *item, const char *path, MemberType type)
{
    if (*path == '\0' && type == MEMBER_OBJECTS)
        return type_check(gltf, item, MEMBER_ARRAY) && path_check(gltf, item, "[]", MEMBER_OBJECT);
    if (*path == '\0') return type_check(gltf, item, type);
    if (*path == '[') {
        bool is_sound = true;
        for (size_t i = 0; i < json_array_size(item->json) && (is_sound || gltf->is_optional); i++) {
            const GltfItem element = gltf_element(item, i);
            is_sound = path_check(gltf, &element, path + 2, type) && is_sound;
        }
        return is_sound;
    }
    char key[64];
    if (*path == '.') path++;
    const size_t length = strcspn(path, ".[");
    snprintf(key, sizeof key, "%.*s", (int)length, path);
    const GltfItem member = gltf_member(item, key);
    return path_check(gltf, &member, path + length, type);
}

bool gltf_structure_check(Gltf *gltf)
{
    const GltfItem root = {.json = gltf->root};
    bool is_sound = true;
    for (size_t i = 0; i < COUNT_OF(members) && is_sound; i++) {
        gltf->is_optional = !members[i].is_needed;
        is_sound = path_check(gltf, &root, members[i].path, members[i].type) || gltf->is_optional;
    }
    gltf->is_optional = false;
    return is_sound;
}
