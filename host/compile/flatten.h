// The scene's objects while they become flat arrays.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/compile/rounding.h"

typedef struct {
    CompiledScene *compiled;
    const Scene *scene;
    Rounding rounding;
    void *moved;         // the flat struct to replace, as another eye saw it, or NULL to append
    size_t part;         // index of a mesh's triangle
    FeatureSet features; // needed by primitives beyond those of their types
    size_t counts[TYPE_COUNT], normals_count, uvs_count, entry_count; // so far
    size_t primitive_count;                                           // so far: the next id
} Flattening;

// Sets HAS_POWER and the eye's power, which then defines the primitive. Returns false if it overflows.
bool primitive_set_power(Flattening *flattening, double power, uint4 *id);

// Appends a flat struct with the next id, in id.x, to its type's array, or replaces the one that is moved.
void primitive_add(Flattening *flattening, int type, const void *primitive, uint32_t material);
