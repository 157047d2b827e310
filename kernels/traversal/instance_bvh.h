// Traverses the meshes that instances share, with rays in the mesh's space. Leaves have only triangles. The
// loops repeat those of single.h and packet.h, because functions of OpenCL C cannot call themselves.
#ifndef INSTANCE_BVH_H
#define INSTANCE_BVH_H

#include "shapes/instance.h"
#include "traversal/packet.h"
#include "traversal/single.h"

#if LANES == 1
// Traverses the BVH of a mesh from its root with the ray.
static inline void mesh_traverse(Traversal *traversal, const Scene *scene, const Ray *ray,
                                 const BoxRays *box_ray, uint lanes, uint root)
{
    scalar tmax = traversal_tmax(traversal);
    Octant octant = octant_of_lane(box_ray, 0);
    StackEntry entries[STACK_CAPACITY], next = {root, BVH_NODE, box_ray->tmin};
    TraversalStack stack = {entries, 0, traversal->query == OCCLUSION};
    for (;; next = entries[--stack.count]) {
        if (next.entry <= tmax) {
            if (next.child_type == BVH_NODE) {
                visit_node(&stack, &scene->nodes[next.child_index], box_ray, octant, tmax);
            } else {
                const uint first = next.child_index, last = first + leaf_count(next.child_type);
                intersect_triangles(traversal, scene, ray, first, last);
                if (!traversal->active) return;
                tmax = traversal_tmax(traversal);
            }
        }
        if (stack.count == 0) return;
    }
}
#else
// Traverses the BVH of a mesh with a group, visiting what any of its active lanes intersects.
static inline void mesh_traverse_group(Traversal *traversal, const Scene *scene, const Ray *ray,
                                       RayGroup *group, uint root)
{
    StackEntry entries[STACK_CAPACITY], next = {root, group->active, -LARGEST};
    TraversalStack stack = {entries, 0, traversal->query == OCCLUSION};
    for (;; next = entries[--stack.count]) {
        next.lanes &= lanes_bits((real)(next.entry) <= group->tmax);
        if (next.lanes != 0) visit_node(traversal, &stack, scene, ray, group, next);
        if (stack.count == 0 || group->active == 0) return;
    }
}

// Traverses the BVH of a mesh from its root with the rays of `lanes`, given as bits, group by group.
static inline void mesh_traverse(Traversal *traversal, const Scene *scene, const Ray *ray,
                                 const BoxRays *box_rays, uint lanes, uint root)
{
    uint divergent = 0;
    SpilledRays spilled;
    spilled.is_set = false;
    while ((lanes | divergent) != 0) {
        RayGroup group = next_group(box_rays, &spilled, ray, traversal_tmax(traversal), &lanes, &divergent);
        mask members = mask_of_bits(group.active), others = traversal->active & !members;
        traversal->active = traversal->active & members;
        mesh_traverse_group(traversal, scene, ray, &group, root);
        traversal->active = traversal->active | others;
    }
}
#endif

static OUT_OF_LINE bool instance_traverse(Traversal *traversal, const Scene *scene, const Ray *ray,
                                          uint index, uint lanes)
{
    const Instance instance = scene->instances[index];
    const SharedMesh mesh = scene->shared_meshes[instance.id.y];
    Ray mapped = instance_ray(&instance, ray);
    ray_prepare(&mapped);
    const scalar4 bounds = (scalar4)(0, 0, 0, mesh.extent.x + mesh.extent.y + mesh.extent.z);
    const BoxRays rays = box_rays(&mapped, bounds, BOX_HIT_SLACK * UNIT_ROUNDOFF);
    const mask hits = box_rays_intersect(&rays, -mesh.extent, mesh.extent, traversal_tmax(traversal));
    lanes &= lanes_bits(hits & traversal->active);
    if (lanes == 0) return false;
    traversal->within = instance_range(scene, instance.id.x, INT_MAX, index);
    mesh_traverse(traversal, scene, &mapped, &rays, lanes, mesh.root_entry.x);
    traversal->within = outside_instances();
    return true;
}

#endif
