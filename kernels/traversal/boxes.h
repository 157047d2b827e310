// Intersects rays with the axis-aligned boxes of the BVH.
//
// A hit may lie outside its primitive's box, for any shape. Each test is off by a few u times the distance
// between the ray's start and the shape, across the ray and along it. Rounding the boxes and the products
// here adds a few u of the coordinates. Boxes are enlarged by the sum of these, the `slack`.
//
// To bound products, |1 / direction| is limited to 2^120 (2^1000) over the coordinates. At that limit a ray
// moves by less than the slack along that axis while it traverses the scene, if the direction's largest
// component is well above 2^-100 (2^-950) of the coordinates.
#ifndef BOXES_H
#define BOXES_H

#include "scene.h"
#include "shapes/interval.h"
#include "traversal/ray.h"

// The parts of the slack, in u: for the hit, relative to the distance to the farthest corner
// (docs/adding-a-shape.md), and for the boxes and the products, relative to the coordinates.
enum { BOX_HIT_SLACK = 64, BOX_ROUNDING_SLACK = 8 };

// Rays prepared for boxes. Across an axis, a ray enters an enlarged box at t = plane * inverse + to_near and
// leaves it at t = plane * inverse + to_far, for the box's near and far plane.
typedef struct {
    Vector inverse; // 1 / direction, bounded
    Vector to_near, to_far;
    real tmin;
    real slack;
    uint negative_x, negative_y, negative_z; // the lanes whose direction is negative, as bits
} BoxRays;

// Return bounds of 1-norms: from the origin to any hit within the bounds; of the origin and of all hits.
static inline real bounds_farthest(Vector origin, scalar4 bounds)
{
    return vector_norm1(vector_subtract(origin, vector_of(bounds))) + (real)(bounds.w);
}

static inline real bounds_max_norm1(Vector origin, scalar4 bounds)
{
    return real_fma((real)(2), vector_norm1(vector_of(bounds)), bounds_farthest(origin, bounds));
}

// Bounds the distance between the exact ray and this one within the bounds. If both end at a light, it is in
// proportion to the distance from there, which matters where a floor runs to the horizon.
static inline real bounds_position_error(const Ray *ray, scalar4 bounds)
{
    real origin_error = ray->origin_error;
    if (ray->ends_at_light) {
        real reach = 2 * bounds_farthest(vector_add(ray->origin, ray->direction), bounds);
        real length = vector_norm1(ray->direction);
        mask far = length > reach;
        origin_error = lanes_select(
            far, real_divide(origin_error * reach, lanes_select(far, length, (real)(1))), origin_error);
    }
    return real_fma(ray->direction_error, bounds_farthest(ray->origin, bounds), origin_error) * BOUND_SLACK;
}

// Returns the slack for hits in the scene's BVH, relative to the distance to the farthest corner. It
// includes the error of mapping rays to instances.
static inline scalar bvh_hit_slack(const Scene *scene)
{
    const scalar slack = BOX_HIT_SLACK * UNIT_ROUNDOFF;
    return HAS_INSTANCES ? slack + scene->header->bounds_low.w : slack;
}

static inline real box_slack(const Ray *ray, scalar4 bounds, scalar hit_slack)
{
    const real max_norm1 = bounds_max_norm1(ray->origin, bounds);
    if (IS_CERTIFIED) // the exact hit lies in its box
        return real_fma((real)(2 * BOX_ROUNDING_SLACK * UNIT_ROUNDOFF), max_norm1,
                        bounds_position_error(ray, bounds)) -
               ray->length * ray->tmin;
    return real_fma((real)(hit_slack), bounds_farthest(ray->origin, bounds),
                    BOX_ROUNDING_SLACK * UNIT_ROUNDOFF * max_norm1);
}

static inline BoxRays box_rays(const Ray *ray, scalar4 bounds, scalar hit_slack)
{
    real max_norm1 = bounds_max_norm1(ray->origin, bounds);
    real slack = box_slack(ray, bounds, hit_slack);
    const real huge = (real)(1 / SMALLEST_RATIO);
    real largest = real_min(huge * real_inverse_power_of_two(max_norm1), huge);
    Vector inverse = HAS_BOXES ? ray->inverse : ray_inverse(ray);
    inverse.x = real_clamp(inverse.x, -largest, largest);
    inverse.y = real_clamp(inverse.y, -largest, largest);
    inverse.z = real_clamp(inverse.z, -largest, largest);
    Vector to_plane = {-ray->origin.x * inverse.x, -ray->origin.y * inverse.y, -ray->origin.z * inverse.z};
    Vector slack_t = {slack * fabs(inverse.x), slack * fabs(inverse.y), slack * fabs(inverse.z)};
    Vector d = ray->direction;
    BoxRays rays;
    rays.inverse = inverse;
    rays.to_near = vector_subtract(to_plane, slack_t);
    rays.to_far = vector_add(to_plane, slack_t);
    rays.tmin = IS_CERTIFIED ? (real)(0) : ray->tmin; // the slack covers t below 0
    rays.slack = slack;
    rays.negative_x = lanes_bits(d.x < 0);
    rays.negative_y = lanes_bits(d.y < 0);
    rays.negative_z = lanes_bits(d.z < 0);
    return rays;
}

