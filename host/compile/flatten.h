// The scene's objects while they become flat arrays.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/compile/rounding.h"

typedef struct {
    CompiledScene *compiled;
    const Scene *scene;
    Rounding rounding;
    void *moved;         // the flat struct to replace, as another eye saw it; NULL: they are appended
    size_t part;         // of the object: which of a mesh's triangles
    FeatureSet features; // that primitives need beyond those of their types
    size_t counts[TYPE_COUNT], normals_count, uvs_count, entry_count; // so far
    size_t primitive_count;                                           // so far: the next id
} Flattening;

// Whether the kernel's precision can hold the eye's power of a primitive, which then defines it (HAS_POWER).
bool primitive_take_power(Flattening *flattening, double power, uint4 *id);

// Appends a flat struct to its type's array and gives it the next id, in id.x; or replaces the one that is
// moved.
void primitive_add(Flattening *flattening, int type, const void *primitive, uint32_t material);
