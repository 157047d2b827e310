// The nodes and leaves of the BVH that a traversal has yet to visit.
#ifndef STACK_H
#define STACK_H

#include "scene.h"
#include "traversal/query.h"

// A pending child. Kept small: a GPU may reserve the whole stack for each thread.
typedef struct {
    uint child_index;  // the node, or the leaf's first primitive
    ushort child_kind; // BVH_NODE, or a leaf
    ushort lanes;      // whose rays intersect its box, as bits
    scalar entry;      // its entry distance
} StackEntry;

// `entries`, of STACK_CAPACITY, is an array of its own, so that the count stays in a register.
typedef struct {
    StackEntry *entries;
    uint count;
    // Shadow rays visit the farthest child first: the nearest, mostly the surface that they leave, rarely
    // occludes them.
    bool farthest_first;
} TraversalStack;

static inline void entry_prefetch(const Scene *scene, uint child_index, uint child_kind)
{
    if (child_kind == BVH_NODE)
        memory_prefetch((global const char *)&scene->nodes[child_index], sizeof(BvhNode));
    else if (HAS_TRIANGLES && (child_kind & 0xff) == KIND_TRIANGLES)
        memory_prefetch((global const char *)&scene->triangles[child_index], 4 * sizeof(Triangle));
    else if (HAS_SPHERES && (child_kind & 0xff) == KIND_SPHERES)
        memory_prefetch((global const char *)&scene->spheres[child_index], sizeof(Sphere));
}

// Pushes a child of a node, keeping the node's children, which start at `bottom`, sorted by entry distance:
// the one to visit first is on top.
static inline void stack_push_child(TraversalStack *stack, uint bottom, const Scene *scene,
                                    global const BvhNode *node, uint child, uint lanes, scalar entry)
{
    uint slot = stack->count++;
    for (; slot > bottom; slot--) {
        StackEntry below = stack->entries[slot - 1];
        if (stack->farthest_first ? below.entry <= entry : below.entry >= entry) break;
        stack->entries[slot] = below;
    }
    uint child_index = ((global const uint *)node->child_index)[child];
    uint child_kind = ((global const uint *)node->child_kind)[child];
    stack->entries[slot] = (StackEntry){child_index, (ushort)child_kind, (ushort)lanes, entry};
    entry_prefetch(scene, child_index, child_kind);
}

#endif
