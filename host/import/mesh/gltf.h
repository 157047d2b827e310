// A glTF 2.0 file being read (Khronos Group, glTF 2.0 Specification, 2021), .gltf or .glb. Its JSON is read
// by jansson; what glint makes of each member is written here.
#pragma once

#include "host/import/mesh/affine.h"
#include "host/import/mesh/draft.h"

#include <jansson.h>

// A value of the JSON text, NULL where it is missing, and its path for messages, such as "nodes[3].mesh".
typedef struct {
    const json_t *json;
    char path[112];
} GltfItem;

typedef struct {
    const char *bytes;
    size_t length;
    Text owned;            // what was decoded or read; else the bytes are the GLB file's
    uint64_t device, file; // of an external file
} GltfBuffer;

enum { UV_SETS_MAX = 255 };

// How a material looks to primitives. Those with the texture coordinates that it asks for show its texture.
typedef struct {
    Material look;
    bool is_read;
    uint32_t texture; // of the scene; 0: none
    size_t uv_set;
    double uv_rows[2][3];    // from the file's texture coordinates to those of the texture
    TextureWrap wraps[2];    // along u and v
    double textured_ambient; // the ambient factor with the texture
    uint32_t scene_index[2]; // without and with the texture; DRAFT_NONE: not added yet
} GltfMaterial;

// What glint does not show of a file: one warning for each, at the first place.
typedef enum {
    GLTF_SKIN,
    GLTF_MORPH,
    GLTF_VERTEX_COLOR,
    GLTF_POINTS,
    GLTF_SCENES,
    GLTF_ANIMATION,
    GLTF_VIEW,
    GLTF_CAMERAS,
    GLTF_EMISSION,
    GLTF_EMISSIVE_TEXTURE,
    GLTF_UNLIT_TINT,
    GLTF_METAL_TEXTURE,
    GLTF_METAL_COLOR,
    GLTF_NORMAL_TEXTURE,
    GLTF_OCCLUSION_TEXTURE,
    GLTF_TEXTURE_ALPHA,
    GLTF_NEAREST,
    GLTF_ABSORPTION,
    GLTF_GLASS_COLOR,
    GLTF_LOSS_COUNT
} GltfLoss;

typedef struct {
    MeshDraft *draft;
    json_t *root;
    GltfBuffer binary;   // GLB's
    GltfBuffer *buffers; // one for each of the file's; not read yet where `bytes` is NULL
    size_t buffer_count;
    size_t byte_count, element_count; // of the buffers, and of the accessors as often as they are read
    GltfMaterial *materials;          // one for each of the file's, then the default
    uint32_t *images;                 // the texture of each image; DRAFT_NONE: not read yet
    bool *is_visited;                 // by node
    unsigned losses;                  // bits
    bool is_optional;                 // what is read: errors are warnings, and it is not used
} Gltf;

// Reports an error at the item, a warning where that is optional; always false.
bool gltf_fails(Gltf *gltf, const GltfItem *item, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void gltf_warn(Gltf *gltf, const GltfItem *item, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
// Warns once of what is not shown.
void gltf_lose(Gltf *gltf, GltfLoss loss, const GltfItem *item);

// A member of an object and an element of an array.
GltfItem gltf_member(const GltfItem *item, const char *key);
GltfItem gltf_element(const GltfItem *item, size_t index);
// An element of one of the file's arrays, such as "nodes".
GltfItem gltf_entry(const Gltf *gltf, const char *array, size_t index);
size_t gltf_count(const Gltf *gltf, const char *array);
// An extension of the item, NULL where that lacks it.
GltfItem gltf_extension(const GltfItem *item, const char *name);

// Each leaves the value unchanged where the member is missing, and reports an error and returns false where
// it is something else.
bool gltf_integer(Gltf *gltf, const GltfItem *item, const char *key, size_t low, size_t high, size_t *value);
// An index into one of the file's arrays.
bool gltf_index(Gltf *gltf, const GltfItem *item, const char *key, const char *array, size_t *index);
// An element of an array that is such an index; missing is an error.
bool gltf_element_index(Gltf *gltf, const GltfItem *list, size_t element, const char *array, size_t *index);
// One number where `count` is 1, else an array of so many; each is at most NUMBER_MAX.
bool gltf_numbers(Gltf *gltf, const GltfItem *item, const char *key, size_t count, double *values);

// gltf_accessor.c

// Rows of `width` numbers each.
typedef struct {
    double *items;
    size_t count, width;
} GltfNumbers;

// Reads the accessor that a member names, of scalars or vectors of `width` components. Without the member
// there are no rows. False with an error; the rows must be freed in any case.
bool gltf_accessor_read(Gltf *gltf, const GltfItem *item, const char *key, size_t width,
                        GltfNumbers *numbers);
// What a buffer view shows of its buffer. False with an error.
bool gltf_view_read(Gltf *gltf, const GltfItem *item, const char *key, Source *bytes, size_t *stride);
// Bytes of a `data:` URI. False if it is another or damaged.
bool gltf_data_decode(Text *bytes, const char *uri);
// The file that a relative URI names; NULL: it names none.
char *gltf_path(const Gltf *gltf, const char *uri);

// gltf_material.c

// The material of a primitive, the default where it names none or one that is not there.
GltfMaterial *gltf_material(Gltf *gltf, const GltfItem *primitive);
// Its index in the scene.
uint32_t gltf_material_index(Gltf *gltf, GltfMaterial *material, bool is_textured);

// gltf_node.c

// Adds what stands in the file's scene.
bool gltf_scene_read(Gltf *gltf);
