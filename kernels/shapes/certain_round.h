// Hits with bounds of surfaces of revolution, and of spheres with the eye's power. The side bounds a convex
// set, so that the exact ray is within it along one interval of t. Roots are computed as they may; points
// next to them are then evaluated, and only what their values, beyond all errors, prove counts.
//
// A sphere with the eye's power is a cylinder with the axis 0.
#ifndef CERTAIN_ROUND_H
#define CERTAIN_ROUND_H

#include "shapes/certain.h"
#include "shapes/paraboloid.h"
#include "shapes/revolution.h"
#include "shapes/sphere.h"

#if IS_CERTIFIED

// The exact interval of t contains `inner`, if `certain`, and lies within `outer`, if `perhaps`.
typedef struct {
    Interval outer, inner;
    mask certain, perhaps;
} CertainInterval;

// The inside: rho <= radius + slope z, or rho^2 <= k z where k > 0, for the distance rho from the axis and
// the height z along it.
typedef struct {
    Vector start; // the ray's origin, seen from the base; with a power from the eye
    Vector foot;  // a point of the axis, seen from there
    Vector axis;  // unit, or 0
    real radius, slope, k;
    real power;             // with HAS_POWER, of the unit axis
    real power_scale;       // the 1-norm of the foot
    real place0, place1;    // a point at t is off by place0 + place1 |t|
    bool has_power, curves; // curves: k > 0
} Round;

typedef struct {
    real value, band; // outside if value > band, inside if value < -band
    Vector across;    // from the axis
    real rho, radius;
} RoundPoint;

static inline Vector round_across(const Round *round, Vector v)
{
    return vector_fma(round->axis, -vector_dot(round->axis, v), v);
}

static inline RoundPoint round_point(const Round *round, const Ray *ray, real t)
{
    RoundPoint point;
    Vector x = vector_fma(ray->direction, t, round->start);
    real place = real_fma(round->place1, fabs(t), round->place0);
    real z = vector_dot(round->axis, x);
    point.across = round_across(round, round->has_power ? vector_subtract(x, round->foot) : x);
    point.rho = vector_norm(point.across);
    point.radius = real_fma(round->slope, z, round->radius);
    // what the axis' length, off by 14 u, leaves of z in the distance from it, squared
    real left_of_z = (real)(20 * UNIT_ROUNDOFF) * z, power_band = left_of_z * left_of_z;
    real from_eye = (real)(0), lift = round->k * z;
    if (round->has_power) {
        // rho^2 - radius^2 without cancellation next to the eye
        real rise = round->slope * z, twice = round->radius + round->radius;
        if (!round->curves) lift = rise * (twice + rise);
        Vector beyond = vector_fma(round->foot, (real)(-2), x);
        from_eye = round->power + (vector_dot(round_across(round, x), round_across(round, beyond)) - lift);
        real size = vector_norm1(x);
        power_band += (real)(UNIT_ROUNDOFF) *
                      ((real)(16) * real_fma(size, size + round->power_scale + round->power_scale,
                                             fabs(lift) + fabs(rise) * fabs(twice)) +
                       (real)(4) * fabs(round->power));
    }
    if (round->curves) {
        point.value = round->has_power ? from_eye : real_fma(point.rho, point.rho, -lift);
        point.band = real_fma(place, point.rho + point.rho + place + round->k, power_band);
        return point;
    }
    real sum = point.rho + fabs(point.radius);
    real value = (point.rho - point.radius) * sum;
    if (round->has_power) value = lanes_select(point.radius < (real)(0), value, from_eye);
    point.value = value;
    point.band =
        real_fma(place * (real)(1 + 16 * UNIT_ROUNDOFF), real_fma(fabs(round->slope), sum, sum), power_band);
    return point;
}

// a t^2 + 2 b t + c = 0 where the ray crosses the side.
typedef struct {
    Vector m, q; // the ray's origin and direction across the axis
    real rise;   // and along it
    real a, b, c, discriminant;
    real h; // how fast the radius grows
} RoundQuadratic;

