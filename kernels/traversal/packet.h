// Traverses the BVH with packets, in kernels with several lanes.
//
// The rays of a packet are traversed in coherent groups, each in one octant. The child boxes of a node are
// first tested all at once, one box per lane, against interval bounds of the group (Boulos, Wald, Shirley,
// Geometric and arithmetic culling methods for entire ray packets, University of Utah, UUCS-06-010, 2006,
// who test box by box). Those that pass are tested one by one, with one ray per lane. Groups of few rays
// skip the bounds and test each ray against all boxes, one box per lane. Rays that share their octant with
// few others are divergent. They are traversed last, as one group without bounds.
#ifndef PACKET_H
#define PACKET_H

#include "traversal/boxes.h"
#include "traversal/primitives.h"
#include "traversal/stack.h"

#if LANES > 1

// Groups of up to this many active lanes skip the bounds, and octants with up to twice as many are
// divergent. A quarter was chosen by measurement (docs/performance-notes.md).
#define FEW_LANES (LANES >> 2)

// Interval bounds for one axis, for rays from origins o in direction sign s, and a plane at p:
//     entry >= p * min_inverse + to_near = (s p - max(s o + slack)) min |1 / direction|
//     exit  <= p * max_inverse + to_far  = (s p - min(s o - slack)) max |1 / direction|
// These hold for planes ahead of all origins. Behind one the extremes of |1 / direction| would swap, but
// bound and distance are both negative there, up to the slack, and no hit lies before tmin >= 0. If a tmin
// is negative, both bounds are opened completely.
typedef struct {
    scalar min_inverse, max_inverse; // s times the extremes of |1 / direction|
    scalar to_near, to_far;
} AxisBounds;

typedef struct {
    AxisBounds x, y, z;
    Octant octant;
    scalar tmin, tmax; // the smallest tmin and the largest tmax of the rays
} GroupBounds;

// The lane minima that bounds are made of: those of |1 / direction|, its negative, tmin and the negative
// tmax, and, less the slack, those of the origins' negatives and the origins along the direction.
enum { BOUNDS_MIN_INVERSE, BOUNDS_MAX_INVERSE = 3, BOUNDS_TMIN = 6, BOUNDS_TMAX };
enum { BOUNDS_ENTRY_ORIGIN, BOUNDS_EXIT_ORIGIN = 3, BOUNDS_UNUSED = 6 };
typedef struct {
    LaneMinima rays, origins;
} BoundsMinima;

static inline void axis_bounds_gather(BoundsMinima *minima, uint axis, mask members, real origin,
                                      real inverse, real slack, bool negative)
{
    const real none = (real)(LARGEST), side = (real)(negative ? -1 : 1);
    minima->rays.all[BOUNDS_MIN_INVERSE + axis] = lanes_select(members, fabs(inverse), none);
    minima->rays.all[BOUNDS_MAX_INVERSE + axis] = lanes_select(members, -fabs(inverse), none);
    minima->origins.all[BOUNDS_ENTRY_ORIGIN + axis] =
        lanes_select(members, real_fma(origin, -side, -slack), none);
    minima->origins.all[BOUNDS_EXIT_ORIGIN + axis] =
        lanes_select(members, real_fma(origin, side, -slack), none);
}

static inline AxisBounds axis_bounds(const BoundsMinima *minima, uint axis, bool negative, scalar open)
{
    scalar min_inverse = minima->rays.each[BOUNDS_MIN_INVERSE + axis];
    scalar max_inverse = -minima->rays.each[BOUNDS_MAX_INVERSE + axis];
    scalar entry_origin = minima->origins.each[BOUNDS_ENTRY_ORIGIN + axis];
    scalar exit_origin = minima->origins.each[BOUNDS_EXIT_ORIGIN + axis];
    const scalar side = negative ? -1 : 1;
    return (AxisBounds){side * min_inverse, side * max_inverse, entry_origin * min_inverse - open,
                        open - exit_origin * max_inverse};
}

