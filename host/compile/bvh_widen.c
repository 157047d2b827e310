#include "host/compile/bvh_widen.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

// SAH costs of testing a node's boxes, visiting a child, testing a primitive, and testing a block. Tuned by
// measurement. A primitive's test is cheap because its arithmetic overlaps memory latency.
static const double node_cost = 1, visit_cost = 1, intersection_cost = 0.4, block_cost = 2;

// The extra cost of a subtree that takes one slot. It decides ties where areas are 0 and vanishes against
// other costs, which are of the order of 1.
static const float tie_cost = 0x1p-40f;

// Entry i is a subtree's least cost in at most i slots of the wide node above it, minus leaves_cost; entry 0
// is unused. In one slot it is a separate wide node or a leaf. The leaves cost the same in all slots.
// Leaving them out keeps the float's digits, and ties, for what differs.
typedef float Costs[BVH_WIDTH_MAX + 1];

typedef struct {
    Costs costs; // for up to slots_max slots; its leaves need no more
    unsigned slots_max;
    float leaves_cost;     // of the binary tree's leaves
    uint32_t first, count; // its primitives; count 0: more, or of more types, than a leaf may hold
    bool is_leaf;          // rather than a wide node
} Subtree;

typedef struct {
    const Bvh *bvh;
    Subtree *subtrees; // of the binary nodes
    double scale;      // of areas
    unsigned width;
} Widening;

static bool child_is_empty(const BvhChild *child)
{
    return bounds_is_empty(&child->box);
}

static bool child_is_node(const BvhChild *child)
{
    return child->count == 0 && !child_is_empty(child);
}

static float leaf_cost(const Widening *widening, double half_area, uint32_t first, uint32_t count)
{
    const bool is_block = type_is_in_blocks(widening->bvh->leaves, widening->bvh->types[first]);
    const double test_cost = is_block ? block_cost : intersection_cost * count;
    return (float)(half_area * widening->scale * (visit_cost + test_cost));
}

// Returns a child's subtree, which for a leaf is stored in *leaf.
static const Subtree *child_subtree(const Widening *widening, const BvhChild *child, Subtree *leaf)
{
    if (child_is_node(child)) return &widening->subtrees[child->first];
    *leaf = (Subtree){.slots_max = 1, .first = child->first, .count = child->count};
    if (!child_is_empty(child))
        leaf->leaves_cost = leaf_cost(widening, bounds_half_area(child->box), child->first, child->count);
    return leaf;
}

// Returns how many of the slots that two children may use together are best used by the first.
static unsigned slots_share(const Subtree *first, const Subtree *second, unsigned slots)
{
    const unsigned end = first->slots_max < slots - 1 ? first->slots_max : slots - 1;
    unsigned best = slots > second->slots_max ? slots - second->slots_max : 1;
    for (unsigned k = best + 1; k <= end; k++)
        if (first->costs[k] + second->costs[slots - k] < first->costs[best] + second->costs[slots - best])
            best = k;
    return best;
}

// Sets the subtree's primitives. The count is 0 unless both sides fit into one leaf.
static void subtree_count(const Widening *widening, const Subtree *first, const Subtree *second,
                          Subtree *subtree)
{
    const uint8_t *types = widening->bvh->types;
    bool joins = first->count > 0 && second->count > 0 &&
                 first->count + second->count <= leaf_size_max(widening->bvh->leaves, types[first->first]) &&
                 types[first->first] == types[second->first] && types[first->first] != TYPE_INSTANCES;
    subtree->first = first->first < second->first ? first->first : second->first;
    subtree->count = joins ? first->count + second->count : 0;
}

