// A binary BVH collapsed into nodes of many children.
#pragma once

#include "host/compile/bvh.h"

typedef struct {
    const BvhChild *children[BVH_WIDTH_MAX]; // those with count 0 are also wide nodes
    unsigned child_count;
    uint32_t first_node; // its inner children are this wide node and those behind it, in their order
} BvhWideNode;

typedef struct {
    BvhWideNode *nodes; // the root first, children behind their parent
    size_t node_count;
    BvhChild *leaves; // leaves that were subtrees of the binary tree
    size_t leaf_count;
    unsigned depth; // nodes on the longest path
} BvhWide;

// Collapses the binary tree into nodes of at most `width` children, 2 to BVH_WIDTH_MAX, and leaves of up to
// leaf_size_max primitives of their type, at the least cost that the binary tree allows. Areas stand for the
// frequency of visits (Ylitie, Karras, Laine, Efficient incoherent ray traversal on GPUs through compressed
// wide BVHs, HPG 2017; here the binary tree's leaves may have several primitives and are not split). `wide`
// refers to the binary tree, which must outlive it.
void bvh_widen(BvhWide *wide, const Bvh *bvh, unsigned width);
void bvh_wide_free(BvhWide *wide);
