// Builds the bounding volume hierarchy of a scene's bounded primitives, a binary tree by the surface area
// heuristic (bvh_split.h). Two threads build the sides of a large split. A leaf has primitives of one type,
// and only one if it is an instance. The number of threads changes the order of the nodes, but not the tree.
#pragma once

#include "host/base/stage.h"
#include "host/scene/bounds.h"
#include "kernels/types.h"
#include <stddef.h>
#include <stdint.h>

// A child: an inner node's index, or `count` primitives from `first` of the order below.
typedef struct {
    Bounds box;
    uint32_t first, count; // if count is 0, `first` is the node's index
} BvhChild;

typedef struct {
    BvhChild children[2];
} BvhBinaryNode;

// Limits on the sizes of leaves. A leaf of a type with blocks holds up to block_size primitives, which are
// tested at once. A range of these types that fits is divided only by type.
typedef struct {
    unsigned size_max;   // of other leaves
    unsigned block_size; // 0 if kernels read no blocks
    bool counts_blocks;  // splits are chosen by numbers of blocks, not of primitives; needs a block_size
} BvhLeaves;

static inline bool type_is_in_blocks(BvhLeaves leaves, unsigned type)
{
    return leaves.block_size > 0 && type_has_blocks(type);
}

// Returns the most primitives of a leaf of one type.
static inline unsigned leaf_size_max(BvhLeaves leaves, unsigned type)
{
    return type_is_in_blocks(leaves, type) ? leaves.block_size : leaves.size_max;
}

// Returns the box around both children. An empty child adds nothing.
static inline Bounds bvh_node_bounds(const BvhBinaryNode *node)
{
    return bounds_join(node->children[0].box, node->children[1].box);
}

typedef struct {
    BvhBinaryNode *nodes; // the root first; a tree of one leaf has a second child with an empty box
    size_t node_count;
    uint32_t *order; // the primitives, leaf by leaf
    uint8_t *types;  // types of the primitives, in this order
    size_t primitive_count;
    unsigned depth; // inner nodes on the longest path
    BvhLeaves leaves;
} Bvh;

enum { BVH_DEPTH_MAX = 80 };

// Builds the tree of at most 2^28 finite boxes, at most BVH_DEPTH_MAX deep whatever the boxes are.
// `types[i]` is the type of primitive i. All primitives of a leaf are of one type. `stage`, unless NULL,
// counts the primitives of finished leaves.
void bvh_build(Bvh *bvh, const Bounds *boxes, const uint8_t *types, size_t count, BvhLeaves leaves,
               Stage *stage);
void bvh_free(Bvh *bvh);
