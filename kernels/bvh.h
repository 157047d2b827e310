// Rays and the boxes of the hierarchy.
//
// A node's boxes are first held all at once against a beam that has every ray of the packet in it, by
// interval arithmetic (Boulos, Wald, Shirley, Geometric and arithmetic culling methods for entire ray
// packets, University of Utah, UUCS-06-010, 2006; there one box after the other): a lane there is a box.
// Those that the beam meets are held against the rays, one box after the other: a lane there is a ray.
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

#include "ray.h"

// The rays of a packet. A plane's distance is plane * inverse + to_plane, give or take `around`.
typedef struct {
    Vector inverse; // 1 / direction, bounded
    Vector to_plane, around;
    real slack;
} BoxRays;

static inline BoxRays box_rays(const Ray *ray, scalar4 bounds)
{
    Vector center = vector_of(bounds);
    real reach = vector_magnitude(vector_subtract(ray->origin, center)) + (real)(bounds.w);
    real coordinates = fma((real)(2), vector_magnitude(center), reach);
    real slack = fma((real)(64 * UNIT_ROUNDOFF), reach, (real)(8 * UNIT_ROUNDOFF) * coordinates);
    const real huge = (real)(1 / SMALLEST_RATIO);
    real largest = real_min(huge * real_inverse_power(coordinates), huge);
    Vector inverse = {real_min(real_max(ray->inverse.x, -largest), largest),
                      real_min(real_max(ray->inverse.y, -largest), largest),
                      real_min(real_max(ray->inverse.z, -largest), largest)};
    BoxRays rays;
    rays.inverse = inverse;
    rays.to_plane =
        (Vector){-ray->origin.x * inverse.x, -ray->origin.y * inverse.y, -ray->origin.z * inverse.z};
    rays.around = (Vector){slack * fabs(inverse.x), slack * fabs(inverse.y), slack * fabs(inverse.z)};
    rays.slack = slack;
    return rays;
}

typedef struct {
    real enter, leave;
} BoxSpan;

// Where rays are between two planes across an axis.
static inline BoxSpan box_rays_between(scalar low, scalar high, real inverse, real to_plane, real around)
{
    real at_low = fma((real)(low), inverse, to_plane), at_high = fma((real)(high), inverse, to_plane);
    return (BoxSpan){real_min(at_low, at_high) - around, real_max(at_low, at_high) + around};
}

// Which rays meet a box between ray->near and `limit`.
static inline mask box_rays_meet(const BoxRays *rays, const Ray *ray, scalar4 low, scalar4 high, real limit)
{
    BoxSpan x = box_rays_between(low.x, high.x, rays->inverse.x, rays->to_plane.x, rays->around.x);
    BoxSpan y = box_rays_between(low.y, high.y, rays->inverse.y, rays->to_plane.y, rays->around.y);
    BoxSpan z = box_rays_between(low.z, high.z, rays->inverse.z, rays->to_plane.z, rays->around.z);
    return real_max(real_max(x.enter, y.enter), real_max(z.enter, ray->near)) <=
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
    scalar near, limit;     // all that the rays look for lies between
    Vector to_near, to_far; // BoxRays' to_plane, with `around`
} Beam;

enum { BEAM_LEAST, BEAM_MOST = 3, BEAM_START = 6, BEAM_END = 9, BEAM_NEAR = 12, BEAM_LIMIT };

static inline void beam_axis_gather(Leasts *leasts, uint axis, mask members, real origin, real inverse,
                                    real slack, bool negative)
{
    const real none = (real)(LARGEST), side = (real)(negative ? -1 : 1);
    leasts->all[BEAM_LEAST + axis] = lanes_select(members, fabs(inverse), none);
    leasts->all[BEAM_MOST + axis] = lanes_select(members, -fabs(inverse), none);
    leasts->all[BEAM_START + axis] = lanes_select(members, fma(origin, -side, -slack), none);
    leasts->all[BEAM_END + axis] = lanes_select(members, fma(origin, side, -slack), none);
}

static inline BeamAxis beam_axis(const Leasts *leasts, uint axis, bool negative, scalar everywhere)
{
    scalar least = leasts->each[BEAM_LEAST + axis], most = -leasts->each[BEAM_MOST + axis];
    scalar start = leasts->each[BEAM_START + axis], end = leasts->each[BEAM_END + axis];
    const scalar side = negative ? -1 : 1;
    return (BeamAxis){side * least,
                      side * most,
                      start * least - everywhere,
                      everywhere - end * most,
                      axis + (negative ? BVH_HIGH : BVH_LOW),
                      axis + (negative ? BVH_LOW : BVH_HIGH)};
}

// Bit i of `signs`: the members' directions are negative along axis i.
static inline Beam beam_make(const BoxRays *rays, const Ray *ray, mask members, uint signs, real limit)
{
    Leasts leasts;
    beam_axis_gather(&leasts, 0, members, ray->origin.x, rays->inverse.x, rays->slack, signs & 1);
    beam_axis_gather(&leasts, 1, members, ray->origin.y, rays->inverse.y, rays->slack, signs & 2);
    beam_axis_gather(&leasts, 2, members, ray->origin.z, rays->inverse.z, rays->slack, signs & 4);
    leasts.all[BEAM_NEAR] = lanes_select(members, ray->near, (real)(LARGEST));
    for (uint i = BEAM_LIMIT; i < LEASTS; i++)
        leasts.all[i] = lanes_select(members, -limit, (real)(LARGEST));
    leasts_find(&leasts);
    Beam beam;
    beam.near = leasts.each[BEAM_NEAR];
    // where one does look there, the beam is all of space, unless it is a single ray
    const scalar everywhere = LANES > 1 && beam.near < 0 ? LARGEST * 0.5f : 0;
    beam.x = beam_axis(&leasts, 0, signs & 1, everywhere);
    beam.y = beam_axis(&leasts, 1, signs & 2, everywhere);
    beam.z = beam_axis(&leasts, 2, signs & 4, everywhere);
    beam.limit = -leasts.each[BEAM_LIMIT];
    beam.to_near = vector_subtract(rays->to_plane, rays->around);
    beam.to_far = vector_add(rays->to_plane, rays->around);
    return beam;
}

static inline real beam_axis_enter(const BeamAxis *axis, global const scalar *boxes)
{
    return fma(real_load(boxes + axis->near * BVH_WIDTH), (real)(axis->least), (real)(axis->to_near));
}

static inline real beam_axis_leave(const BeamAxis *axis, global const scalar *boxes)
{
    return fma(real_load(boxes + axis->far * BVH_WIDTH), (real)(axis->most), (real)(axis->to_far));
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
static inline mask beam_rays_meet(const Beam *beam, const BoxRays *rays, const Ray *ray,
                                  global const scalar *box, real limit)
{
    Vector inverse = rays->inverse;
    real near_x = fma(box_plane(box, beam->x.near), inverse.x, beam->to_near.x);
    real near_y = fma(box_plane(box, beam->y.near), inverse.y, beam->to_near.y);
    real near_z = fma(box_plane(box, beam->z.near), inverse.z, beam->to_near.z);
    real far_x = fma(box_plane(box, beam->x.far), inverse.x, beam->to_far.x);
    real far_y = fma(box_plane(box, beam->y.far), inverse.y, beam->to_far.y);
    real far_z = fma(box_plane(box, beam->z.far), inverse.z, beam->to_far.z);
    return real_max(real_max(near_x, near_y), real_max(near_z, ray->near)) <=
           real_min(real_min(far_x, far_y), real_min(far_z, limit));
}

#endif
