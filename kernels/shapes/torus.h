// Intersects tori, from the ray's closest approach to the center (shapes/torus_line.h) or as seen from the
// eye.
//
// With the eye's power the zeros are those of F / (2 r), F = (rho - R)^2 + z^2 - r^2, from the eye on. For a
// point x from there, with the parts x_u along `radial`, x_v across it and x_w along the axis,
//     F = F(0) + 2 a . x + 2 A delta + (x_u + delta)^2 + x_w^2,   delta = rho - rho(0) - x_u,
// where delta = x_v^2 / (rho + rho(0) + x_u). Next to the eye, only terms that cancel exactly are large.
#ifndef TORUS_H
#define TORUS_H

#include "shapes/eye_power.h"
#include "shapes/surface_point.h"
#include "shapes/torus_line.h"

// The tube seen from the eye.
typedef struct {
    Vector axis, radial, across, gradient;
    real radial_gradient, axial_gradient, eye_rho, half_inverse_minor, power;
} TorusTube;

static inline TorusTube torus_tube(const Torus *torus)
{
    const Vector axis = vector_of(torus->axis_minor), radial = vector_of(torus->radial),
                 gradient = vector_of(torus->gradient);
    return (TorusTube){axis,
                       radial,
                       vector_cross(axis, radial),
                       gradient,
                       (real)(torus->gradient.w),
                       vector_dot(gradient, axis),
                       (real)(torus->radial.w),
                       real_divide((real)(0.5f), (real)(torus->axis_minor.w)),
                       eye_power_of(torus->id)};
}

// Returns F / (2 r) at a point and its gradient, whose direction is the normal.
static inline real torus_tube_value(const TorusTube *tube, Vector x, Vector *normal)
{
    real off = vector_dot(x, tube->across), z = vector_dot(x, tube->axis),
         along = vector_dot(x, tube->radial);
    real y = tube->eye_rho + along;
    real rho = real_sqrt(real_fma(y, y, off * off)), inverse_rho = real_inverse_or_zero(rho);
    mask beyond = y <= 0; // beyond the axis
    real sum = lanes_select(beyond, (real)(1), rho + y);
    real delta = lanes_select(beyond, rho - y, off * real_divide(off, sum));
    real change = along + delta;
    real half_inverse = tube->half_inverse_minor, inverse = half_inverse + half_inverse;
    Vector outward = vector_fma(tube->radial, y * inverse_rho, vector_scale(tube->across, off * inverse_rho));
    *normal = vector_fma(outward, real_fma(change, inverse, tube->radial_gradient),
                         vector_scale(tube->axis, real_fma(z, inverse, tube->axial_gradient)));
    real bend = real_fma(half_inverse * change, change, half_inverse * z * z);
    real rest = real_fma(tube->radial_gradient, delta, bend);
    return power_sum((Pair){tube->power, rest}, x, pair_vector_of(tube->gradient));
}

static inline real torus_tube_value_at(const TorusTube *tube, const Ray *ray, real t, real *slope)
{
    Vector normal;
    real value = torus_tube_value(tube, ray_point(ray, t), &normal);
    *slope = vector_dot(normal, ray->direction);
    return value;
}

// Returns the zero along the ray in a bracket at whose ends the signs differ. The first guess is the ray's
// start if that is in the bracket, since the bracket's middle is far from it.
static inline real torus_tube_zero(const TorusTube *tube, const Ray *ray, Interval bracket, mask entering)
{
    real t =
        lanes_select(bracket.near <= ray->tmin, real_max(bracket.near, ray->tmin), interval_middle(bracket));
    for (uint i = 0; i < TORUS_ZERO_STEPS + TORUS_ZERO_STEPS; i++) {
        real slope;
        real value = torus_tube_value_at(tube, ray, t, &slope);
        real next = bracket_narrow(&bracket, (value > 0) == entering, t, value, slope);
        // a step below the rounding may leave the bracket, whose middle is far away
        mask settled = fabs(value) <= 2 * UNIT_ROUNDOFF * fabs(slope * t);
        next = lanes_select(settled, t, next);
        if (lanes_all(next == t)) break;
        t = next;
    }
    return t;
}

// Returns the t where the slope is 0 in a bracket at whose ends its signs differ, by alternating false
// position and halving.
static inline real torus_tube_turning_point(const TorusTube *tube, const Ray *ray, real low, real high,
                                            real slope_low, real slope_high)
{
    mask rising = slope_low < 0;
    for (uint i = 0; i < TORUS_ZERO_STEPS + TORUS_ZERO_STEPS; i++) {
        real rise = slope_high - slope_low, slope;
        real part = real_divide(-slope_low, lanes_select(rise == 0, (real)(1), rise));
        real t = real_fma(high - low, i % 2 ? (real)(0.5f) : part, low);
        if (lanes_all((t == low) | (t == high))) break;
        torus_tube_value_at(tube, ray, t, &slope);
        mask before = (slope < 0) == rising;
        low = lanes_select(before, t, low);
        slope_low = lanes_select(before, slope, slope_low);
        high = lanes_select(before, high, t);
        slope_high = lanes_select(before, slope_high, slope);
    }
    return lanes_select(fabs(slope_low) < fabs(slope_high), low, high);
}

enum { TORUS_TUBE_ENDS = 2 * TORUS_BREAKS - 2 };

