// From a Scene to the device's flat arrays, one per shape, in double and relative to the eye.
#pragma once

#include "host/compile/flat_types.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stddef.h>

// How a flat struct is laid out: its scalar4 members first, its uint4 members after them.
typedef struct {
    size_t size, scalar4_count, uint4_count;
} FlatLayout;

typedef struct {
    void *items;
    size_t count;
    FlatLayout layout;
} FlatArray;

typedef enum {
    FLAT_HEADER,
    FLAT_FIRST_SHAPE,
    FLAT_TRIANGLE_NORMALS = FLAT_FIRST_SHAPE + KIND_COUNT,
    FLAT_TRIANGLE_UVS,
    FLAT_NODES,
    FLAT_CULL_SPHERES,
    FLAT_OBJECTS,
    FLAT_MATERIALS,
    FLAT_LIGHTS,
    FLAT_TEXTURE_LEVELS,
    FLAT_TEXELS,
    FLAT_COUNT
} FlatKind;

// The arrays in the order of the kernels' arguments.
typedef struct {
    FlatArray arrays[FLAT_COUNT];
} CompiledScene;

typedef struct {
    uint32_t width, height, sample_count, bounce_count;
    bool shift_to_eye; // else positions stay as they are
    bool wide;         // the kernel's precision is double; else every number is first rounded to float
} FlattenSettings;

// Every number of the scene is rounded to the kernel's precision once, after the eye's position was
// subtracted in double; what is derived from numbers (axes, slopes, squares of a checker) is derived from the
// rounded ones.
void flatten(CompiledScene *flat, const Scene *scene, const FlattenSettings *settings);
void compiled_scene_free(CompiledScene *flat);

static inline Vector3 vector3_of(const scalar4 *v)
{
    return (Vector3){v->x, v->y, v->z};
}

FlatArray flat_array_make(size_t kind, size_t count);    // zeroed
FlatArray flat_nodes_make(size_t count, unsigned width); // of `width` children: a power of two, 4 to 16
void *flat_array_at(const FlatArray *array, size_t index);
uint32_t flat_id(const FlatArray *array, size_t index); // of a shape's struct: the object's

// Bytes of an array in the kernel's width, and the array itself written there: `target` has room for them.
size_t flat_array_size(const FlatArray *array, bool wide);
void flat_array_write(const FlatArray *array, bool wide, void *target);