// Returns the bounds of `lanes`, given as bits, which are in one octant.
static inline GroupBounds group_bounds(const BoxRays *rays, const Ray *ray, uint lanes, real tmax)
{
    const real none = (real)(LARGEST);
    mask members = mask_of_bits(lanes);
    bool negative_x = lanes & rays->negative_x, negative_y = lanes & rays->negative_y,
         negative_z = lanes & rays->negative_z;
    BoundsMinima minima;
    axis_bounds_gather(&minima, 0, members, ray->origin.x, rays->inverse.x, rays->slack, negative_x);
    axis_bounds_gather(&minima, 1, members, ray->origin.y, rays->inverse.y, rays->slack, negative_y);
    axis_bounds_gather(&minima, 2, members, ray->origin.z, rays->inverse.z, rays->slack, negative_z);
    minima.rays.all[BOUNDS_TMIN] = lanes_select(members, rays->tmin, none);
    minima.rays.all[BOUNDS_TMAX] = lanes_select(members, -tmax, none);
    for (uint i = BOUNDS_UNUSED; i < MINIMA_COUNT; i++)
        minima.origins.all[i] = none;
    lane_minima_reduce(&minima.rays);
    lane_minima_reduce(&minima.origins);
    GroupBounds bounds;
    bounds.octant = octant_make(negative_x, negative_y, negative_z);
    bounds.tmin = minima.rays.each[BOUNDS_TMIN];
    bounds.tmax = -minima.rays.each[BOUNDS_TMAX];
    const scalar open = bounds.tmin < 0 ? LARGEST * 0.5f : 0;
    bounds.x = axis_bounds(&minima, 0, negative_x, open);
    bounds.y = axis_bounds(&minima, 1, negative_y, open);
    bounds.z = axis_bounds(&minima, 2, negative_z, open);
    return bounds;
}

static inline real children_plane(global const scalar *boxes, uint plane)
{
    return real_load(boxes + plane * BVH_WIDTH);
}

static inline real axis_bounds_enter(const AxisBounds *bounds, global const scalar *boxes, uint near_plane)
{
    return real_fma(children_plane(boxes, near_plane), (real)(bounds->min_inverse), (real)(bounds->to_near));
}

static inline real axis_bounds_leave(const AxisBounds *bounds, global const scalar *boxes, uint far_plane)
{
    return real_fma(children_plane(boxes, far_plane), (real)(bounds->max_inverse), (real)(bounds->to_far));
}

// Returns the children, one per lane, whose boxes a ray of the group may hit. Sets *entry to lower bounds.
static inline mask bounds_intersect_children(const GroupBounds *bounds, global const scalar *boxes,
                                             real *entry)
{
    Octant octant = bounds->octant;
    *entry = real_max(real_max(axis_bounds_enter(&bounds->x, boxes, octant.near_x),
                               axis_bounds_enter(&bounds->y, boxes, octant.near_y)),
                      real_max(axis_bounds_enter(&bounds->z, boxes, octant.near_z), (real)(bounds->tmin)));
    real far = real_min(real_min(axis_bounds_leave(&bounds->x, boxes, octant.far_x),
                                 axis_bounds_leave(&bounds->y, boxes, octant.far_y)),
                        real_min(axis_bounds_leave(&bounds->z, boxes, octant.far_z), (real)(bounds->tmax)));
    return *entry <= far;
}

// A spilled copy of the packet that can be indexed by lane. Indexing the rays themselves would keep them out
// of registers.
typedef struct {
    BoxRays rays;
    bool is_set;
} SpilledRays;

// Returns the children, one per lane, whose boxes one ray intersects.
static inline mask ray_intersects_children(const BoxRays *rays, uint lane, global const scalar *boxes,
                                           scalar tmax, real *entry)
{
    const Octant octant = octant_of_lane(rays, lane);
    const Vector near = {children_plane(boxes, octant.near_x), children_plane(boxes, octant.near_y),
                         children_plane(boxes, octant.near_z)};
    const Vector far = {children_plane(boxes, octant.far_x), children_plane(boxes, octant.far_y),
                        children_plane(boxes, octant.far_z)};
    return slabs_intersect(near, far, vector_of_lane(&rays->inverse, lane),
                           vector_of_lane(&rays->to_near, lane), vector_of_lane(&rays->to_far, lane),
                           real_of_lane(&rays->tmin, lane), (real)(tmax), entry);
}

