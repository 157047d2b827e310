// kernels/types.h on the host. The kernels' Light and Material are FlatLight and FlatMaterial here, because
// the Scene has types of those names.
#pragma once

#include <stdbool.h>

#define Light    FlatLight
#define Material FlatMaterial
#include "kernels/types.h"
#undef Light
#undef Material

// Returns whether kernels with several lanes read a leaf of this kind as a block.
static inline bool kind_has_blocks(unsigned kind)
{
    return kind == KIND_TRIANGLES || kind == KIND_SPHERES;
}
