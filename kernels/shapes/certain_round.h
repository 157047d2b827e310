// Finds bounded hits on surfaces of revolution. The side bounds a convex set, so the exact ray is within it
// along one interval of t. Roots are computed approximately. Points next to them are then evaluated, and only
// the conclusions that their values prove beyond all errors count. The constants of steps and widths only
// choose the points.
#ifndef CERTAIN_ROUND_H
#define CERTAIN_ROUND_H

#include "shapes/certain.h"
#include "shapes/eye_power.h"
#include "shapes/quadratic.h"
#include "shapes/surface_point.h"

// The inside is rho <= radius + slope z, or rho^2 <= k z if k > 0, for the distance rho from the axis and the
// height z along it.
typedef struct {
    Vector start; // the ray's origin, seen from the base or, with a power, from the eye
    Vector foot;  // a point of the axis, seen from the same point
    Vector axis;  // unit
    real radius, slope, k;
    real power;                                    // with HAS_POWER, that for the unit axis
    real foot_norm1, start_norm1, direction_norm1; // 1-norms, the last of the ray's direction
    real shape_error;              // bounds how far roundings of the shape and the start move a point
    real units;                    // the error from the axis and the products, in u of a point's 1-norm
    real start_error, error_per_t; // a point at t is off by no more than start_error + error_per_t |t|
    bool has_power, curves;        // curves means k > 0
} Round;

typedef struct {
    real rounding, position_error; // bounds of its error: of roundings alone, and with the ray's error
    real value, band;              // outside if value > band, inside if value < -band
    Vector across;                 // from the axis to the point
    real rho, radius;
} RoundPoint;

static inline Vector round_across(const Round *round, Vector v)
{
    return vector_fma(round->axis, -vector_dot(round->axis, v), v);
}

// Returns rho^2 less the radius squared, or less k z, at x and the height z. It is computed from the eye's
// power, so that it does not cancel next to the eye.
static inline Bounded round_value_from_eye(const Round *round, Vector x, real z)
{
    const real rise = round->slope * z, twice = round->radius + round->radius, size = vector_norm1(x),
               lift = round->curves ? round->k * z : rise * (twice + rise),
               terms = real_fma(size, size + round->foot_norm1 + round->foot_norm1,
                                fabs(lift) + fabs(rise) * fabs(twice) + 2 * fabs(round->power));
    const Vector beyond = vector_fma(round->foot, (real)(-2), x);
    return (Bounded){round->power + (vector_dot(round_across(round, x), round_across(round, beyond)) - lift),
                     16 * UNIT_ROUNDOFF * terms};
}

static inline RoundPoint round_point(const Round *round, const Ray *ray, real t)
{
    RoundPoint point;
    Vector x = vector_fma(ray->direction, t, round->start);
    // rounding the sum moves x in proportion to its terms, the axis and the products in proportion to x
    real terms = real_fma(round->direction_norm1, fabs(t), round->start_norm1);
    real in_u = real_min(round->units * terms, real_fma((real)(3), terms, round->units * vector_norm1(x)));
    point.rounding = real_fma((real)(UNIT_ROUNDOFF), in_u, round->shape_error);
    real position_error = point.position_error =
        point.rounding + ray_position_error(ray, ray->length * fabs(t));
    real z = vector_dot(round->axis, x);
    point.across = round_across(round, round->has_power ? vector_subtract(x, round->foot) : x);
    point.rho = vector_norm(point.across);
    point.radius = real_fma(round->slope, z, round->radius);
    // the axis' length is off by 14.5 u, so that 29 u of z remain in the vector across it
    const real left_of_z = 32 * UNIT_ROUNDOFF * z;
    real band = left_of_z * left_of_z;
    Bounded from_eye = {(real)(0), (real)(0)};
    if (round->has_power) {
        from_eye = round_value_from_eye(round, x, z);
        band = band + from_eye.error;
    }
    if (round->curves) {
        point.value = round->has_power ? from_eye.value : real_fma(point.rho, point.rho, -(round->k * z));
        point.band = real_fma(position_error, point.rho + point.rho + position_error + round->k, band);
        return point;
    }
    real sum = point.rho + fabs(point.radius);
    point.value = (point.rho - point.radius) * sum;
    if (round->has_power) point.value = lanes_select(point.radius < 0, point.value, from_eye.value);
    point.band = real_fma(position_error * BOUND_SLACK, real_fma(fabs(round->slope), sum, sum), band);
    return point;
}

// The quadratic a t^2 + 2 b t + c = 0, whose roots are where the ray crosses the side.
typedef struct {
    Vector m, q; // the ray's origin and direction across the axis
    real rise;   // the direction along it
    real h;      // growth of the radius per t
    real a, b, c, discriminant;
} RoundQuadratic;