// A group during traversal.
typedef struct {
    const BoxRays *rays;
    SpilledRays *spilled;
    bool coherent;
    GroupBounds bounds; // if coherent
    uint active;        // lanes that still traverse, as bits
    real tmax;          // per lane, -LARGEST in finished lanes
} RayGroup;

// Returns for each child the lanes whose rays hit its box, as bits. Sets the first entry distances.
static inline integer rays_intersect_children(const RayGroup *group, uint lanes, global const scalar *boxes,
                                              real *entry)
{
    if (!group->spilled->is_set) *group->spilled = (SpilledRays){*group->rays, true};
    RealLanes tmax = {group->tmax};
    integer hit_by = (integer)(0);
    *entry = (real)(LARGEST);
    for (; lanes != 0; lanes &= lanes - 1) {
        uint lane = lowest_bit(lanes);
        real ray_entry;
        mask hits = ray_intersects_children(&group->spilled->rays, lane, boxes, tmax.each[lane], &ray_entry);
        hit_by = lanes_select(hits, hit_by | (integer)((scalar_integer)1 << lane), hit_by);
        real_replace(entry, hits & (ray_entry < *entry), ray_entry);
    }
    return hit_by;
}

// Updates the group after a leaf with hits.
static inline void group_shrink(RayGroup *group, const Traversal *traversal)
{
    group->active = lanes_bits(traversal->active);
    group->tmax = traversal_tmax(traversal);
    if (group->coherent) group->bounds.tmax = lanes_largest(traversal->active, group->tmax);
}

// The children of a node that lanes of a group may intersect.
typedef struct {
    uint children;       // as bits
    RealLanes entry;     // each child's first entry distance
    bool by_ray;         // each ray was tested, instead of the group's bounds
    IntegerLanes hit_by; // if by_ray, the lanes that hit each child, as bits
} HitChildren;

// Returns the children that the lanes may hit. Runs the shorter of two loops, which cost one test per ray or
// per child that passes the bounds.
static inline HitChildren group_hits_children(const RayGroup *group, uint lanes, global const scalar *boxes)
{
    HitChildren hits;
    hits.children = 0;
    hits.by_ray = !group->coherent || popcount(lanes) <= FEW_LANES;
    if (!hits.by_ray) {
        hits.children = lanes_bits(bounds_intersect_children(&group->bounds, boxes, &hits.entry.all));
        hits.by_ray = popcount(hits.children) > popcount(lanes);
    }
    if (hits.by_ray) {
        hits.hit_by.all = rays_intersect_children(group, lanes, boxes, &hits.entry.all);
        hits.children = lanes_bits(hits.hit_by.all != (integer)(0));
    }
    return hits;
}

// Returns the lanes, as bits, that intersect one child's box before their tmax.
static inline uint child_lanes(const RayGroup *group, const HitChildren *hits, uint child,
                               global const scalar *boxes)
{
    real entry = (real)(hits->entry.each[child]);
    if (hits->by_ray) return (uint)hits->hit_by.each[child] & lanes_bits(entry <= group->tmax);
    return lanes_bits(
        box_rays_intersect_child(group->rays, group->bounds.octant, boxes + child, group->tmax, &entry));
}

// Returns the children that are leaves, as bits.
static inline uint node_leaves(global const BvhNode *node)
{
    integer types = LANES_CONVERT(INTEGER_BASE)(JOIN(vload, LANES)(0, (global const uint *)node->child_type));
    return lanes_bits(types != (integer)(BVH_NODE));
}