static inline RoundQuadratic round_quadratic(const Round *round, const Ray *ray)
{
    RoundQuadratic quadratic;
    const RoundPoint start = round_point(round, ray, (real)(0));
    Vector m = start.across, q = round_across(round, ray->direction);
    real rise = vector_dot(round->axis, ray->direction), z = vector_dot(round->axis, round->start);
    real mq = vector_dot(m, q), qq = vector_dot(q, q), h = round->slope * rise;
    real half_k = (real)(0.5f) * round->k, bend = half_k * rise;
    quadratic.m = m;
    quadratic.q = q;
    quadratic.rise = rise;
    quadratic.h = h;
    quadratic.a = real_fma(-h, h, qq);
    quadratic.b = round->curves ? mq - bend : real_fma(-start.radius, h, mq);
    quadratic.c = start.value;
    if (!round->has_power && !round->curves)
        quadratic.c = (start.rho - fabs(start.radius)) * (start.rho + fabs(start.radius));
    if (round->has_power) {
        quadratic.discriminant = difference_of_products(quadratic.b, quadratic.b, quadratic.a, quadratic.c);
        return quadratic;
    }
    real moment = fabs(vector_dot(round->axis, vector_cross(m, q)));
    if (round->curves) {
        Vector off = vector_fma(m, rise, vector_scale(q, -z));
        real rest = real_fma(round->k, vector_dot(q, off), moment * moment);
        quadratic.discriminant = real_fma(bend, bend, -rest);
    } else {
        real reach = vector_norm(vector_fma(q, start.radius, vector_scale(m, -h)));
        quadratic.discriminant = (reach - moment) * (reach + moment);
    }
    return quadratic;
}

// Whether a height above a plane, which is linear, stays above 0 between `from` and `to`, and beyond but in
// the lanes `ends`.
static inline mask height_is_positive(real height, real slope, real slope_error, real t, real from, real to,
                                      mask ends)
{
    real at_from = height - real_max(slope + slope_error, (real)(0)) * (t - from);
    real at_to = height + (slope - slope_error) * (to - t);
    return (height > (real)(0)) & (at_from > (real)(0)) &
           ((slope >= slope_error) | (ends & (at_to > (real)(0))));
}

// Whether the exact ray misses the side between `from` >= 0 and `to`, and beyond but in the lanes `ends`. At
// t1, about its closest approach, a plane separates it from the side, or from a parallel surface. Tilted a
// little, the plane also does where the ray goes on without end: rho is at least n . x for
// n = (across / rho + s q / |q|) / (1 + |s|), and rho^2 at least 2 a . x - a . a for any a.
static inline mask round_misses(const Round *round, const RoundQuadratic *quadratic, const Ray *ray,
                                real from, real to, mask ends)
{
    const real zero = (real)(0), one = (real)(1);
    real qq = vector_dot(quadratic->q, quadratic->q), q_length = real_sqrt(qq), t1;
    real rise_error = real_fma(round->place1, fabs(round->slope), round->place1);
    real h = real_fma((real)(2.5f), rise_error, quadratic->h);
    mask tilts = fabs(h) < q_length;
    if (round->curves) {
        t1 = divide_or(-quadratic->b, qq, zero);
    } else {
        real t0 = divide_or(-vector_dot(quadratic->m, quadratic->q), qq, zero);
        real rho = vector_norm(vector_fma(quadratic->q, t0, quadratic->m));
        real steepness = real_sqrt(real_max((q_length - h) * (q_length + h), zero));
        real end = lanes_select(h > zero, to, from);
        t1 = lanes_select(tilts, t0 + divide_or(h * rho, q_length * steepness, zero), end);
    }
    t1 = real_min(real_max(t1, from), to);
    RoundPoint point = round_point(round, ray, t1);
    real along = vector_dot(point.across, quadratic->q), along_unit = divide_or(along, q_length, zero);
    real height = point.value - point.band, slope, slope_error, tilted, tilted_slope;
    if (round->curves) {
        slope = real_fma(-round->k, quadratic->rise, along + along);
        slope_error = round->place1 * (point.rho + point.rho + round->k);
        tilted_slope = (real)(2.5f) * slope_error;
        real tilt = divide_or((real)(0.5f) * (tilted_slope - slope), q_length, zero);
        tilted = real_fma(-tilt, tilt, height);
        tilts = q_length > zero;
    } else {
        height = divide_or(height, point.rho + fabs(point.radius), zero);
        slope_error = rise_error;
        real part = divide_or(along_unit, point.rho, zero), wanted = divide_or(h, q_length, zero);
        real difference = wanted - part;
        real room = lanes_select(difference > zero, one - wanted, one + wanted);
        real tilt = divide_or(difference, room, zero);
        tilted_slope = h - quadratic->h;
        tilted =
            height - point.rho + divide_or(real_fma(tilt, along_unit, point.rho), one + fabs(tilt), zero);
        slope = real_fma(part, q_length, -quadratic->h);
    }
    return height_is_positive(height, slope, slope_error, t1, from, to, ends) |
           (tilts & height_is_positive(tilted, tilted_slope, slope_error, t1, from, to, ends));
}

