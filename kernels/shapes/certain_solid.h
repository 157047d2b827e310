// Finds bounded hits on solids within a round side (shapes/certain_round.h) and between ends, if they have
// any.
#ifndef CERTAIN_SOLID_H
#define CERTAIN_SOLID_H

#include "shapes/certain_cylinder.h"
#include "shapes/certain_sphere.h"
#include "shapes/ends.h"

// Returns the first hit, with bounds, on a shape between side and ends. A capped solid is the intersection
// of both; any other one is hit on its side between the ends. In the lanes `leaves` the ray starts on the
// shape and runs into it.
static inline CertainHit round_first_hit(uint flags, const Ray *ray, const CertainInterval *side,
                                         const CertainInterval *slab, mask leaves)
{
    if (flags & REVOLUTION_CAPPED) {
        CertainInterval solid;
        solid.outer = intervals_common(side->outer, slab->outer);
        solid.inner = intervals_common(side->inner, slab->inner);
        solid.roots = intervals_common(side->roots, slab->roots);
        solid.perhaps = side->perhaps & slab->perhaps & (solid.outer.near <= solid.outer.far);
        solid.certain = solid.perhaps & side->certain & slab->certain & (solid.inner.near < solid.inner.far);
        return certain_interval_hit(&solid, ray, leaves);
    }
    CertainHit hits[2];
    mask passed[2];
    for (uint i = 0; i < 2; i++) {
        real low = i == 0 ? side->outer.near : lanes_select(side->certain, side->inner.far, ray->tmin);
        real high = i == 0 ? lanes_select(side->certain, side->inner.near, NEVER) : side->outer.far;
        mask within = (low >= slab->inner.near) & (high <= slab->inner.far) & slab->certain;
        mask beyond = !slab->perhaps | (high <= slab->outer.near) | (low >= slab->outer.far);
        mask perhaps = side->perhaps & !beyond;
        hits[i] = certain_at(certain_crossing(ray, side->certain & within, perhaps, low, high),
                             i == 0 ? side->roots.near : side->roots.far);
        passed[i] = beyond | (high < ray->tmin);
    }
    if (flags & IGNORES_FRONT_FACES) return hits[1];
    return certain_select(leaves | passed[0], hits[1], hits[0]);
}

static inline CertainInterval round_unbounded(void)
{
    const Interval everywhere = {(real)(-LARGEST), (real)(LARGEST)};
    return (CertainInterval){everywhere, everywhere, everywhere, mask_all(), mask_all()};
}

// A round body with its ends' heights.
typedef struct {
    Round round;
    bool is_finite, is_straight; // is_straight: the side is a cylinder
    real low, high;              // the ends' heights
    real half_height;            // half the distance between them
    real widest;                 // the largest radius
    real axis_error;             // bounds the errors of the axis' direction and of the slope
    Vector middle;
} RoundSolid;

// Returns the interval where slope t >= height.
static inline Interval interval_above(real slope, real height)
{
    mask rises = slope > SMALLEST_RATIO, falls = slope < -SMALLEST_RATIO;
    real t = real_divide(height, lanes_select(rises | falls, slope, (real)(1)));
    real empty = lanes_select(height > 0, (real)(LARGEST), (real)(-LARGEST));
    real none = lanes_select(rises, t, lanes_select(falls, (real)(-LARGEST), empty));
    return (Interval){none, lanes_select(falls, t, (real)(LARGEST))};
}

// Returns the interval between the heights low and high.
static inline CertainInterval round_slab(const Round *round, const Ray *ray, real low, real high)
{
    // z and the ends share the rounding of the axis' length. Apart from it an end is off by 2 u, its
    // difference from z by u, that from the error by u, and their quotient by 5 u.
    const real few = (real)(9 * UNIT_ROUNDOFF);
    real z = vector_dot(round->axis, round->start), rise = vector_dot(round->axis, ray->direction);
    real low_error = real_fma(few, fabs(low) + fabs(z), round->start_error),
         high_error = real_fma(few, fabs(high) + fabs(z), round->start_error);
    real error_per_t = round->error_per_t;
    CertainInterval slab;
    slab.outer = intervals_common(interval_above(rise + error_per_t, low - z - low_error),
                                  interval_above(error_per_t - rise, z - high - high_error));
    slab.inner = intervals_common(interval_above(rise - error_per_t, low - z + low_error),
                                  interval_above(-rise - error_per_t, z - high + high_error));
    slab.roots = intervals_common(interval_above(rise, low - z), interval_above(-rise, z - high));
    slab.certain = slab.inner.near < slab.inner.far;
    slab.perhaps = slab.outer.near <= slab.outer.far;
    return slab;
}