// Intersects the leaves among the children of the next node that any of its lanes hits, and pushes the
// others. A leaf on the stack costs more than the tests that visiting it in order saves.
static inline void visit_node(Traversal *traversal, TraversalStack *stack, const Scene *scene, const Ray *ray,
                              RayGroup *group, StackEntry next)
{
    global const BvhNode *node = &scene->nodes[next.child_index];
    global const scalar *boxes = (global const scalar *)node->planes;
    HitChildren hits = group_hits_children(group, next.lanes, boxes);
    const uint leaves = hits.children & node_leaves(node), bottom = stack->count;
    for (uint left = leaves; left != 0; left &= left - 1) {
        uint leaf = lowest_bit(left);
        uint hit_by = child_lanes(group, &hits, leaf, boxes);
        uint first = ((global const uint *)node->child_index)[leaf];
        uint type = ((global const uint *)node->child_type)[leaf];
        if (hit_by == 0 || type == BVH_EMPTY) continue;
        if (HAS_INSTANCES && leaf_type(type) == TYPE_INSTANCES) {
            stack_push(stack, bottom, (StackEntry){INSTANCE_LEAF | first, hit_by, hits.entry.each[leaf]});
            continue;
        }
        if (intersect_leaf_or_block(traversal, scene, ray, type, first, hit_by))
            group_shrink(group, traversal);
        if (group->active == 0) return;
    }
    for (uint left = hits.children & ~leaves; left != 0; left &= left - 1) {
        uint child = lowest_bit(left), hit_by = child_lanes(group, &hits, child, boxes);
        uint index = ((global const uint *)node->child_index)[child];
        StackEntry entry = {index, hit_by, hits.entry.each[child]};
        if (hit_by != 0) stack_push_node(stack, bottom, scene, entry);
    }
}

// Returns the next group: the remaining lanes of one octant or, once none remain, the divergent ones.
static inline RayGroup next_group(const BoxRays *rays, SpilledRays *spilled, const Ray *ray, real tmax,
                                  uint *remaining, uint *divergent)
{
    RayGroup group = {.rays = rays, .spilled = spilled, .tmax = tmax};
    while (*remaining != 0) {
        group.active = box_rays_same_octant(rays, *remaining);
        *remaining &= ~group.active;
        if (popcount(group.active) > 2 * FEW_LANES) {
            group.coherent = true;
            group.bounds = group_bounds(rays, ray, group.active, tmax);
            return group;
        }
        *divergent |= group.active;
    }
    group.active = *divergent;
    *divergent = 0;
    group.coherent = false;
    return group;
}

// Traverses the BVH with a group, visiting what any of its active lanes intersects.
static inline void traverse_group(Traversal *traversal, const Scene *scene, const Ray *ray, RayGroup *group)
{
    StackEntry entries[STACK_CAPACITY], next = {0, group->active, -LARGEST};
    TraversalStack stack = {entries, 0, traversal->query == OCCLUSION};
    for (;; next = entries[--stack.count]) {
        next.lanes &= lanes_bits((real)(next.entry) <= group->tmax);
        if (HAS_INSTANCES && next.lanes != 0 && (next.child_index & INSTANCE_LEAF) != 0) {
            if (instance_traverse(traversal, scene, ray, next.child_index & ~INSTANCE_LEAF, next.lanes))
                group_shrink(group, traversal);
        } else if (next.lanes != 0) {
            visit_node(traversal, &stack, scene, ray, group, next);
        }
        if (stack.count == 0 || group->active == 0) return;
    }
}

// Traverses the BVH with the rays that are active and intersect its bounds, group by group.
static inline void traverse_bvh(Traversal *traversal, const Scene *scene, Ray *ray)
{
    global const SceneHeader *header = scene->header;
    ray_prepare(ray);
    BoxRays rays = box_rays(ray, header->bounds, bvh_hit_slack(scene));
    mask hits_bvh =
        box_rays_intersect(&rays, header->bounds_low, header->bounds_high, traversal_tmax(traversal));
    uint remaining = lanes_bits(hits_bvh & traversal->active), divergent = 0;
    SpilledRays spilled;
    spilled.is_set = false;
    while ((remaining | divergent) != 0) {
        RayGroup group = next_group(&rays, &spilled, ray, traversal_tmax(traversal), &remaining, &divergent);
        // Lanes of other groups are inactive meanwhile, because optical depths add up and a primitive that
        // several groups test may count only once per lane.
        mask members = mask_of_bits(group.active), others = traversal->active & !members;
        traversal->active = traversal->active & members;
        traverse_group(traversal, scene, ray, &group);
        traversal->active = traversal->active | others;
    }
}

#endif

#endif
