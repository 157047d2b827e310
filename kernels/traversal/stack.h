// Holds the nodes and leaves of the BVH that a traversal has yet to visit.
#ifndef STACK_H
#define STACK_H

#include "scene.h"
#include "traversal/query.h"

// A pending child. It is small, because a GPU may reserve the whole stack for each thread.
typedef struct {
    uint child_index; // the node, or the leaf's first primitive
#if LANES == 1
    uint child_type; // BVH_NODE, or a leaf
#else
    uint lanes; // lanes whose rays hit the node's box, as bits; leaves are intersected immediately
#endif
    scalar entry; // its entry distance
} StackEntry;

// Marks a child_index as that of an instance, the only leaf that packets keep on the stack.
#define INSTANCE_LEAF 0x80000000u

// `entries` points to a separate array of STACK_CAPACITY, so that the count stays in a register.
typedef struct {
    StackEntry *entries;
    uint count;
    // Shadow rays visit the farthest child first, because the nearest is mostly the surface that they leave,
    // which rarely occludes them.
    bool farthest_first;
} TraversalStack;

// Pushes a child of a node. The node's children, which start at `bottom`, stay sorted by entry distance,
// with the one to visit first on top.
static inline void stack_push(TraversalStack *stack, uint bottom, StackEntry child)
{
    uint slot = stack->count++;
    for (; slot > bottom; slot--) {
        StackEntry below = stack->entries[slot - 1];
        if (stack->farthest_first ? below.entry <= child.entry : below.entry >= child.entry) break;
        stack->entries[slot] = below;
    }
    stack->entries[slot] = child;
}

#if LANES > 1
// Pushes a node and prefetches it, as it is visited soon.
static inline void stack_push_node(TraversalStack *stack, uint bottom, const Scene *scene, StackEntry node)
{
    stack_push(stack, bottom, node);
    memory_prefetch((global const char *)&scene->nodes[node.child_index], sizeof(BvhNode));
}
#endif

#endif