// Computes the costs from the leaves up. Children come after their parent.
static void costs_find(Widening *widening)
{
    const Bvh *bvh = widening->bvh;
    for (size_t i = bvh->node_count; i-- > 0;) {
        const BvhBinaryNode *node = &bvh->nodes[i];
        Subtree leaves[2];
        const Subtree *first = child_subtree(widening, &node->children[0], &leaves[0]);
        const Subtree *second = child_subtree(widening, &node->children[1], &leaves[1]);
        Subtree *subtree = &widening->subtrees[i];
        const unsigned leaf_count = first->slots_max + second->slots_max;
        subtree->slots_max = leaf_count < widening->width ? leaf_count : widening->width;
        subtree->leaves_cost = first->leaves_cost + second->leaves_cost;
        subtree_count(widening, first, second, subtree);
        for (unsigned slots = 2; slots <= subtree->slots_max; slots++) {
            const unsigned share = slots_share(first, second, slots);
            subtree->costs[slots] = first->costs[share] + second->costs[slots - share];
        }
        const double half_area = bounds_half_area(bvh_node_bounds(node));
        const float as_node = subtree->costs[subtree->slots_max] +
                              (float)(half_area * widening->scale * (node_cost + visit_cost));
        float as_leaf = FLT_MAX;
        if (subtree->count > 0)
            as_leaf = leaf_cost(widening, half_area, subtree->first, subtree->count) - subtree->leaves_cost;
        subtree->is_leaf = as_leaf < as_node;
        subtree->costs[1] = (subtree->is_leaf ? as_leaf : as_node) + tie_cost;
        for (unsigned slots = 2; slots <= subtree->slots_max; slots++)
            subtree->costs[slots] = fminf(subtree->costs[slots], subtree->costs[1]);
    }
}

static void child_gather(const Widening *widening, const BvhChild *child, unsigned slots, BvhWide *wide,
                         BvhWideNode *node);

static void children_gather(const Widening *widening, uint32_t index, unsigned slots, BvhWide *wide,
                            BvhWideNode *node)
{
    const BvhChild *children = widening->bvh->nodes[index].children;
    Subtree leaves[2];
    const Subtree *first = child_subtree(widening, &children[0], &leaves[0]);
    const Subtree *second = child_subtree(widening, &children[1], &leaves[1]);
    const unsigned both = first->slots_max + second->slots_max;
    if (slots > both) slots = both;
    const unsigned share = slots_share(first, second, slots);
    child_gather(widening, &children[0], share, wide, node);
    child_gather(widening, &children[1], slots - share, wide, node);
}

static void child_gather(const Widening *widening, const BvhChild *child, unsigned slots, BvhWide *wide,
                         BvhWideNode *node)
{
    if (child_is_empty(child)) return;
    if (child_is_node(child)) {
        const Subtree *subtree = &widening->subtrees[child->first];
        if (subtree->costs[slots] < subtree->costs[1]) {
            children_gather(widening, child->first, slots, wide, node);
            return;
        }
        if (subtree->is_leaf) {
            BvhChild *leaf = &wide->leaves[wide->leaf_count++];
            *leaf = (BvhChild){child->box, subtree->first, subtree->count};
            child = leaf;
        }
    }
    node->children[node->child_count++] = child;
}

void bvh_widen(BvhWide *wide, const Bvh *bvh, unsigned width)
{
    if (width < 2 || width > BVH_WIDTH_MAX) fault("a node of %u children", width);
    double root_area = bounds_half_area(bvh_node_bounds(&bvh->nodes[0]));
    Widening widening = {
        .bvh = bvh,
        .subtrees = memory_allocate_large(bvh->node_count, sizeof(Subtree)),
        .scale = root_area >= DBL_MIN && root_area <= DBL_MAX ? 1 / root_area : 0,
        .width = width,
    };
    costs_find(&widening);
    OWNED uint32_t *roots = memory_allocate(bvh->node_count, sizeof *roots);
    *wide = (BvhWide){
        .nodes = memory_allocate_large(bvh->node_count, sizeof *wide->nodes),
        .node_count = 1,
        .leaves = memory_allocate((bvh->node_count + 1) / 2, sizeof *wide->leaves), // leaves are not nested
    };
    roots[0] = 0;
    for (size_t i = 0, level_end = 0; i < wide->node_count; i++) {
        if (i == level_end) {
            level_end = wide->node_count;
            wide->depth++;
        }
        BvhWideNode *node = &wide->nodes[i];
        *node = (BvhWideNode){.first_node = (uint32_t)wide->node_count};
        children_gather(&widening, roots[i], width, wide, node);
        for (unsigned k = 0; k < node->child_count; k++)
            if (child_is_node(node->children[k])) roots[wide->node_count++] = node->children[k]->first;
    }
    free(widening.subtrees);
}

void bvh_wide_free(BvhWide *wide)
{
    free(wide->nodes);
    free(wide->leaves);
    *wide = (BvhWide){0};
}