// Where the exact ray is inside the side. Roots are looked for from `from` to `to`, beyond which nothing
// matters if `is_finite`; `perhaps` is said for t >= tmin.
static inline CertainInterval round_interval(const Round *round, const Ray *ray, mask lanes, real from,
                                             real to, bool is_finite)
{
    CertainInterval interval;
    interval.outer = interval.inner = (Interval){(real)(-LARGEST), (real)(LARGEST)};
    interval.certain = mask_none();
    const RoundQuadratic quadratic = round_quadratic(round, ray);
    real end = ray->tmax * (real)(1 + 64 * UNIT_ROUNDOFF); // of rays to a light
    mask ends = is_finite ? mask_all() : end < to;
    interval.perhaps = lanes & !round_misses(round, &quadratic, ray, real_max(from, ray->tmin),
                                             real_max(real_min(to, end), ray->tmin), ends);
    if (!lanes_any(interval.perhaps)) return interval;

    real a = quadratic.a, root = real_sqrt(real_max(quadratic.discriminant, (real)(0)));
    mask ahead = quadratic.b < (real)(0);
    real sum = lanes_select(ahead, root - quadratic.b, -(root + quadratic.b));
    mask positive = (sum > (real)(0)) == (a >= (real)(0));
    real one = divide_or(sum, a, lanes_select(positive, (real)(LARGEST), (real)(-LARGEST)));
    real other = lanes_select(sum == (real)(0), one, divide_or(quadratic.c, sum, one));
    real near = real_min(one, other), far = real_max(one, other);
    // a cone around the ray's direction is left or entered once: the other root is the other nappe's
    mask outer = a<(real)(0), grows = quadratic.h>(real)(0);
    real entry = lanes_select(outer, lanes_select(grows, far, (real)(-LARGEST)), near);
    real leave = lanes_select(outer, lanes_select(grows, (real)(LARGEST), near), far);
    real roots[2] = {real_min(real_max(entry, from), to), real_min(real_max(leave, from), to)};
    real before[2], after[2];
    for (uint i = 0; i < 2; i++) {
        real t = roots[i];
        RoundPoint point = round_point(round, ray, t);
        real slope = real_fma(a, t, quadratic.b); // half of it
        real step = divide_or((real)(0.5f) * point.value, slope, (real)(0));
        mask settles = fabs(step) * (real)(0x1p6f) < fabs(t); // else the root was none
        t = lanes_select(settles, t - step, t);
        real band = (real)(2.5f) * point.band, bend = fabs(a) * band;
        real steepness = real_max(fabs(slope), (real)(0.5f) * real_sqrt(bend));
        real width =
            divide_or(band, steepness + real_sqrt(real_max(real_fma(steepness, steepness, -bend), (real)(0))),
                      (real)(0));
        before[i] = t - width;
        after[i] = t + width;
    }
    const real enter_out = real_max(before[0], from), enter_in = real_min(after[0], to),
               leave_in = real_max(before[1], from), leave_out = real_min(after[1], to);
    RoundPoint outside_before = round_point(round, ray, enter_out),
               inside_first = round_point(round, ray, enter_in),
               inside_last = round_point(round, ray, leave_in),
               outside_after = round_point(round, ray, leave_out);
    mask first = inside_first.value < -inside_first.band, last = inside_last.value < -inside_last.band;
    first = first & (enter_in <= leave_out);
    last = last & (leave_in >= enter_out);
    interval.certain = interval.perhaps & (first | last);
    real low =
        lanes_select(first & last, real_min(enter_in, leave_in), lanes_select(first, enter_in, leave_in));
    real high = lanes_select(first & last, real_max(enter_in, leave_in), low);
    interval.inner = (Interval){low, high};
    mask before_known = interval.certain & (outside_before.value > outside_before.band) & (enter_out < low);
    mask after_known = interval.certain & (outside_after.value > outside_after.band) & (leave_out > high);
    interval.outer.near = lanes_select(before_known, enter_out, (real)(-LARGEST));
    interval.outer.far = lanes_select(after_known, leave_out, (real)(LARGEST));
    return interval;
}