// Returns the first hit on both nappes of an unbounded cone, each of which is a convex body. A ray that
// starts on one nappe leaves that one.
static inline CertainHit nappes_first_hit(Round round, uint flags, const Ray *ray, mask lanes, mask leaves,
                                          Interval range)
{
    real radius = real_fma(round.slope, vector_dot(round.axis, round.start), round.radius);
    real error = round.start_error * (1 + fabs(round.slope));
    const CertainInterval slab = round_unbounded();
    CertainHit hits[2];
    for (uint i = 0; i < 2; i++) {
        mask on_it = leaves & (radius > 0);
        CertainInterval side =
            round_interval(&round, ray, lanes & !(on_it & ray->leaves_outward), range, false);
        hits[i] = round_first_hit(flags, ray, &side, &slab, on_it);
        round.radius = -round.radius;
        round.slope = -round.slope;
        radius = -radius;
    }
    mask one = hits[0].found | hits[0].uncertain, other = hits[1].found | hits[1].uncertain;
    mask swaps = other & (!one | (hits[1].low < hits[0].low));
    CertainHit first = certain_select(swaps, hits[1], hits[0]),
               second = certain_select(swaps, hits[0], hits[1]);
    mask mixes = one & other & !(second.low > first.high);
    mask at_apex = lanes & leaves & (fabs(radius) <= error);
    real_replace(&first.low, at_apex, ray->tmin);
    first.uncertain = first.uncertain | (first.found & mixes) | at_apex;
    first.found = first.found & !first.uncertain;
    return first;
}

// Returns the lanes where the exact ray certainly stays off the axis of a finite solid or an unbounded
// cylinder, or off an unbounded double cone, whose base is its apex. This rejects most misses at a fraction
// of the full test's cost.
static inline mask solid_is_off_line(const RoundSolid *solid, bool two_nappes, const Ray *ray)
{
    const Round *round = &solid->round;
    const real one = (real)(1);
    if (round->has_power || (round->curves && !solid->is_finite)) return mask_none();
    real reach = solid->widest + round->start_error;
    if (solid->is_finite) {
        // The exact ray reaches the solid within `farthest` and its error there. With an error g of the
        // direction, that error exceeds the one at `farthest` by less than g / (1 - g) of it, or a 60th. The
        // 2% of line_is_off_axis cover this.
        const real farthest =
            vector_norm1(round->start) + solid->widest + real_max(fabs(solid->low), fabs(solid->high));
        reach = real_fma(round->error_per_t, farthest * ray_inverse_length(ray), reach);
        return line_is_off_axis(round->start, reach * reach, round->axis, one, (real)(0), ray);
    }
    if (two_nappes)
        return line_is_off_cone(round->start, round->slope, round->axis, round->start_error,
                                round->error_per_t, ray);
    return line_is_off_axis(round->start, reach * reach, round->axis, one, round->error_per_t, ray);
}

