// Reads glTF 2.0 files, .gltf or .glb (Khronos Group, glTF 2.0 Specification, 2021). jansson parses the JSON
// and glint interprets its members.
#pragma once

#include "host/import/mesh/draft.h"
#include "host/scene/affine.h"

#include <jansson.h>

// A value of the JSON text, NULL if it is missing, and its path for messages, such as "nodes[3].mesh".
typedef struct {
    const json_t *json;
    bool is_wrong; // it or what contains it is missing, because its type is wrong, which was reported
    char path[112];
} GltfItem;

typedef struct {
    const char *bytes;
    size_t length;
    Text owned;  // the bytes if they were decoded or read, or empty if they are the GLB file's
    FileId file; // of an external one
} GltfBuffer;

enum { UV_SETS_MAX = 255 };

// A material's texture and its mapping.
typedef struct {
    uint32_t number; // of the scene's texture, or 0 for none
    size_t uv_set;
    double uv_rows[2][3]; // from the file's texture coordinates to those of the texture
    TextureWrap wraps[2]; // along u and v
} GltfTexture;

// A material of the file. Only primitives that have its set of texture coordinates show its texture.
typedef struct {
    Material look;
    const char *name; // NULL for none
    bool is_read;
    GltfTexture texture, normals;
    double textured_ambient; // the ambient factor with the texture
    bool texture_emits;      // whether it emits light by textured_ambient instead of the emission
    uint32_t scene_index[2]; // without and with the texture, DRAFT_NONE before it is added
} GltfMaterial;

typedef struct {
    MeshDraft *draft;
    json_t *root;
    GltfBuffer binary;   // the BIN chunk of a GLB file
    GltfBuffer *buffers; // one for each of the file's, where `bytes` is NULL before it is read
    size_t buffer_count;
    size_t byte_count, element_count; // of the buffers, and of the accessors each time that they are read
    GltfMaterial *materials;          // one for each of the file's, then the default
    uint32_t *images; // the textures of each image as colors and as normals, DRAFT_NONE before they are read
    bool *is_visited; // by node
    bool is_optional; // whether errors in what is being read are warnings
    bool has_failed;  // whether an error was reported
} Gltf;

// Reports that the item must be or lacks something, which the message's verb begins. The report is an error,
// or a warning while `is_optional` is set. A wrong item gets no second report. Always returns false.
bool gltf_fails(Gltf *gltf, const GltfItem *item, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void gltf_warn(Gltf *gltf, const GltfItem *item, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
// Warns by a sentence about a feature that glint does not show. Only the first place with the same text is
// named.
void gltf_warn_once(Gltf *gltf, const GltfItem *item, const char *text);

GltfItem gltf_root(const Gltf *gltf);
// Returns a member of any type of an object.
GltfItem gltf_member(const GltfItem *item, const char *key);
// Return a member that must be an object, an array or a string, an object in an array, an extension of the
// item, and an object in one of the file's arrays, such as "nodes". Each of these reports a value of another
// type by gltf_fails and returns it as missing.
GltfItem gltf_object(Gltf *gltf, const GltfItem *item, const char *key);
GltfItem gltf_array(Gltf *gltf, const GltfItem *item, const char *key);
GltfItem gltf_string(Gltf *gltf, const GltfItem *item, const char *key);
GltfItem gltf_element(Gltf *gltf, const GltfItem *array, size_t index);
GltfItem gltf_extension(Gltf *gltf, const GltfItem *item, const char *name);
GltfItem gltf_entry(Gltf *gltf, const char *array, size_t index);
size_t gltf_count(Gltf *gltf, const char *array);

// Each of these reads a member and leaves the value unchanged if it is missing. Returns false with an error
// if the member has another type or is out of range.
bool gltf_integer(Gltf *gltf, const GltfItem *item, const char *key, size_t low, size_t high, size_t *value);
// Reads an index into one of the file's arrays.
bool gltf_index(Gltf *gltf, const GltfItem *item, const char *key, const char *array, size_t *index);
// Reads an element of an array that is an index into one of the file's arrays. A missing element is an error.
bool gltf_element_index(Gltf *gltf, const GltfItem *list, size_t element, const char *array, size_t *index);
// Reads one number if `count` is 1, else an array of `count` numbers. Magnitudes are at most NUMBER_MAX.
bool gltf_numbers(Gltf *gltf, const GltfItem *item, const char *key, size_t count, double *values);

// gltf_accessor.c

// Numbers in rows of `width`.
typedef struct {
    double *items;
    size_t count, width;
} GltfNumbers;

// Reads the accessor that a member names: indices if `width` is 1, else an attribute, of `width`
// components. Without the member the number of rows is 0. Returns false with an error. The caller frees the
// rows in either case.
bool gltf_accessor_read(Gltf *gltf, const GltfItem *item, const char *key, size_t width,
                        GltfNumbers *numbers);
// Finds the bytes of the buffer view that a member names. Returns false with an error.
bool gltf_view_read(Gltf *gltf, const GltfItem *item, const char *key, Source *bytes, size_t *stride);
// Decodes a `data:` URI. Returns false if the URI has another scheme or is damaged.
bool gltf_data_decode(Text *bytes, const char *uri);
// Returns the path of the file that a URI names, or NULL if it names none. Warns if the file lies elsewhere.
// The caller frees it.
char *gltf_path(Gltf *gltf, const GltfItem *uri);

// gltf_material.c

// Returns the primitive's material, or the default if it names none or a missing one.
GltfMaterial *gltf_material(Gltf *gltf, const GltfItem *primitive);
// Returns the material's index in the scene. Adds the material on its first use.
uint32_t gltf_material_index(Gltf *gltf, GltfMaterial *material, bool is_textured);

// gltf_node.c

// Adds the nodes of the file's scene to the draft. Returns false with an error.
bool gltf_scene_read(Gltf *gltf);