// Where slope t >= least.
static inline Interval interval_above(real slope, real least)
{
    mask rises = slope > (real)(SMALLEST_RATIO), falls = slope < (real)(-SMALLEST_RATIO);
    real t = real_divide(least, lanes_select(rises | falls, slope, (real)(1)));
    real empty = lanes_select(least > (real)(0), (real)(LARGEST), (real)(-LARGEST));
    real none = lanes_select(rises, t, lanes_select(falls, (real)(-LARGEST), empty));
    return (Interval){none, lanes_select(falls, t, (real)(LARGEST))};
}

static inline Interval intervals_common(Interval a, Interval b)
{
    return (Interval){real_max(a.near, b.near), real_min(a.far, b.far)};
}

// Between the heights low and high.
static inline CertainInterval round_slab(const Round *round, const Ray *ray, real low, real high)
{
    const real few = (real)(4 * UNIT_ROUNDOFF);
    real z = vector_dot(round->axis, round->start), rise = vector_dot(round->axis, ray->direction);
    real low_error = real_fma(few, fabs(low), round->place0),
         high_error = real_fma(few, fabs(high), round->place0);
    real place1 = round->place1;
    CertainInterval slab;
    slab.outer = intervals_common(interval_above(rise + place1, low - z - low_error),
                                  interval_above(place1 - rise, z - high - high_error));
    slab.inner = intervals_common(interval_above(rise - place1, low - z + low_error),
                                  interval_above(-rise - place1, z - high + high_error));
    slab.certain = slab.inner.near < slab.inner.far;
    slab.perhaps = slab.outer.near <= slab.outer.far;
    return slab;
}

// The first hit of a shape between side and ends: as ends_first_hit. `left`: the ray starts on it and runs
// into it.
static inline CertainHit round_first_hit(uint flags, const Ray *ray, const CertainInterval *side,
                                         const CertainInterval *slab, mask left)
{
    const real never = (real)(LARGEST / 8);
    if (flags & REVOLUTION_CAPPED) {
        Interval outer = intervals_common(side->outer, slab->outer),
                 inner = intervals_common(side->inner, slab->inner);
        mask perhaps = side->perhaps & slab->perhaps & (outer.near <= outer.far);
        mask certain = perhaps & side->certain & slab->certain & (inner.near < inner.far);
        real near_high = lanes_select(certain, inner.near, never);
        CertainHit near = certain_crossing(ray, certain, perhaps, outer.near, near_high);
        CertainHit far =
            certain_crossing(ray, certain, perhaps, lanes_select(certain, inner.far, ray->tmin), outer.far);
        return certain_select(left, far, certain_first(ray, near, near_high, far));
    }
    CertainHit hits[2];
    mask passed[2];
    for (uint i = 0; i < 2; i++) {
        real low = i == 0 ? side->outer.near : lanes_select(side->certain, side->inner.far, ray->tmin);
        real high = i == 0 ? lanes_select(side->certain, side->inner.near, never) : side->outer.far;
        mask within = (low >= slab->inner.near) & (high <= slab->inner.far) & slab->certain;
        mask beyond = !slab->perhaps | (high <= slab->outer.near) | (low >= slab->outer.far);
        mask perhaps = side->perhaps & !beyond;
        hits[i] = certain_crossing(ray, side->certain & within, perhaps, low, high);
        passed[i] = beyond | (high < ray->tmin);
    }
    if (flags & IGNORES_FRONT_FACES) return hits[1];
    return certain_select(left | passed[0], hits[1], hits[0]);
}