static inline RoundQuadratic round_quadratic(const Round *round, const Ray *ray)
{
    const RoundPoint start = round_point(round, ray, (real)(0));
    Vector m = start.across, q = round_across(round, ray->direction);
    real rise = vector_dot(round->axis, ray->direction), z = vector_dot(round->axis, round->start);
    real mq = vector_dot(m, q), qq = vector_dot(q, q), h = round->slope * rise;
    real half_k = 0.5f * round->k, bend = half_k * rise;
    const real a = real_fma(-h, h, qq), b = round->curves ? mq - bend : real_fma(-start.radius, h, mq);
    RoundQuadratic quadratic = {m, q, rise, h, a, b, start.value};
    if (!round->has_power && !round->curves)
        quadratic.c = (start.rho - fabs(start.radius)) * (start.rho + fabs(start.radius));
    if (round->has_power) {
        quadratic.discriminant = difference_of_products(b, b, a, quadratic.c);
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

// Returns whether a height above a plane, which is linear and given at t, stays above 0 in a part of the
// line, and beyond except in the lanes `ends`.
static inline mask height_is_positive(real height, real slope, real slope_error, real t, Interval part,
                                      mask ends)
{
    real at_from = height - real_max(slope + slope_error, (real)(0)) * (t - part.near);
    real at_to = height + (slope - slope_error) * (part.far - t);
    return (height > 0) & (at_from > 0) & ((slope >= slope_error) | (ends & (at_to > 0)));
}

// A plane between an unbounded ray and the side is tilted by this many errors of the ray's direction: one to
// face away from the ray, one for its own error, and slack.
#define ROUND_TILT_ERRORS ((real)(2.5f))

// Returns whether the exact ray misses the side in a part of the line, which starts at 0 or later, and beyond
// except in the lanes `ends`. At t1, about its closest approach, a plane separates it from the side, or from
// a parallel surface. Tilted slightly, the plane does so for unbounded rays: rho is at least n . x for n =
// (across / rho + s q / |q|) / (1 + |s|), and rho^2 at least 2 a . x - a . a for any a.
static inline mask round_misses(const Round *round, const RoundQuadratic *quadratic, const Ray *ray,
                                Interval part, mask ends)
{
    const real zero = (real)(0), one = (real)(1);
    real qq = vector_dot(quadratic->q, quadratic->q), q_length = real_sqrt(qq), t1;
    real rise_error = real_fma(round->error_per_t, fabs(round->slope), round->error_per_t);
    real h = real_fma(ROUND_TILT_ERRORS, rise_error, quadratic->h);
    mask tilts = fabs(h) < q_length;
    if (round->curves) {
        t1 = divide_or(-quadratic->b, qq, zero);
    } else {
        real t0 = divide_or(-vector_dot(quadratic->m, quadratic->q), qq, zero);
        real rho = vector_norm(vector_fma(quadratic->q, t0, quadratic->m));
        real steepness = real_sqrt(real_max((q_length - h) * (q_length + h), zero));
        real end = lanes_select(h > zero, part.far, part.near);
        t1 = lanes_select(tilts, t0 + divide_or(h * rho, q_length * steepness, zero), end);
    }
    t1 = interval_clamp(part, t1);
    RoundPoint point = round_point(round, ray, t1);
    real along = vector_dot(point.across, quadratic->q), along_unit = divide_or(along, q_length, zero);
    real height = point.value - point.band, slope, slope_error, tilted, tilted_slope;
    if (round->curves) {
        slope = real_fma(-round->k, quadratic->rise, along + along);
        slope_error = round->error_per_t * (point.rho + point.rho + round->k);
        tilted_slope = ROUND_TILT_ERRORS * slope_error;
        real tilt = divide_or(0.5f * (tilted_slope - slope), q_length, zero);
        tilted = real_fma(-tilt, tilt, height);
        tilts = q_length > zero;
    } else {
        height = divide_or(height, point.rho + fabs(point.radius), zero);
        slope_error = rise_error;
        real share = divide_or(along_unit, point.rho, zero), wanted = divide_or(h, q_length, zero);
        real difference = wanted - share;
        real room = lanes_select(difference > zero, one - wanted, one + wanted);
        real tilt = divide_or(difference, room, zero);
        tilted_slope = h - quadratic->h;
        // This is not height - rho + n . x, because at a planet's radius the rounding of rho exceeds the
        // height. `along_unit` is off by 17 u rho, rho by 9 u, the sum and the quotient add up to 15 u.
        real tilted_rho = fabs(tilt) * point.rho * (1 + 64 * UNIT_ROUNDOFF);
        tilted = height + divide_or(real_fma(tilt, along_unit, -tilted_rho), one + fabs(tilt), zero);
        slope = real_fma(share, q_length, -quadratic->h);
    }
    return height_is_positive(height, slope, slope_error, t1, part, ends) |
           (tilts & height_is_positive(tilted, tilted_slope, slope_error, t1, part, ends));
}

// The choice of points next to a root: how much larger the root is than a step that may refine it, and the
// distance in bands, where an eighth allows for a wider band and a rough root.
#define ROOT_OVER_STEP  ((real)(0x1p6f))
#define ROOT_SIDE_BANDS ((real)(1.125f))

// Returns the interval where the exact ray is inside the side. Roots are searched in a part of the line,
// beyond which nothing matters if `is_finite`. `perhaps` applies to t >= tmin.
static inline CertainInterval round_interval(const Round *round, const Ray *ray, mask lanes, Interval part,
                                             bool is_finite)
{
    CertainInterval interval;
    interval.outer = interval.inner = interval.roots = (Interval){(real)(-LARGEST), (real)(LARGEST)};
    interval.certain = mask_none();
    const RoundQuadratic quadratic = round_quadratic(round, ray);
    real end = ray_end_above(ray);
    mask ends = is_finite ? mask_all() : end < part.far;
    const Interval ahead = {real_max(part.near, ray->tmin), real_max(real_min(part.far, end), ray->tmin)};
    interval.perhaps = lanes & !round_misses(round, &quadratic, ray, ahead, ends);
    if (!lanes_any(interval.perhaps)) return interval;

    const real a = quadratic.a;
    const Interval crossed = quadratic_inside(
        quadratic_roots(a, quadratic.b, quadratic.c, quadratic.discriminant), a, quadratic.h);
    real roots[2] = {crossed.near, crossed.far};
    real before[2], after[2];
    for (uint i = 0; i < 2; i++) {
        real t = interval_clamp(part, roots[i]);
        RoundPoint point = round_point(round, ray, t);
        real slope = real_fma(a, t, quadratic.b); // half the slope
        real step = divide_or(0.5f * point.value, slope, (real)(0));
        // otherwise it was not a root; from an end, where it is clamped, a step would lead beyond the end
        mask settles = (t == roots[i]) & (fabs(step) * ROOT_OVER_STEP < fabs(t));
        roots[i] = t = lanes_select(settles, t - step, t);
        // the sign is certain one band away
        real band = ROOT_SIDE_BANDS * point.band, bend = fabs(a) * band;
        real steepness = real_max(fabs(slope), 0.5f * real_sqrt(bend));
        real width =
            divide_or(band, steepness + real_sqrt(real_max(real_fma(steepness, steepness, -bend), (real)(0))),
                      (real)(0));
        before[i] = t - width;
        after[i] = t + width;
    }
    interval.roots = (Interval){roots[0], roots[1]};
    const real enter_out = real_max(before[0], part.near), enter_in = real_min(after[0], part.far),
               leave_in = real_max(before[1], part.near), leave_out = real_min(after[1], part.far);
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

// Returns the part of the line beyond which a rounding of the distance exceeds a 1024th of the size, so that
// nothing is certain.
static inline Interval round_range(const Ray *ray, real size)
{
    const real range = 0x1p-10f / UNIT_ROUNDOFF * size * ray_inverse_length(ray);
    return (Interval){-range, range};
}

// Returns a round shape of radius 0, seen from the eye if it has the eye's power and else from the foot. Its
// unit axis is `inverse` times `axis`. Its errors remain to be set.
static inline Round round_around(uint4 id, Vector foot, Vector axis, real inverse, const Ray *ray)
{
    const bool has_power = has_eye_power(id);
    return (Round){.start = has_power ? ray->origin : vector_subtract(ray->origin, foot),
                   .foot = foot,
                   .axis = vector_scale(axis, inverse),
                   .power = has_power ? eye_power_of(id) * inverse * inverse : (real)(0),
                   .foot_norm1 = vector_norm1(foot),
                   .has_power = has_power};
}

// The error in u of the coordinates that the axis' direction and the products add. If the radius depends on
// the height, the axis' length adds to it.
enum { ROUND_ERROR = 8, SLOPED_ROUND_ERROR = 20 };

// Bounds the errors of points. `shape_error` bounds those of the shape's numbers, and `units` is ROUND_ERROR
// or SLOPED_ROUND_ERROR. The start must be set.
static inline void round_set_position_errors(Round *round, const Ray *ray, real shape_error, uint units)
{
    round->shape_error = real_fma((real)(2 * UNIT_ROUNDOFF), vector_norm1(ray->origin), shape_error);
    round->units = (real)(units);
    round->start_norm1 = vector_norm1(round->start);
    round->direction_norm1 = vector_norm1(ray->direction);
    const real rounding = (real)(units * UNIT_ROUNDOFF);
    round->start_error = real_fma(rounding, round->start_norm1, ray->origin_error + round->shape_error);
    round->error_per_t = real_fma(ray->length, ray->direction_error, rounding * round->direction_norm1);
}

#endif
