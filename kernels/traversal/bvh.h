// Rays and the boxes of the hierarchy.
//
// A node's boxes are first held all at once against a beam that has every ray of the packet in it, by
// interval arithmetic (Boulos, Wald, Shirley, Geometric and arithmetic culling methods for entire ray
// packets, University of Utah, UUCS-06-010, 2006; there one box after the other): a lane there is a box.
// Those that the beam meets are held against the rays: one box after the other, a lane there is a ray; or,
// where fewer rays are left than boxes, one ray after the other against all boxes. A few rays do so without a
// beam.
//
// A hit may lie outside its primitive's box, for any shape: each test is off by a few u times the distance
// between the ray's start and the shape, across the ray and along it. Rounding the boxes and the products
// here adds a few u of the coordinates. Boxes count as larger by all of that, the `slack`.
//
// Products are bounded: 1 / direction is held below 2^120 (2^1000) over the coordinates, where a ray does not
// move along that axis by as much as the slack on its way through the scene. That holds while the direction's
// largest component is well above 2^-100 (2^-950) of the coordinates.
#ifndef BVH_H
#define BVH_H

#include "traversal/ray.h"

// The rays of a packet. A plane is between plane * inverse + to_near and plane * inverse + to_far.
typedef struct {
    Vector inverse; // 1 / direction, bounded
    Vector to_near, to_far;
    real near;
    real slack;
    uint negative_x, negative_y, negative_z; // the lanes whose direction is so along an axis, as bits
} BoxRays;

static inline BoxRays box_rays(const Ray *ray, scalar4 bounds)
{
    Vector center = vector_of(bounds);
    real reach = vector_magnitude(vector_subtract(ray->origin, center)) + (real)(bounds.w);
    real coordinates = real_fma((real)(2), vector_magnitude(center), reach);
    real slack = real_fma((real)(64 * UNIT_ROUNDOFF), reach, (real)(8 * UNIT_ROUNDOFF) * coordinates);
    const real huge = (real)(1 / SMALLEST_RATIO);
    real largest = real_min(huge * real_inverse_power(coordinates), huge);
    Vector inverse = {real_min(real_max(ray->inverse.x, -largest), largest),
                      real_min(real_max(ray->inverse.y, -largest), largest),
                      real_min(real_max(ray->inverse.z, -largest), largest)};
    Vector to_plane = {-ray->origin.x * inverse.x, -ray->origin.y * inverse.y, -ray->origin.z * inverse.z};
    Vector around = {slack * fabs(inverse.x), slack * fabs(inverse.y), slack * fabs(inverse.z)};
    Vector d = ray->direction;
    BoxRays rays;
    rays.inverse = inverse;
    rays.to_near = vector_subtract(to_plane, around);
    rays.to_far = vector_add(to_plane, around);
    rays.near = ray->near;
    rays.slack = slack;
    rays.negative_x = lanes_bits(d.x < (real)(0));
    rays.negative_y = lanes_bits(d.y < (real)(0));
    rays.negative_z = lanes_bits(d.z < (real)(0));
    return rays;
}

// Those of some lanes whose directions have the signs of the first one's.
static inline uint box_rays_alike(const BoxRays *rays, uint lanes)
{
    uint x = rays->negative_x, y = rays->negative_y, z = rays->negative_z, first = lanes & -lanes;
    return lanes & (x & first ? x : ~x) & (y & first ? y : ~y) & (z & first ? z : ~z);
}

typedef struct {
    real enter, leave;
} BoxSpan;

// Where rays are between two planes across an axis.
static inline BoxSpan box_rays_between(scalar low, scalar high, real inverse, real to_near, real to_far)
{
    return (BoxSpan){
        real_min(real_fma((real)(low), inverse, to_near), real_fma((real)(high), inverse, to_near)),
        real_max(real_fma((real)(low), inverse, to_far), real_fma((real)(high), inverse, to_far))};
}

// Which rays meet a box between `near` and `limit`.
static inline mask box_rays_meet(const BoxRays *rays, scalar4 low, scalar4 high, real limit)
{
    Vector inverse = rays->inverse, to_near = rays->to_near, to_far = rays->to_far;
    BoxSpan x = box_rays_between(low.x, high.x, inverse.x, to_near.x, to_far.x);
    BoxSpan y = box_rays_between(low.y, high.y, inverse.y, to_near.y, to_far.y);
    BoxSpan z = box_rays_between(low.z, high.z, inverse.z, to_near.z, to_far.z);
    return real_max(real_max(x.enter, y.enter), real_max(z.enter, rays->near)) <=
           real_min(real_min(x.leave, y.leave), real_min(z.leave, limit));
}

