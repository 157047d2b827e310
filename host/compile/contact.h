// Where transparent and opaque surfaces may touch.
#pragma once

#include "host/compile/flatten.h"

// Notes in the header a box around all places where a transparent primitive may come near an opaque one; an
// empty one where none does. Only hits in it are asked for an opaque surface in the same place
// (kernels/shading/surface.h).
void contact_find(CompiledScene *flat);
