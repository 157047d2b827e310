// kernels/types.h on the host. The kernels' Light, SkyCell and Material are FlatLight, FlatSkyCell and
// FlatMaterial here, because the Scene has types of those names.
#pragma once

#include <stdbool.h>

#define Light    FlatLight
#define SkyCell  FlatSkyCell
#define Material FlatMaterial
#include "kernels/types.h"
#undef Light
#undef SkyCell
#undef Material

// Returns whether kernels with several lanes read a leaf of this type as a block.
static inline bool type_has_blocks(unsigned type)
{
    return type == TYPE_TRIANGLES || type == TYPE_SPHERES;
}
