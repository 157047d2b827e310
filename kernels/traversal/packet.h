// Packet traversal of the BVH, for kernels with several lanes.
//
// The rays of a packet are traversed in coherent groups, each in one octant. The child boxes of a node are
// first tested all at once, a lane per box, against interval bounds of the group (Boulos, Wald, Shirley,
// Geometric and arithmetic culling methods for entire ray packets, University of Utah, UUCS-06-010, 2006;
// there box by box); those that pass are tested one by one, a lane per ray. A few rays skip the bounds: each
// is tested against all boxes, a lane per box. Rays that share their octant with few others are divergent,
// and traversed last as one group, without bounds.
#ifndef PACKET_H
#define PACKET_H

#include "traversal/boxes.h"
#include "traversal/primitives.h"
#include "traversal/stack.h"

#if LANES > 1

// Up to this many active lanes skip the bounds; up to twice as many in an octant are divergent.
#define FEW_LANES (LANES >> 2)

// No ray of a group is at a plane at p, ahead of it across an axis, before p * least + to_near or after
// p * most + to_far. For planes behind it least and most would swap, but both distances are below 0 there,
// except for the slack, where no ray searches.
typedef struct {
    scalar least, most; // 1 / direction
    scalar to_near, to_far;
} AxisBounds;

typedef struct {
    AxisBounds x, y, z;
    Octant octant;
    scalar near, limit; // the least near and the largest limit of the rays
} GroupBounds;

// The lane minima that bounds are made of: of |1 / direction|, its negative, near and the negative limit; and
// of the origins and their negatives along the direction.
enum { BOUNDS_MIN, BOUNDS_MAX = 3, BOUNDS_NEAR = 6, BOUNDS_LIMIT };
enum { BOUNDS_START, BOUNDS_END = 3, BOUNDS_UNUSED = 6 };
typedef struct {
    LaneMinima rays, origins;
} BoundsMinima;

static inline void axis_bounds_gather(BoundsMinima *minima, uint axis, mask members, real origin,
                                      real inverse, real slack, bool negative)
{
    const real none = (real)(LARGEST), side = (real)(negative ? -1 : 1);
    minima->rays.all[BOUNDS_MIN + axis] = lanes_select(members, fabs(inverse), none);
    minima->rays.all[BOUNDS_MAX + axis] = lanes_select(members, -fabs(inverse), none);
    minima->origins.all[BOUNDS_START + axis] = lanes_select(members, real_fma(origin, -side, -slack), none);
    minima->origins.all[BOUNDS_END + axis] = lanes_select(members, real_fma(origin, side, -slack), none);
}

static inline AxisBounds axis_bounds(const BoundsMinima *minima, uint axis, bool negative, scalar everywhere)
{
    scalar least = minima->rays.each[BOUNDS_MIN + axis], most = -minima->rays.each[BOUNDS_MAX + axis];
    scalar start = minima->origins.each[BOUNDS_START + axis], end = minima->origins.each[BOUNDS_END + axis];
    const scalar side = negative ? -1 : 1;
    return (AxisBounds){side * least, side * most, start * least - everywhere, everywhere - end * most};
}

// Of lanes in one octant.
static inline GroupBounds group_bounds(const BoxRays *rays, const Ray *ray, uint lanes, real limit)
{
    const real none = (real)(LARGEST);
    mask members = mask_of_bits(lanes);
    bool negative_x = lanes & rays->negative_x, negative_y = lanes & rays->negative_y,
         negative_z = lanes & rays->negative_z;
    BoundsMinima minima;
    axis_bounds_gather(&minima, 0, members, ray->origin.x, rays->inverse.x, rays->slack, negative_x);
    axis_bounds_gather(&minima, 1, members, ray->origin.y, rays->inverse.y, rays->slack, negative_y);
    axis_bounds_gather(&minima, 2, members, ray->origin.z, rays->inverse.z, rays->slack, negative_z);
    minima.rays.all[BOUNDS_NEAR] = lanes_select(members, rays->near, none);
    minima.rays.all[BOUNDS_LIMIT] = lanes_select(members, -limit, none);
    for (uint i = BOUNDS_UNUSED; i < MINIMA_COUNT; i++)
        minima.origins.all[i] = none;
    lane_minima_reduce(&minima.rays);
    lane_minima_reduce(&minima.origins);
    GroupBounds bounds;
    bounds.octant = octant_make(negative_x, negative_y, negative_z);
    bounds.near = minima.rays.each[BOUNDS_NEAR];
    bounds.limit = -minima.rays.each[BOUNDS_LIMIT];
    const scalar everywhere = bounds.near < 0 ? LARGEST * 0.5f : 0; // rays that search behind their origin
    bounds.x = axis_bounds(&minima, 0, negative_x, everywhere);
    bounds.y = axis_bounds(&minima, 1, negative_y, everywhere);
    bounds.z = axis_bounds(&minima, 2, negative_z, everywhere);
    return bounds;
}