static inline CertainInterval round_unbounded(void)
{
    const Interval everywhere = {(real)(-LARGEST), (real)(LARGEST)};
    return (CertainInterval){everywhere, everywhere, mask_all(), mask_all()};
}

// Beyond this t the ray's error is a part of its distance that leaves nothing to tell.
static inline real round_range(const Ray *ray, real size)
{
    return (real)(0x1p-10f / UNIT_ROUNDOFF) * size * ray->inverse_length;
}

// In u of the coordinates: what the axis' direction and the products add; where the radius depends on the
// height, the axis' length as well.
enum { ROUND_ERROR = 8, SLOPED_ROUND_ERROR = 20 };

static inline real round_place1(const Ray *ray, uint units)
{
    return real_fma(ray->length, ray->direction_error,
                    (real)(units * UNIT_ROUNDOFF) * vector_norm1(ray->direction));
}

static inline real round_place0(const Ray *ray, Vector start, uint units)
{
    return ray->origin_error + (real)(UNIT_ROUNDOFF)*real_fma((real)(units), vector_norm1(start),
                                                              (real)(2) * vector_norm1(ray->origin));
}

static inline CertainHit sphere_power_certain_hit(const Sphere *sphere, const Ray *ray)
{
    const real zero = (real)(0);
    mask left = ray->left == (integer)((scalar_integer)sphere->id.x);
    mask lanes = RAY_ACTIVE(ray) & !(left & ray->leaves_outward);
    Round round;
    round.start = ray->origin;
    round.foot = vector_of(sphere->center_radius);
    round.axis = (Vector){zero, zero, zero};
    round.radius = (real)(sphere->center_radius.w);
    round.slope = round.k = zero;
    round.power = eye_power_of(sphere->id);
    round.power_scale = vector_norm1(round.foot);
    round.place0 = round_place0(ray, ray->origin, ROUND_ERROR);
    round.place1 = round_place1(ray, ROUND_ERROR);
    round.has_power = true;
    round.curves = false;
    real range = round_range(ray, round.power_scale + round.radius + vector_norm1(ray->origin));
    CertainInterval side = round_interval(&round, ray, lanes, -range, range, false), slab = round_unbounded();
    return round_first_hit(sphere->id.y & IGNORES_FRONT_FACES, ray, &side, &slab, left);
}

// The part of the line in a sphere that contains a finite shape.
static inline mask round_bounds(Vector center, real radius, const Ray *ray, real *from, real *to)
{
    CertainSphere bounding =
        certain_sphere(center, radius * (real)(1 + 64 * UNIT_ROUNDOFF), ray, RAY_ACTIVE(ray));
    *from = bounding.near_t - bounding.t_error;
    *to = bounding.far_t + bounding.t_error;
    return bounding.perhaps & (*to >= ray->tmin);
}

// A cylinder or cone with its ends' heights.
typedef struct {
    Round round;
    bool is_finite;
    real low, high;   // the ends' heights
    real half_height; // of the distance between them
    real widest;      // radius
    Vector middle;
} RoundSolid;

