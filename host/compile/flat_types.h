// kernels/types.h on the host. The kernels' Light and Material are FlatLight and FlatMaterial here, beside
// the Scene's own.
#pragma once

#define Light    FlatLight
#define Material FlatMaterial
#include "kernels/types.h"
#undef Light
#undef Material
