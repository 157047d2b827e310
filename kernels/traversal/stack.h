// The nodes and leaves of the BVH that a traversal has yet to visit.
#ifndef STACK_H
#define STACK_H

#include "scene.h"
#include "traversal/query.h"

// A pending child. Kept small: a GPU may reserve the whole stack for each thread.
typedef struct {
    uint first;   // the node, or the leaf's first primitive
    ushort what;  // BVH_NODE, or a leaf
    ushort lanes; // whose rays intersect its box, as bits
    scalar entry; // its entry distance
} StackEntry;

// A visit replaces a node by at most BVH_WIDTH children.
#define STACK_CAPACITY ((BVH_WIDTH - 1) * BVH_DEPTH_LARGEST + 1)

// `entries` is an array of its own, so that the count stays in a register.
typedef struct {
    StackEntry *entries;
    uint count;
    // Shadow rays visit the farthest child first: the nearest, mostly the surface that they leave, rarely
    // occludes them.
    bool farthest_first;
} TraversalStack;

static inline void entry_prefetch(const Scene *scene, uint first, uint what)
{
    if (what == BVH_NODE)
        memory_prefetch((global const char *)&scene->nodes[first], sizeof(BvhNode));
    else if (HAS_TRIANGLES && (what & 0xff) == KIND_TRIANGLES)
        memory_prefetch((global const char *)&scene->triangles[first], 4 * sizeof(Triangle));
    else if (HAS_SPHERES && (what & 0xff) == KIND_SPHERES)
        memory_prefetch((global const char *)&scene->spheres[first], sizeof(Sphere));
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
    uint first = ((global const uint *)node->first)[child], what = ((global const uint *)node->what)[child];
    stack->entries[slot] = (StackEntry){first, (ushort)what, (ushort)lanes, entry};
    entry_prefetch(scene, first, what);
}

#endif