static inline RoundSolid round_of_revolution(const Revolution *shape, bool sloped, const Ray *ray)
{
    RoundSolid solid;
    Round *round = &solid.round;
    Vector base = vector_of(shape->base_radius);
    real inverse = real_divide((real)(1), (real)(shape->range.y));
    solid.is_finite = shape->id.y & REVOLUTION_FINITE;
    round->has_power = has_eye_power(shape->id);
    round->curves = false;
    round->foot = base;
    round->axis = vector_scale(vector_of(shape->axis_slope), inverse);
    round->radius = (real)(shape->base_radius.w) * inverse;
    round->slope = sloped ? (real)(shape->axis_slope.w) : (real)(0);
    round->k = (real)(0);
    round->power = round->has_power ? eye_power_of(shape->id) * inverse * inverse : (real)(0);
    round->power_scale = vector_norm1(base);
    round->start = round->has_power ? ray->origin : vector_subtract(ray->origin, base);
    const uint units = sloped ? SLOPED_ROUND_ERROR : ROUND_ERROR;
    round->place0 = round_place0(ray, round->start, units);
    round->place1 = round_place1(ray, units);
    solid.low = (real)(shape->range.w) * inverse;
    solid.high = (real)(shape->range.x) * inverse;
    solid.half_height = (real)(0.5f) * (solid.high - solid.low);
    solid.middle = vector_fma(round->axis, solid.low + solid.half_height, base);
    solid.widest = round->radius;
    if (solid.is_finite)
        solid.widest = real_max(real_fma(round->slope, solid.low, round->radius),
                                real_fma(round->slope, solid.high, round->radius));
    if (round->has_power) return solid;
    round->place0 = round->place0 + (real)(16 * UNIT_ROUNDOFF) * solid.widest;
    if (!solid.is_finite) return solid;
    // both ends are rounded as points, which turns the axis
    Vector end = vector_fma(round->axis, solid.high, base);
    real moved = (real)(2 * UNIT_ROUNDOFF) * (vector_norm1(base) + vector_norm1(end));
    real turned = (real)(2) + divide_or(solid.widest, solid.half_height, (real)(0));
    round->place0 = round->place0 + real_fma(moved, turned, (real)(16 * UNIT_ROUNDOFF) * solid.half_height);
    return solid;
}

// Both nappes of an unbounded cone, each a convex body of its own. A ray that starts on one leaves that.
static inline CertainHit nappes_first_hit(Round round, uint flags, const Ray *ray, mask lanes, mask left,
                                          real from, real to)
{
    real radius = real_fma(round.slope, vector_dot(round.axis, round.start), round.radius);
    real error = round.place0 * ((real)(1) + fabs(round.slope));
    const CertainInterval slab = round_unbounded();
    CertainHit hits[2];
    for (uint i = 0; i < 2; i++) {
        mask on_it = left & (radius > (real)(0));
        CertainInterval side =
            round_interval(&round, ray, lanes & !(on_it & ray->leaves_outward), from, to, false);
        hits[i] = round_first_hit(flags, ray, &side, &slab, on_it);
        round.radius = -round.radius;
        round.slope = -round.slope;
        radius = -radius;
    }
    mask one = hits[0].found | hits[0].doubt, other = hits[1].found | hits[1].doubt;
    mask swaps = other & (!one | (hits[1].low < hits[0].low));
    CertainHit first = certain_select(swaps, hits[1], hits[0]),
               second = certain_select(swaps, hits[0], hits[1]);
    mask mixes = one & other & !(second.low > first.high);
    mask at_apex = lanes & left & (fabs(radius) <= error);
    first.low = lanes_select(at_apex, ray->tmin, first.low);
    first.doubt = first.doubt | (first.found & mixes) | at_apex;
    first.found = first.found & !first.doubt;
    return first;
}

static inline CertainHit round_solid_hit(const RoundSolid *solid, uint4 id, bool two_nappes, const Ray *ray)
{
    const Round *round = &solid->round;
    mask left = ray->left == (integer)((scalar_integer)id.x), lanes = RAY_ACTIVE(ray);
    real from, to;
    if (solid->is_finite) {
        lanes = lanes & round_bounds(solid->middle, solid->widest + solid->half_height + round->place0, ray,
                                     &from, &to);
        if (!lanes_any(lanes)) return certain_miss();
    } else {
        to = round_range(ray, vector_norm1(round->start) + vector_norm1(ray->origin) + solid->widest +
                                  round->power_scale);
        from = -to;
        if (two_nappes) return nappes_first_hit(*round, id.y, ray, lanes, left, from, to);
    }
    lanes = lanes & !(left & ray->leaves_outward);
    CertainInterval slab = round_unbounded();
    if (solid->is_finite) {
        slab = round_slab(round, ray, solid->low, solid->high);
        slab.outer = intervals_common(slab.outer, (Interval){from, to});
        slab.perhaps = slab.outer.near <= slab.outer.far;
        lanes = lanes & slab.perhaps;
        if (!lanes_any(lanes)) return certain_miss();
    }
    CertainInterval side = round_interval(round, ray, lanes, from, to, solid->is_finite);
    return round_first_hit(id.y, ray, &side, &slab, left);
}