static inline CertainHit round_solid_hit(const RoundSolid *solid, uint4 id, bool two_nappes, const Ray *ray)
{
    const Round *round = &solid->round;
    mask leaves = ray_starts_on(ray, id.x), lanes = RAY_ACTIVE(ray);
    Interval part;
    lanes = lanes & !solid_is_off_line(solid, two_nappes, ray);
    if (!lanes_any(lanes)) return certain_miss();
    const bool is_cylinder = solid->is_straight && !round->has_power;
    if (is_cylinder) {
        part = (Interval){(real)(-LARGEST), (real)(LARGEST)};
    } else if (solid->is_finite) {
        const BoundedLine bounded =
            line_within_bounds(solid->middle, solid->widest + solid->half_height + round->start_error, ray);
        lanes = lanes & bounded.lanes;
        part = bounded.part;
        if (!lanes_any(lanes)) return certain_miss();
    } else {
        part = round_range(ray, vector_norm1(round->start) + vector_norm1(ray->origin) + solid->widest +
                                    round->foot_norm1);
        if (two_nappes) return nappes_first_hit(*round, id.y, ray, lanes, leaves, part);
    }
    lanes = lanes & !(leaves & ray->leaves_outward);
    CertainInterval slab = round_unbounded();
    if (solid->is_finite) {
        slab = round_slab(round, ray, solid->low, solid->high);
        slab.outer = intervals_common(slab.outer, part);
        slab.perhaps = slab.outer.near <= slab.outer.far;
        lanes = lanes & slab.perhaps & !ray_excludes(ray, slab.outer.near, slab.outer.far);
        if (!lanes_any(lanes)) return certain_miss();
    }
    const CertainInterval side = is_cylinder ? cylinder_interval(round, ray, lanes, slab.outer)
                                             : round_interval(round, ray, lanes, part, solid->is_finite);
    return round_first_hit(id.y, ray, &side, &slab, leaves);
}

// Sets the errors of a point's normal, at t. Returns the lanes where the point may be at the rim, where the
// normals of side and cap differ. A vector that is off by e is, once normalized, off by up to 2 e over its
// length, which is rho, or for a paraboloid the gradient's, at least rho and k / 2. To 1 over that half as
// much is added, since the point is moved onto the surface: 1.5 / max(rho, k / 2) <= 3 / max(rho, k). The
// normal turns with the axis and, as the slope changes, by half as much again. The ray's error only moves the
// point, so it counts in position_error alone.
static inline mask round_set_errors(const RoundSolid *solid, uint flags, const Ray *ray, real t,
                                    real position_error, SurfacePoint *point)
{
    const Round *round = &solid->round;
    const RoundPoint at = round_point(round, ray, t);
    real error = 2 * (position_error + at.position_error);
    real curvature =
        divide_or((real)(round->curves ? 3 : 1), round->curves ? real_max(round->k, at.rho) : at.rho,
                  (real)(1 / SMALLEST_RATIO));
    real rounding = at.rounding; // with a power, also of the foot
    if (round->has_power) rounding = real_fma((real)(2 * UNIT_ROUNDOFF), round->foot_norm1, rounding);
    point->curvature = curvature;
    point->normal_error = 2 * real_fma(rounding, curvature, solid->axis_error);
    if (!(flags & REVOLUTION_CAPPED)) return mask_none();
    real z = vector_dot(round->axis, vector_fma(ray->direction, t, round->start));
    real from_end = real_min(fabs(z - solid->low), fabs(z - solid->high));
    real side_band = error * (round->curves ? at.rho + at.rho + error + round->k
                                            : (at.rho + fabs(at.radius)) * (1 + fabs(round->slope)));
    mask near_end = from_end <= error, near_side = fabs(at.value) <= at.band + side_band;
    mask on_cap = near_end & !near_side;
    real_replace(&point->curvature, on_cap, (real)(0));
    real_replace(&point->normal_error, on_cap, 2 * solid->axis_error);
    return near_end & near_side;
}

// The functions with bounds of a shape, which SOLID returns as a RoundSolid.
#define ROUND_SHAPE(name, Type, two_nappes, SOLID)                                                           \
    static inline CertainHit name##_certain_hit(const Type *shape, const Ray *ray)                           \
    {                                                                                                        \
        const RoundSolid solid = SOLID;                                                                      \
        return round_solid_hit(&solid, shape->id, two_nappes, ray);                                          \
    }                                                                                                        \
                                                                                                             \
    static inline mask name##_set_errors(const Type *shape, const Ray *ray, real t, real position_error,     \
                                         SurfacePoint *point)                                                \
    {                                                                                                        \
        const RoundSolid solid = SOLID;                                                                      \
        return round_set_errors(&solid, shape->id.y, ray, t, position_error, point);                         \
    }

#endif
