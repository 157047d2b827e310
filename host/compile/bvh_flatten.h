// The flat scene's bounded primitives hung into a hierarchy.
#pragma once

#include "host/compile/bvh.h"
#include "host/compile/flatten.h"

// Fills FLAT_NODES, orders each shape's array as the leaves have it (unbounded shapes last), and notes in the
// header how many hang there and how far they reach. Nodes are as wide as kernels of so many lanes want them.
// A scene without bounded primitives is left as it is.
void bvh_flatten(CompiledScene *flat, unsigned lanes);

// How many primitives could hang.
size_t bounded_primitive_count(const CompiledScene *flat);

// The box of one primitive; false where it has none. A disc's is that of the ball around it: where the ray
// lies nearly in its plane the kernels know no more about t.
bool primitive_box(size_t kind, const void *primitive, Bounds *box);