// Returns end number `i` of the intervals in which zeros are searched: the ends of the line, and the breaks
// in between less and plus `margin`.
static inline real torus_tube_end(const real breaks[TORUS_BREAKS], uint i, real margin)
{
    real end = breaks[(i + 1) >> 1];
    return i == 0 || i == TORUS_TUBE_ENDS - 1 ? end : i % 2 ? end - margin : end + margin;
}

// Finds the first zero beyond the ray's start. The breaks are in s, in which the torus' size is about 1. They
// are off by some roundings of that, or by its root where the quartic's turning points meet, which may exceed
// the tube's radius. So two zeros may be within a break's margins, and the turning point between them is
// found by the slope.
static inline mask torus_tube_hit(const Torus *torus, const Ray *ray, mask hit, const TorusLine *line,
                                  const real breaks[TORUS_BREAKS], real *t)
{
    const TorusTube tube = torus_tube(torus);
    mask found = mask_none();
    real slope_low, slope_high, slope;
    const real margin = (real)(IS_DOUBLE ? 0x1p-25f : 0x1p-11f);
    real low = real_max(torus_line_t(line, breaks[0]), ray->tmin);
    real before = torus_tube_value_at(&tube, ray, low, &slope_low);
    for (uint i = 1; i < TORUS_TUBE_ENDS; i++) {
        real high = real_max(torus_line_t(line, torus_tube_end(breaks, i, margin)), low);
        real after = torus_tube_value_at(&tube, ray, high, &slope_high);
        mask entering = before > 0, turns = (slope_low < 0) != (slope_high < 0);
        mask hides = hit & !found & turns & (entering == (after > 0)) & (entering == (slope_low < 0));
        real end = high, value_at_end = after;
        if (lanes_any(hides)) {
            real turn = torus_tube_turning_point(&tube, ray, low, high, slope_low, slope_high);
            end = lanes_select(hides, turn, high);
            value_at_end = torus_tube_value_at(&tube, ray, end, &slope);
        }
        mask crosses = hit & !found & (entering != (value_at_end > 0));
        if (lanes_any(crosses)) {
            real zero = torus_tube_zero(&tube, ray, (Interval){low, end}, entering);
            mask first = crosses & (zero > ray->tmin); // the ray may start on the surface
            real_replace(t, first, zero);
            found = found | first;
        }
        low = high;
        before = after;
        slope_low = slope_high;
    }
    return found;
}

static inline mask torus_hit(const Torus *torus, const Ray *ray, real *t)
{
    const real major = (real)(torus->center_major.w), minor = (real)(torus->axis_minor.w);
    real closest_t;
    Vector closest = torus_closest(torus, ray, &closest_t);
    mask hit = RAY_ACTIVE(ray) & (torus_half_chord_squared(major, minor, vector_dot(closest, closest)) >= 0);
    if (!lanes_any(hit)) return hit;

    const bool has_power = has_eye_power(torus->id);
    const real unit = has_power ? real_inverse_power_of_two(major + minor) : (real)(1);
    const TorusLine line = torus_line(torus, ray, closest, closest_t, unit);
    real breaks[TORUS_BREAKS];
    torus_breaks(&line, breaks);
    if (has_power) return torus_tube_hit(torus, ray, hit, &line, breaks, t);

    real start = (ray->tmin - closest_t) * real_sqrt(ray->squared); // the ray's start as s
    real found_s = (real)(LARGEST), before = torus_line_distance(&line, breaks[0]).value;
    mask found = mask_none();
    for (uint i = 0; i + 1 < TORUS_BREAKS; i++) {
        real after = torus_line_distance(&line, breaks[i + 1]).value;
        mask entering = before > 0;
        mask crosses = hit & !found & (entering != (after > 0)) & (breaks[i + 1] > start);
        if (lanes_any(crosses)) {
            real s = torus_zero(&line, (Interval){breaks[i], breaks[i + 1]}, entering);
            mask first = crosses & (torus_line_t(&line, s) > ray->tmin);
            found_s = lanes_select(first, s, found_s);
            found = found | first;
        }
        before = after;
    }
    real_replace(t, found, torus_line_t(&line, found_s));
    return found;
}

static inline SurfacePoint torus_surface_point(const Torus *torus, const Ray *ray, real t)
{
    Vector center = vector_of(torus->center_major), axis = vector_of(torus->axis_minor);
    real major = (real)(torus->center_major.w), minor = (real)(torus->axis_minor.w);
    Vector p = ray_point_from(ray, center, t);
    real z = vector_dot(p, axis);
    Vector radial = vector_normalize(vector_fma(axis, -z, p));
    Vector from_circle = vector_fma(radial, -major, p); // from the nearest point of the circle
    Vector normal = vector_normalize(from_circle);
    Vector position = vector_fma(normal, minor, vector_fma(radial, major, center));
    const real size = major + minor + vector_norm1(center);
    const bool has_power = has_eye_power(torus->id);
    if (has_power) {
        const TorusTube tube = torus_tube(torus);
        torus_tube_value(&tube, ray_point(ray, t), &normal);
        normal = vector_normalize(normal);
    }
    SurfacePoint point = surface_point_make(position, normal, size);
    if (has_power) surface_point_move_to_ray(&point, ray, t, size);
    return point;
}

#endif
