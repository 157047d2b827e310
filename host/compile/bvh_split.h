// Splits a range of primitives in two by the surface area heuristic on bins of their centers (Wald, On fast
// construction of SAH-based bounding volume hierarchies, RT 2007). Unlike there, the bins are along all three
// axes, and small ranges have fewer.
#pragma once

#include "host/compile/bvh.h"
#include "host/scene/bounds.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef float Float4 __attribute__((vector_size(16)));
typedef int32_t Int4 __attribute__((vector_size(16)));

// A box while the tree is built. Single precision suffices to choose splits. Coordinates are scaled so that
// the largest is about 1, which keeps areas of any scene in range.
typedef struct {
    Float4 low, high; // the fourth lanes unused
} BuildBox;

// A primitive while the tree is built. The fourth lanes of the box hold its index and its type, as the bits
// of floats from 2 on, with which arithmetic is as fast as with others.
typedef struct {
    BuildBox box;
} PrimitiveReference;

// The bounds of the primitives' boxes, and of their centers.
typedef struct {
    BuildBox boxes, centers;
} RangeBounds;

// Makes a reference with an index below 2^28. Multiplies the box's coordinates by `scale`.
PrimitiveReference reference_make(Bounds box, double scale, uint32_t index, uint8_t type);

static inline uint32_t reference_index(const PrimitiveReference *reference)
{
    return (uint32_t)((Int4)reference->box.low)[3] & 0xfffffff;
}

static inline uint8_t reference_type(const PrimitiveReference *reference)
{
    return (uint8_t)((Int4)reference->box.high)[3];
}

RangeBounds range_bounds_empty(void);
RangeBounds range_bounds_join(RangeBounds a, RangeBounds b);
RangeBounds range_bounds_of(const PrimitiveReference *references, size_t count);

// Returns whether the range is within the leaf size of every type in it.
bool range_fits_leaf(const PrimitiveReference *references, size_t count, BvhLeaves leaves);

// Partitions the range if that pays or the range is too large for a leaf, and sets the bounds of both sides.
// With `is_parallel`, uses several idle threads. Returns the number of primitives on the left side, or
// `count` if the range stays whole.
size_t range_split(PrimitiveReference *references, size_t count, const RangeBounds *bounds, BvhLeaves leaves,
                   bool is_parallel, RangeBounds sides[2]);
