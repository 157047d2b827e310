// The scene's flat arrays, in double and relative to the eye, which the kernels render.
#pragma once

#include "host/compile/features.h"
#include "host/scene/bounds.h"
#include <stdbool.h>
#include <stddef.h>

// The layout of a flat struct: its scalar4 members first, then its uint4 members.
typedef struct {
    size_t size, scalar4_count, uint4_count;
} FlatLayout;

typedef struct {
    void *items;
    size_t count;
    FlatLayout layout;
} FlatArray;

// The arrays in the arena, in its order, then those with separate buffers.
#define FLAT_NUMBER(NAME, Type, name, names) FLAT_##NAME,
typedef enum {
    FLAT_HEADER,
    ARENA_LIST(FLAT_NUMBER) FLAT_NODES,
    FLAT_TEXELS,
    FLAT_COUNT,
    FLAT_FIRST_SHAPE = FLAT_HEADER + 1
} FlatType;

// A texture's full size, its levels in FLAT_TEXTURE_LEVELS, and its largest channel.
typedef struct CompiledTexture {
    uint32_t width, height, first_level, level_count;
    float largest_texel;
} CompiledTexture;

typedef struct {
    FlatArray arrays[FLAT_COUNT];
    bool changed[FLAT_COUNT];      // since the caller cleared it
    FeatureSet features;           // that the kernels need
    double unit;                   // scene units per unit of length in the arrays, a power of two
    uint32_t pending_children_max; // of the BVH, while a ray visits it; 0 without one
    uint64_t primitives_hash; // of the shapes and objects before the BVH orders them, if settings ask for it
    double bvh_seconds;       // building or refitting the BVH
    double flatten_seconds;   // everything else in scene_compile or scene_move
    // The results of stages that later ones and the header need.
    CompiledTexture *textures;       // one for each of the scene's textures
    struct InstancePlan *instances;  // NULL if no mesh is shared
    uint32_t bvh_counts[TYPE_COUNT]; // primitives in the BVH, the first of their arrays
    Bounds bvh_bounds;               // of these; 0 if there are none
    uint32_t cull_sphere_count;      // per common origin
    Vector3 eye;                     // from which the arrays are seen; NAN: a move failed
    Vector3 eye_offset;              // from there to the camera's eye; 0 unless a preview
    Bounds contact;                  // where transparent and opaque primitives may touch
} CompiledScene;

void compiled_scene_free(CompiledScene *compiled); // and zeroes
#define OwnedCompiledScene __attribute__((cleanup(compiled_scene_free))) CompiledScene

// Returns the number of primitives in the BVH.
static inline uint32_t bvh_primitive_count(const CompiledScene *compiled)
{
    uint32_t count = 0;
    for (size_t type = 0; type < TYPE_COUNT; type++)
        count += compiled->bvh_counts[type];
    return count;
}

static inline Vector3 vector3_of(const scalar4 *v)
{
    return (Vector3){v->x, v->y, v->z};
}

static inline scalar4 scalar4_of(Vector3 v, double w)
{
    return (scalar4){v.x, v.y, v.z, w};
}

// Each of these replaces an array by one of `count` zeroed structs. Nodes have `width` children and blocks of
// triangles have `width` triangles, a power of two from 4 to 16. A narrow array has its reals as floats.
void flat_array_renew(CompiledScene *compiled, size_t type, size_t count);
void flat_wide_array_renew(CompiledScene *compiled, size_t type, size_t count, unsigned width,
                           bool is_narrow);
void flat_array_renew_as(CompiledScene *compiled, size_t type, size_t count, FlatLayout layout);
void *flat_array_at(const FlatArray *array, size_t index);
// Returns whether an array's order, or its entire content, depends on the BVH, and so on the kernel's lanes.
bool is_ordered_by_bvh(size_t type);
// Extends the hash by the members of an array's structs.
uint64_t flat_array_hash(uint64_t hash, const FlatArray *array);
// Returns a pointer to the object's id in a shape's struct of this array.
uint32_t *flat_id(const FlatArray *array, void *primitive);

// The fewest flat structs that are worth a thread.
enum { FLAT_RANGE_MIN = 16384 };

// Return an array's bytes in the kernel's width, and write them to `target`, which holds as many.
size_t flat_array_size(const FlatArray *array, bool is_double);
void flat_array_write(const FlatArray *array, bool is_double, void *target);
