// Traverses the BVH with single rays, in kernels with one lane.
#ifndef SINGLE_H
#define SINGLE_H

#include "traversal/boxes.h"
#include "traversal/primitives.h"
#include "traversal/stack.h"

#if LANES == 1

// Pushes the children of a node that the ray intersects.
static inline void visit_node(TraversalStack *stack, global const BvhNode *node, const BoxRays *box_ray,
                              Octant octant, scalar tmax)
{
    global const scalar *boxes = (global const scalar *)node->planes;
    const uint bottom = stack->count;
    for (uint child = 0; child < BVH_WIDTH; child++) {
        StackEntry entry = {((global const uint *)node->child_index)[child],
                            ((global const uint *)node->child_type)[child], 0};
        if (box_rays_intersect_child(box_ray, octant, boxes + child, tmax, &entry.entry))
            stack_push(stack, bottom, entry);
    }
}

// Traverses the BVH with the ray, if it is active and intersects the BVH's bounds.
static inline void traverse_bvh(Traversal *traversal, const Scene *scene, Ray *ray)
{
    global const SceneHeader *header = scene->header;
    ray_prepare(ray);
    BoxRays box_ray = box_rays(ray, header->bounds, bvh_hit_slack(scene));
    scalar tmax = traversal_tmax(traversal);
    if (!box_rays_intersect(&box_ray, header->bounds_low, header->bounds_high, tmax)) return;
    Octant octant = octant_of_lane(&box_ray, 0);
    StackEntry entries[STACK_CAPACITY], next = {0, BVH_NODE, box_ray.tmin};
    TraversalStack stack = {entries, 0, traversal->query == OCCLUSION};
    for (;; next = entries[--stack.count]) {
        if (next.entry <= tmax) {
            if (next.child_type == BVH_NODE) {
                visit_node(&stack, &scene->nodes[next.child_index], &box_ray, octant, tmax);
            } else {
                if (HAS_INSTANCES && leaf_type(next.child_type) == TYPE_INSTANCES)
                    instance_traverse(traversal, scene, ray, next.child_index, 1);
                else
                    intersect_leaf(traversal, scene, ray, next.child_type, next.child_index);
                if (!traversal->active) return;
                tmax = traversal_tmax(traversal);
            }
        }
        if (stack.count == 0) return;
    }
}

#endif

#endif