static inline CertainHit cylinder_certain_hit(const Cylinder *cylinder, const Ray *ray)
{
    const RoundSolid solid = round_of_revolution(cylinder, false, ray);
    return round_solid_hit(&solid, cylinder->id, false, ray);
}

static inline CertainHit cone_certain_hit(const Cone *cone, const Ray *ray)
{
    const RoundSolid solid = round_of_revolution(cone, true, ray);
    return round_solid_hit(&solid, cone->id, true, ray);
}

static inline RoundSolid round_of_paraboloid(const Paraboloid *shape, const Ray *ray)
{
    RoundSolid solid;
    Round *round = &solid.round;
    Vector axis = vector_of(shape->axis_end), apex = vector_of(shape->apex_k);
    real inverse = real_divide((real)(1), vector_norm(axis));
    solid.is_finite = shape->id.y & REVOLUTION_FINITE;
    round->has_power = has_eye_power(shape->id);
    round->curves = true;
    round->foot = round->has_power ? vector_of(shape->foot_lift) : apex;
    round->axis = vector_scale(axis, inverse);
    round->radius = round->slope = (real)(0);
    round->k = (real)(shape->apex_k.w) * inverse;
    round->power = round->has_power ? eye_power_of(shape->id) * inverse * inverse : (real)(0);
    round->power_scale = vector_norm1(round->foot);
    round->start = round->has_power ? ray->origin : vector_subtract(ray->origin, apex);
    round->place0 = round_place0(ray, round->start, SLOPED_ROUND_ERROR);
    round->place1 = round_place1(ray, SLOPED_ROUND_ERROR);
    real lift = round->has_power ? (real)(shape->foot_lift.w) * inverse : (real)(0);
    solid.high = (real)(shape->axis_end.w) * inverse;
    solid.half_height = (real)(0.5f) * (solid.high + lift);
    solid.low = solid.high - (real)(4) * solid.half_height; // well below the apex
    solid.widest = solid.is_finite ? real_sqrt((real)(2) * solid.half_height * round->k) : round->k;
    solid.middle = vector_fma(round->axis, solid.high - solid.half_height, round->foot);
    if (!round->has_power)
        round->place0 = round->place0 + (real)(16 * UNIT_ROUNDOFF) * (solid.widest + solid.half_height);
    return solid;
}

static inline CertainHit paraboloid_certain_hit(const Paraboloid *shape, const Ray *ray)
{
    const RoundSolid solid = round_of_paraboloid(shape, ray);
    return round_solid_hit(&solid, shape->id, false, ray);
}

// The errors of a point's normal, at t, and whether it may be at the rim, where side and cap have normals of
// their own. The normal turns by 1 / rho, or by 2 / k of a paraboloid, along the surface.
static inline mask round_set_errors(const RoundSolid *solid, uint flags, const Ray *ray, real t,
                                    real place_error, SurfacePoint *point)
{
    const Round *round = &solid->round;
    const RoundPoint at = round_point(round, ray, t);
    real place = real_fma(round->place1, fabs(t), round->place0), error = (real)(2) * (place_error + place);
    real curvature = divide_or((real)(round->curves ? 2 : 1), round->curves ? round->k : at.rho,
                               (real)(1 / SMALLEST_RATIO));
    real turned = solid->is_finite ? divide_or(place, solid->half_height, (real)(1)) : (real)(0);
    point->curvature = curvature;
    point->normal_error = (real)(4) * real_fma(place, curvature, turned);
    if (!(flags & REVOLUTION_CAPPED)) return mask_none();
    real z = vector_dot(round->axis, vector_fma(ray->direction, t, round->start));
    real from_end = real_min(fabs(z - solid->low), fabs(z - solid->high));
    real side_band = error * (round->curves ? at.rho + at.rho + error + round->k
                                            : (at.rho + fabs(at.radius)) * ((real)(1) + fabs(round->slope)));
    mask near_end = from_end <= error, near_side = fabs(at.value) <= at.band + side_band;
    mask on_cap = near_end & !near_side;
    point->curvature = lanes_select(on_cap, (real)(0), point->curvature);
    point->normal_error = lanes_select(on_cap, (real)(4) * turned, point->normal_error);
    return near_end & near_side;
}

#endif

#endif