// For a divergent group, of which only near and limit are used.
static inline GroupBounds group_unbounded(uint lanes, real limit)
{
    GroupBounds bounds;
    bounds.near = -LARGEST;
    bounds.limit = lanes_largest(mask_of_bits(lanes), limit);
    return bounds;
}

static inline real children_plane(global const scalar *boxes, uint plane)
{
    return real_load(boxes + plane * BVH_WIDTH);
}

static inline real axis_bounds_enter(const AxisBounds *bounds, global const scalar *boxes, uint near_plane)
{
    return real_fma(children_plane(boxes, near_plane), (real)(bounds->least), (real)(bounds->to_near));
}

static inline real axis_bounds_leave(const AxisBounds *bounds, global const scalar *boxes, uint far_plane)
{
    return real_fma(children_plane(boxes, far_plane), (real)(bounds->most), (real)(bounds->to_far));
}

// The children whose boxes a ray of the group may intersect, a lane per child; *near: not before there.
static inline mask bounds_intersect_children(const GroupBounds *bounds, global const scalar *boxes,
                                             scalar limit, real *near)
{
    Octant octant = bounds->octant;
    *near = real_max(real_max(axis_bounds_enter(&bounds->x, boxes, octant.near_x),
                              axis_bounds_enter(&bounds->y, boxes, octant.near_y)),
                     real_max(axis_bounds_enter(&bounds->z, boxes, octant.near_z), (real)(bounds->near)));
    real far = real_min(real_min(axis_bounds_leave(&bounds->x, boxes, octant.far_x),
                                 axis_bounds_leave(&bounds->y, boxes, octant.far_y)),
                        real_min(axis_bounds_leave(&bounds->z, boxes, octant.far_z), (real)(limit)));
    return *near <= far;
}

// Spilled copy of the packet, indexable by lane: indexing the rays themselves would keep them out of
// registers.
typedef struct {
    BoxRays rays;
    bool is_set;
} SpilledRays;

// The children whose boxes one ray intersects, a lane per child.
static inline mask ray_intersects_children(const BoxRays *rays, uint lane, global const scalar *boxes,
                                           scalar limit, real *near)
{
    Octant octant = octant_of_lane(rays, lane);
    real inverse_x = real_of_lane(&rays->inverse.x, lane);
    real inverse_y = real_of_lane(&rays->inverse.y, lane);
    real inverse_z = real_of_lane(&rays->inverse.z, lane);
    real near_x =
        real_fma(children_plane(boxes, octant.near_x), inverse_x, real_of_lane(&rays->to_near.x, lane));
    real near_y =
        real_fma(children_plane(boxes, octant.near_y), inverse_y, real_of_lane(&rays->to_near.y, lane));
    real near_z =
        real_fma(children_plane(boxes, octant.near_z), inverse_z, real_of_lane(&rays->to_near.z, lane));
    real far_x =
        real_fma(children_plane(boxes, octant.far_x), inverse_x, real_of_lane(&rays->to_far.x, lane));
    real far_y =
        real_fma(children_plane(boxes, octant.far_y), inverse_y, real_of_lane(&rays->to_far.y, lane));
    real far_z =
        real_fma(children_plane(boxes, octant.far_z), inverse_z, real_of_lane(&rays->to_far.z, lane));
    *near = real_max(real_max(near_x, near_y), real_max(near_z, real_of_lane(&rays->near, lane)));
    return *near <= real_min(real_min(far_x, far_y), real_min(far_z, (real)(limit)));
}

// A group during traversal.
typedef struct {
    const BoxRays *rays;
    SpilledRays *spilled;
    bool coherent;
    GroupBounds bounds; // if coherent
    uint active;        // lanes still searching, as bits
    real limit;         // of each lane; -LARGEST for those that are done
    scalar largest_limit;
} RayGroup;

