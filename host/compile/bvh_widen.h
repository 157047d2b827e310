// A binary BVH collapsed into nodes of many children.
#pragma once

#include "host/compile/bvh.h"
#include "host/compile/flat_types.h"

typedef struct {
    const BvhChild *children[BVH_WIDTH_MAX]; // inner ones, with count 0, are also wide nodes
    unsigned child_count;
    uint32_t first_node; // its inner children are this wide node and those behind it, in their order
} BvhWideNode;

typedef struct {
    BvhWideNode *nodes; // the root first, children behind their parent
    size_t node_count;
    BvhChild *leaves; // that were subtrees of the binary tree
    size_t leaf_count;
    unsigned depth; // nodes on the longest path
} BvhWide;

// Nodes of at most `width` children, 2 to BVH_WIDTH_MAX, and leaves of up to leaf_size_max primitives of
// their type, so chosen that they cost the least that the binary tree allows: areas stand for how often rays
// come by (Ylitie, Karras, Laine, Efficient incoherent ray traversal on GPUs through compressed wide BVHs,
// HPG 2017; here the binary tree's leaves may have more than one primitive, and are not split). What is
// written to `wide` lasts as long as the binary tree.
void bvh_widen(BvhWide *wide, const Bvh *bvh, unsigned width);
void bvh_wide_free(BvhWide *wide);
