// The cull_spheres that packets of rays through one point are held against first.
#pragma once

#include "host/compile/flatten.h"

// Fills FLAT_CULL_SPHERES and notes in the header how many each common_origin has, once it is settled what
// hangs in the hierarchy. None where they would be more than a million. `wide`: the kernel's precision is
// double.
void culling_fill(CompiledScene *flat, bool wide);