static inline Interval box_rays_between(scalar low, scalar high, real inverse, real to_near, real to_far)
{
    return (Interval){
        real_min(real_fma((real)(low), inverse, to_near), real_fma((real)(high), inverse, to_near)),
        real_max(real_fma((real)(low), inverse, to_far), real_fma((real)(high), inverse, to_far))};
}

// Returns the rays, in any octant, that intersect a box between tmin and tmax.
static inline mask box_rays_intersect(const BoxRays *rays, scalar4 low, scalar4 high, real tmax)
{
    Vector inverse = rays->inverse, to_near = rays->to_near, to_far = rays->to_far;
    Interval x = box_rays_between(low.x, high.x, inverse.x, to_near.x, to_far.x);
    Interval y = box_rays_between(low.y, high.y, inverse.y, to_near.y, to_far.y);
    Interval z = box_rays_between(low.z, high.z, inverse.z, to_near.z, to_far.z);
    return real_max(real_max(x.near, y.near), real_max(z.near, rays->tmin)) <=
           real_min(real_min(x.far, y.far), real_min(z.far, tmax));
}

// The indices of the planes by which rays of one octant enter and leave a node's boxes.
typedef struct {
    uint near_x, near_y, near_z, far_x, far_y, far_z;
} Octant;

static inline Octant octant_make(bool negative_x, bool negative_y, bool negative_z)
{
    uint x = negative_x ? BVH_HIGH : BVH_LOW, y = negative_y ? BVH_HIGH : BVH_LOW,
         z = negative_z ? BVH_HIGH : BVH_LOW;
    const uint both = BVH_LOW + BVH_HIGH;
    return (Octant){x, 1 + y, 2 + z, both - x, 1 + both - y, 2 + both - z};
}

static inline Octant octant_of_lane(const BoxRays *rays, uint lane)
{
    return octant_make(rays->negative_x >> lane & 1, rays->negative_y >> lane & 1,
                       rays->negative_z >> lane & 1);
}

// Returns those of the lanes, as bits, whose directions have the same signs as the first one's.
static inline uint box_rays_same_octant(const BoxRays *rays, uint lanes)
{
    uint x = rays->negative_x, y = rays->negative_y, z = rays->negative_z, first = lanes & -lanes;
    return lanes & (x & first ? x : ~x) & (y & first ? y : ~y) & (z & first ? z : ~z);
}

// Returns the lanes whose ray is within its box at some t from tmin to tmax. Sets *entry to where rays enter.
static inline mask slabs_intersect(Vector near, Vector far, Vector inverse, Vector to_near, Vector to_far,
                                   real tmin, real tmax, real *entry)
{
    const Vector enter = {real_fma(near.x, inverse.x, to_near.x), real_fma(near.y, inverse.y, to_near.y),
                          real_fma(near.z, inverse.z, to_near.z)};
    const Vector leave = {real_fma(far.x, inverse.x, to_far.x), real_fma(far.y, inverse.y, to_far.y),
                          real_fma(far.z, inverse.z, to_far.z)};
    *entry = real_max(real_max(enter.x, enter.y), real_max(enter.z, tmin));
    return *entry <= real_min(real_min(leave.x, leave.y), real_min(leave.z, tmax));
}

static inline real box_plane(global const scalar *box, uint plane)
{
    return (real)(box[plane * BVH_WIDTH]);
}

// Returns the rays, all of one octant, that intersect a child's box between tmin and tmax. Sets *entry to
// where they enter it. `box` is the child's scalar in the node's first plane.
static inline mask box_rays_intersect_child(const BoxRays *rays, Octant octant, global const scalar *box,
                                            real tmax, real *entry)
{
    const Vector near = {box_plane(box, octant.near_x), box_plane(box, octant.near_y),
                         box_plane(box, octant.near_z)};
    const Vector far = {box_plane(box, octant.far_x), box_plane(box, octant.far_y),
                        box_plane(box, octant.far_z)};
    return slabs_intersect(near, far, rays->inverse, rays->to_near, rays->to_far, rays->tmin, tmax, entry);
}

#endif