// What rays that all run to the same side have in common along one axis. None is at a plane at p ahead of
// them before p * least + to_near, or after p * most + to_far. For planes behind them it would be the other
// way round, but both are below 0 there, but for the slack, where no ray looks.
typedef struct {
    scalar least, most; // 1 / direction
    scalar to_near, to_far;
    uint near, far; // which of a box's planes is the near one, and which the far one
} BeamAxis;

typedef struct {
    BeamAxis x, y, z;
    scalar near, limit; // all that the rays look for lies between
    bool parted;        // no beam: the rays run to different sides, and only the limit is known of them
} Beam;

// What a beam is made of: of the rays' inverses, nears and limits, and of their origins.
enum { BEAM_LEAST, BEAM_MOST = 3, BEAM_NEAR = 6, BEAM_LIMIT };
enum { BEAM_START, BEAM_END = 3 };
typedef struct {
    LaneMinima ways, origins;
} BeamLeasts;

static inline void beam_axis_gather(BeamLeasts *leasts, uint axis, mask members, real origin, real inverse,
                                    real slack, bool negative)
{
    const real none = (real)(LARGEST), side = (real)(negative ? -1 : 1);
    leasts->ways.all[BEAM_LEAST + axis] = lanes_select(members, fabs(inverse), none);
    leasts->ways.all[BEAM_MOST + axis] = lanes_select(members, -fabs(inverse), none);
    leasts->origins.all[BEAM_START + axis] = lanes_select(members, real_fma(origin, -side, -slack), none);
    leasts->origins.all[BEAM_END + axis] = lanes_select(members, real_fma(origin, side, -slack), none);
}

static inline BeamAxis beam_axis(const BeamLeasts *leasts, uint axis, bool negative, scalar everywhere)
{
    scalar least = leasts->ways.each[BEAM_LEAST + axis], most = -leasts->ways.each[BEAM_MOST + axis];
    scalar start = leasts->origins.each[BEAM_START + axis], end = leasts->origins.each[BEAM_END + axis];
    const scalar side = negative ? -1 : 1;
    return (BeamAxis){side * least,
                      side * most,
                      start * least - everywhere,
                      everywhere - end * most,
                      axis + (negative ? BVH_HIGH : BVH_LOW),
                      axis + (negative ? BVH_LOW : BVH_HIGH)};
}

// Of lanes whose directions have the same signs.
static inline Beam beam_make(const BoxRays *rays, const Ray *ray, uint lanes, real limit)
{
    const real none = (real)(LARGEST);
    mask members = mask_of_bits(lanes);
    bool negative_x = lanes & rays->negative_x, negative_y = lanes & rays->negative_y,
         negative_z = lanes & rays->negative_z;
    BeamLeasts leasts;
    beam_axis_gather(&leasts, 0, members, ray->origin.x, rays->inverse.x, rays->slack, negative_x);
    beam_axis_gather(&leasts, 1, members, ray->origin.y, rays->inverse.y, rays->slack, negative_y);
    beam_axis_gather(&leasts, 2, members, ray->origin.z, rays->inverse.z, rays->slack, negative_z);
    leasts.ways.all[BEAM_NEAR] = lanes_select(members, rays->near, none);
    leasts.ways.all[BEAM_LIMIT] = lanes_select(members, -limit, none);
    for (uint i = BEAM_END + 3; i < MINIMA_COUNT; i++)
        leasts.origins.all[i] = none;
    lane_minima_reduce(&leasts.ways);
    lane_minima_reduce(&leasts.origins);
    Beam beam;
    beam.near = leasts.ways.each[BEAM_NEAR];
    // where one does look there, the beam is all of space, unless it is a single ray
    const scalar everywhere = LANES > 1 && beam.near < 0 ? LARGEST * 0.5f : 0;
    beam.x = beam_axis(&leasts, 0, negative_x, everywhere);
    beam.y = beam_axis(&leasts, 1, negative_y, everywhere);
    beam.z = beam_axis(&leasts, 2, negative_z, everywhere);
    beam.limit = -leasts.ways.each[BEAM_LIMIT];
    beam.parted = false;
    return beam;
}

// With near, limit and parted alone.
static inline Beam beam_parted(uint lanes, real limit)
{
    Beam beam;
    beam.near = -LARGEST;
    beam.limit = lanes_largest(mask_of_bits(lanes), limit);
    beam.parted = true;
    return beam;
}

static inline real boxes_planes(global const scalar *boxes, uint which)
{
    return real_load(boxes + which * BVH_WIDTH);
}

static inline real beam_axis_enter(const BeamAxis *axis, global const scalar *boxes)
{
    return real_fma(boxes_planes(boxes, axis->near), (real)(axis->least), (real)(axis->to_near));
}

