// The nodes of a BVH in FLAT_NODES, and the blocks that kernels with several lanes read for its leaves of
// triangles and spheres.
#pragma once

#include "host/compile/bvh.h"
#include "host/compile/compiled_scene.h"

// The parts of a node of FLAT_NODES.
typedef struct {
    double *planes;
    uint32_t *child_index, *child_type;
    unsigned width;
} FlatNode;

FlatNode flat_node_at(const FlatArray *nodes, size_t index);

// Fills FLAT_NODES with the tree, collapsed into nodes of `width` children.
void nodes_write(CompiledScene *compiled, const Bvh *bvh, unsigned width);

// bvh_blocks.c

// Makes a block for each leaf of triangles or spheres, but does not fill it.
void blocks_place(CompiledScene *compiled, unsigned width, bool is_double);
// Copies the triangles' vertices and the spheres into the blocks.
void blocks_fill(CompiledScene *compiled);
// Returns the index of a leaf's first primitive in its shape's array.
size_t leaf_first(const CompiledScene *compiled, const FlatNode *node, unsigned child);
