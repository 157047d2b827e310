// Writes the nodes of a BVH to FLAT_NODES, and changes those that are written.
#include "host/compile/bvh_nodes.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/bvh_widen.h"
#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include <stdlib.h>

// Returns each primitive's index in its shape's new array, in the tree's order.
static uint32_t *order_in_types(const Bvh *bvh)
{
    uint32_t *order = memory_allocate(bvh->primitive_count, sizeof *order);
    uint32_t counts[TYPE_COUNT] = {0};
    for (size_t i = 0; i < bvh->primitive_count; i++)
        order[i] = counts[bvh->types[i]]++;
    return order;
}

// Returns an inverted box outside the scene for unused child slots. A distant ray may still enter it through
// rounding; the slot then has no primitives.
static Bounds empty_place(const Bounds *bounds)
{
    Vector3 extent = vector_subtract(bounds->max, bounds->min);
    return (Bounds){vector_add(bounds->max, extent), vector_subtract(bounds->min, extent)};
}

FlatNode flat_node_at(const FlatArray *nodes, size_t index)
{
    const unsigned width = (unsigned)(4 * nodes->layout.scalar4_count / BVH_PLANES);
    double *planes = flat_array_at(nodes, index);
    uint32_t *child_index = (void *)(planes + (size_t)BVH_PLANES * width);
    return (FlatNode){planes, child_index, child_index + width, width};
}

static void child_box_write(const FlatNode *node, unsigned child, const Bounds *box)
{
    const double low[3] = {box->min.x, box->min.y, box->min.z};
    const double high[3] = {box->max.x, box->max.y, box->max.z};
    for (unsigned axis = 0; axis < 3; axis++) {
        node->planes[(BVH_LOW + axis) * node->width + child] = low[axis];
        node->planes[(BVH_HIGH + axis) * node->width + child] = high[axis];
    }
}

static void node_write(const BvhWideNode *wide, const Bvh *bvh, const uint32_t *order, const Bounds *empty,
                       const FlatNode *node)
{
    uint32_t next_node = wide->first_node;
    for (unsigned i = 0; i < node->width; i++) {
        const BvhChild *child = i < wide->child_count ? wide->children[i] : NULL;
        child_box_write(node, i, child ? &child->box : empty);
        if (child && child->count > 0) {
            node->child_index[i] = order[child->first];
            node->child_type[i] = child->count << 8 | bvh->types[child->first];
        } else if (child) {
            node->child_index[i] = next_node++;
            node->child_type[i] = BVH_NODE;
        }
    }
}

void nodes_write(CompiledScene *compiled, const Bvh *bvh, unsigned width)
{
    BvhWide wide;
    bvh_widen(&wide, bvh, width);
    flat_wide_array_renew(compiled, FLAT_NODES, wide.node_count, width, false);
    const FlatArray *nodes = &compiled->arrays[FLAT_NODES];
    // a visit replaces a node by at most `width` children, because a distant ray may enter the empty slots
    compiled->pending_children_max = (width - 1) * wide.depth + 1;
    OWNED uint32_t *order = order_in_types(bvh);
    const Bounds bounds = bvh_node_bounds(&bvh->nodes[0]), empty = empty_place(&bounds);
    for (size_t i = 0; i < wide.node_count; i++) {
        const FlatNode node = flat_node_at(nodes, i);
        node_write(&wide.nodes[i], bvh, order, &empty, &node);
    }
    bvh_wide_free(&wide);
}

void bvh_shift(CompiledScene *compiled, uint32_t node_base, uint32_t leaf_base)
{
    for (size_t i = 0; i < compiled->arrays[FLAT_NODES].count; i++) {
        const FlatNode node = flat_node_at(&compiled->arrays[FLAT_NODES], i);
        for (unsigned k = 0; k < node.width; k++)
            if (node.child_type[k] != BVH_EMPTY)
                node.child_index[k] += node.child_type[k] == BVH_NODE ? node_base : leaf_base;
    }
}

// Fits the boxes of leaves to their primitives.
static void leaves_fit(void *context, size_t begin, size_t end)
{
    const CompiledScene *compiled = context;
    for (size_t i = begin; i < end; i++) {
        const FlatNode node = flat_node_at(&compiled->arrays[FLAT_NODES], i);
        for (unsigned k = 0; k < node.width; k++) {
            const unsigned type = leaf_type(node.child_type[k]), count = leaf_count(node.child_type[k]);
            if (count == 0) continue;
            const FlatArray *array = &compiled->arrays[FLAT_FIRST_SHAPE + type];
            Bounds all = bounds_empty();
            const size_t first = leaf_first(compiled, &node, k);
            for (size_t p = first; p < first + count; p++)
                all = bounds_join(all, primitive_bounds(type, flat_array_at(array, p)));
            child_box_write(&node, k, &all);
        }
    }
}

static Bounds node_bounds(const FlatNode *node)
{
    Bounds all = bounds_empty();
    for (unsigned k = 0; k < node->width; k++) {
        if (node->child_type[k] == BVH_EMPTY) continue;
        const double *low = node->planes + k, *high = low + (size_t)BVH_HIGH * node->width;
        const size_t y = node->width, z = 2 * y;
        all = bounds_join(all, (Bounds){{low[0], low[y], low[z]}, {high[0], high[y], high[z]}});
    }
    return all;
}

void bvh_refit(CompiledScene *compiled)
{
    if (bvh_primitive_count(compiled) == 0) return; // no BVH, though the kernel may be built for one
    const FlatArray *nodes = &compiled->arrays[FLAT_NODES];
    compiled->changed[FLAT_NODES] = true;
    parallel_run(nodes->count, FLAT_RANGE_MIN / 16, leaves_fit, compiled);
    blocks_fill(compiled);
    // children come after their parent
    for (size_t i = nodes->count; i-- > 0;) {
        const FlatNode node = flat_node_at(nodes, i);
        for (unsigned k = 0; k < node.width; k++) {
            if (node.child_type[k] != BVH_NODE) continue;
            const FlatNode child = flat_node_at(nodes, node.child_index[k]);
            const Bounds box = node_bounds(&child);
            child_box_write(&node, k, &box);
        }
    }
    const FlatNode root = flat_node_at(nodes, 0);
    compiled->bvh_bounds = node_bounds(&root);
    const Bounds empty = empty_place(&compiled->bvh_bounds);
    for (size_t i = 0; i < nodes->count; i++) {
        const FlatNode node = flat_node_at(nodes, i);
        for (unsigned k = 0; k < node.width; k++)
            if (node.child_type[k] == BVH_EMPTY) child_box_write(&node, k, &empty);
    }
}