// For each child the lanes whose rays intersect its box, as bits, and the first entry distance.
static inline integer rays_intersect_children(const RayGroup *group, uint lanes, global const scalar *boxes,
                                              real *near)
{
    if (!group->spilled->is_set) *group->spilled = (SpilledRays){*group->rays, true};
    RealLanes limits = {group->limit};
    integer hit_by = (integer)(0);
    *near = (real)(LARGEST);
    for (; lanes != 0; lanes &= lanes - 1) {
        uint lane = lowest_bit(lanes);
        real ray_near;
        mask hits = ray_intersects_children(&group->spilled->rays, lane, boxes, limits.each[lane], &ray_near);
        hit_by = lanes_select(hits, hit_by | (integer)((scalar_integer)1 << lane), hit_by);
        *near = lanes_select(hits & (ray_near < *near), ray_near, *near);
    }
    return hit_by;
}

// Pushes the children of a node that any of the lanes intersects.
static inline void visit_node(TraversalStack *stack, const Scene *scene, global const BvhNode *node,
                              const RayGroup *group, uint lanes)
{
    global const scalar *boxes = (global const scalar *)node->planes;
    const uint bottom = stack->count;
    RealLanes near;
    IntegerLanes hit_by;
    uint children = 0;
    bool by_ray = !group->coherent || popcount(lanes) <= FEW_LANES;
    if (!by_ray) {
        children =
            lanes_bits(bounds_intersect_children(&group->bounds, boxes, group->largest_limit, &near.all));
        by_ray = popcount(children) > popcount(lanes);
    }
    if (by_ray) {
        hit_by.all = rays_intersect_children(group, lanes, boxes, &near.all);
        children = lanes_bits(hit_by.all != (integer)(0));
    }
    for (; children != 0; children &= children - 1) {
        uint child = lowest_bit(children);
        real unused;
        uint child_lanes = by_ray
                               ? (uint)hit_by.each[child]
                               : lanes_bits(box_rays_intersect_child(group->rays, group->bounds.octant,
                                                                     boxes + child, group->limit, &unused));
        if (child_lanes != 0)
            stack_push_child(stack, bottom, scene, node, child, child_lanes, near.each[child]);
    }
}

// Traverses the BVH with a group; visits what any of its active lanes intersects.
static inline void traverse_group(Traversal *traversal, const Scene *scene, const Ray *ray, RayGroup *group)
{
    StackEntry entries[STACK_MAX], next = {0, BVH_NODE, (ushort)group->active, group->bounds.near};
    TraversalStack stack = {entries, 0, traversal->query == OCCLUSION};
    for (;; next = entries[--stack.count]) {
        uint lanes = next.lanes & group->active;
        if (next.near <= group->largest_limit && lanes != 0) {
            if (next.leaf_info == BVH_NODE) {
                visit_node(&stack, scene, &scene->nodes[next.first], group, lanes);
            } else {
                intersect_leaf(traversal, scene, ray, next.leaf_info, next.first);
                group->active = lanes_bits(traversal->active);
                if (group->active == 0) return;
                group->limit = traversal_limit(traversal);
                group->largest_limit = lanes_largest(traversal->active, group->limit);
            }
        }
        if (stack.count == 0) return;
    }
}

// Traverses the BVH with the rays that are active and intersect its bounds, group by group.
static inline void traverse_bvh(Traversal *traversal, const Scene *scene, Ray *ray)
{
    global const SceneHeader *header = scene->header;
    ray_make_frame(ray);
    BoxRays rays = box_rays(ray, header->bounds);
    mask hits_bvh =
        box_rays_intersect(&rays, header->bounds_low, header->bounds_high, traversal_limit(traversal));
    uint remaining = lanes_bits(hits_bvh & traversal->active), divergent = 0;
    SpilledRays spilled;
    spilled.is_set = false;
    while ((remaining | divergent) != 0) {
        RayGroup group = {.rays = &rays, .spilled = &spilled, .limit = traversal_limit(traversal)};
        if (remaining != 0) {
            group.active = box_rays_same_octant(&rays, remaining);
            remaining &= ~group.active;
            if (popcount(group.active) <= 2 * FEW_LANES) {
                divergent |= group.active;
                continue;
            }
            group.coherent = true;
            group.bounds = group_bounds(&rays, ray, group.active, group.limit);
        } else {
            group.active = divergent;
            divergent = 0;
            group.coherent = false;
            group.bounds = group_unbounded(group.active, group.limit);
        }
        group.largest_limit = group.bounds.limit;
        mask members = mask_of_bits(group.active), others = traversal->active & !members;
        traversal->active = traversal->active & members;
        traverse_group(traversal, scene, ray, &group);
        traversal->active = traversal->active | others;
    }
}

#endif

#endif
