// kernels/types.h on the host. The kernels' Light and Material are FlatLight and FlatMaterial here, because
// the Scene has types of those names.
#pragma once

#define Light    FlatLight
#define Material FlatMaterial
#include "kernels/types.h"
#undef Light
#undef Material
