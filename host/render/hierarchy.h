// The flat scene's bounded primitives hung into a hierarchy.
#pragma once

#include "host/render/flatten.h"

// Fills FLAT_NODES, orders each shape's array as the leaves have it (unbounded shapes last), and notes in the
// header how many hang there and how far they reach. Nodes are as wide as kernels of so many lanes want them.
// A scene without bounded primitives is left as it is.
void hierarchy_hang(FlatScene *flat, unsigned lanes);

// How many primitives could hang.
size_t hierarchy_bounded_count(const FlatScene *flat);