static inline real beam_axis_leave(const BeamAxis *axis, global const scalar *boxes)
{
    return real_fma(boxes_planes(boxes, axis->far), (real)(axis->most), (real)(axis->to_far));
}

// The boxes, as many as there are lanes, that the beam meets, and the distance before which no ray is in
// them.
static inline mask beam_meets(const Beam *beam, global const scalar *boxes, scalar limit, real *near)
{
    *near = real_max(real_max(beam_axis_enter(&beam->x, boxes), beam_axis_enter(&beam->y, boxes)),
                     real_max(beam_axis_enter(&beam->z, boxes), (real)(beam->near)));
    real far = real_min(real_min(beam_axis_leave(&beam->x, boxes), beam_axis_leave(&beam->y, boxes)),
                        real_min(beam_axis_leave(&beam->z, boxes), (real)(limit)));
    return *near <= far;
}

static inline real box_plane(global const scalar *box, uint which)
{
    return (real)(box[which * BVH_WIDTH]);
}

// The beam's rays that meet one box.
static inline mask beam_rays_meet(const Beam *beam, const BoxRays *rays, global const scalar *box, real limit)
{
    Vector inverse = rays->inverse, to_near = rays->to_near, to_far = rays->to_far;
    real near_x = real_fma(box_plane(box, beam->x.near), inverse.x, to_near.x);
    real near_y = real_fma(box_plane(box, beam->y.near), inverse.y, to_near.y);
    real near_z = real_fma(box_plane(box, beam->z.near), inverse.z, to_near.z);
    real far_x = real_fma(box_plane(box, beam->x.far), inverse.x, to_far.x);
    real far_y = real_fma(box_plane(box, beam->y.far), inverse.y, to_far.y);
    real far_z = real_fma(box_plane(box, beam->z.far), inverse.z, to_far.z);
    return real_max(real_max(near_x, near_y), real_max(near_z, rays->near)) <=
           real_min(real_min(far_x, far_y), real_min(far_z, limit));
}

// The rays once more, where they are first read one by one: of what is read so the compiler would keep
// nothing in registers.
typedef struct {
    BoxRays rays;
    bool is_laid;
} LaidRays;

// The boxes, as many as there are lanes, that one ray meets, and where.
static inline mask laid_ray_meets(const BoxRays *rays, uint lane, global const scalar *boxes, scalar limit,
                                  real *near)
{
    uint x = rays->negative_x >> lane & 1 ? BVH_HIGH : BVH_LOW,
         y = rays->negative_y >> lane & 1 ? BVH_HIGH : BVH_LOW,
         z = rays->negative_z >> lane & 1 ? BVH_HIGH : BVH_LOW, other = BVH_LOW + BVH_HIGH;
    real inverse_x = real_of_lane(&rays->inverse.x, lane);
    real inverse_y = real_of_lane(&rays->inverse.y, lane);
    real inverse_z = real_of_lane(&rays->inverse.z, lane);
    real near_x = real_fma(boxes_planes(boxes, x), inverse_x, real_of_lane(&rays->to_near.x, lane));
    real near_y = real_fma(boxes_planes(boxes, 1 + y), inverse_y, real_of_lane(&rays->to_near.y, lane));
    real near_z = real_fma(boxes_planes(boxes, 2 + z), inverse_z, real_of_lane(&rays->to_near.z, lane));
    real far_x = real_fma(boxes_planes(boxes, other - x), inverse_x, real_of_lane(&rays->to_far.x, lane));
    real far_y = real_fma(boxes_planes(boxes, 1 + other - y), inverse_y, real_of_lane(&rays->to_far.y, lane));
    real far_z = real_fma(boxes_planes(boxes, 2 + other - z), inverse_z, real_of_lane(&rays->to_far.z, lane));
    *near = real_max(real_max(near_x, near_y), real_max(near_z, real_of_lane(&rays->near, lane)));
    return *near <= real_min(real_min(far_x, far_y), real_min(far_z, (real)(limit)));
}

// Of each box the lanes, among some, whose rays meet it, as bits, and where the first of them does.
static inline integer laid_rays_meet(LaidRays *laid, const BoxRays *rays, uint lanes,
                                     global const scalar *boxes, real limit, real *near)
{
    if (!laid->is_laid) *laid = (LaidRays){*rays, true};
    RealLanes limits = {limit};
    integer met_by = (integer)(0);
    *near = (real)(LARGEST);
    for (; lanes != 0; lanes &= lanes - 1) {
        uint lane = lowest_bit(lanes);
        real its_near;
        mask its = laid_ray_meets(&laid->rays, lane, boxes, limits.each[lane], &its_near);
        met_by = lanes_select(its, met_by | (integer)((scalar_integer)1 << lane), met_by);
        *near = lanes_select(its & (its_near < *near), its_near, *near);
    }
    return met_by;
}

#endif
