// A torus, intersected from the ray's closest approach to the center (shapes/torus_line.h) or as seen from
// the eye.
//
// With the eye's power the zeros are those of F / (2 r), F = (rho - R)^2 + z^2 - r^2, from the eye on. For a
// point x from there, with the parts x_u along `radial`, x_v across it and x_w along the axis,
//     F = F(0) + 2 a . x + 2 A delta + (x_u + delta)^2 + x_w^2,   delta = rho - rho(0) - x_u,
// where delta = x_v^2 / (rho + rho(0) + x_u). Next to the eye, only terms that cancel exactly are large.
#ifndef TORUS_H
#define TORUS_H

#include "shapes/certain.h"
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
    TorusTube tube;
    tube.axis = vector_of(torus->axis_minor);
    tube.radial = vector_of(torus->radial);
    tube.across = vector_cross(tube.axis, tube.radial);
    tube.gradient = vector_of(torus->gradient);
    tube.radial_gradient = (real)(torus->gradient.w);
    tube.axial_gradient = vector_dot(tube.gradient, tube.axis);
    tube.eye_rho = (real)(torus->radial.w);
    tube.half_inverse_minor = real_divide((real)(0.5f), (real)(torus->axis_minor.w));
    tube.power = eye_power_of(torus->id);
    return tube;
}

// Returns F / (2 r) at a point and its gradient, whose direction is the normal.
static inline real torus_tube_value(const TorusTube *tube, Vector x, Vector *normal)
{
    real off = vector_dot(x, tube->across), z = vector_dot(x, tube->axis),
         along = vector_dot(x, tube->radial);
    real y = tube->eye_rho + along;
    real rho = real_sqrt(real_fma(y, y, off * off)), inverse_rho = real_inverse_or_zero(rho);
    mask beyond = y <= (real)(0); // beyond the axis
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
static inline real torus_tube_zero(const TorusTube *tube, const Ray *ray, real low, real high, mask entering)
{
    real t = lanes_select(low <= ray->tmin, real_max(low, ray->tmin), (real)(0.5f) * (low + high));
    for (uint i = 0; i < TORUS_ZERO_STEPS + TORUS_ZERO_STEPS; i++) {
        real slope;
        real value = torus_tube_value_at(tube, ray, t, &slope);
        mask before = (value > (real)(0)) == entering;
        low = lanes_select(before, t, low);
        high = lanes_select(before, high, t);
        // a step below the rounding may leave the bracket, whose middle is far away
        mask settled = fabs(value) <= (real)(2 * UNIT_ROUNDOFF) * fabs(slope * t);
        real next = lanes_select(settled, t, bracket_next(low, high, t, value, slope));
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
    mask rising = slope_low < (real)(0);
    for (uint i = 0; i < TORUS_ZERO_STEPS + TORUS_ZERO_STEPS; i++) {
        real rise = slope_high - slope_low, slope;
        real part = real_divide(-slope_low, lanes_select(rise == (real)(0), (real)(1), rise));
        real t = real_fma(high - low, i % 2 ? (real)(0.5f) : part, low);
        if (lanes_all((t == low) | (t == high))) break;
        torus_tube_value_at(tube, ray, t, &slope);
        mask before = (slope < (real)(0)) == rising;
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

// Finds the first zero beyond the ray's start. The breaks are in s, in parts of `unit`, in which the torus'
// size is about 1. They are off by some roundings of that, or by its root where the quartic's turning points
// meet, which may exceed the tube's radius. So two zeros may be within a break's margins, and the turning
// point between them is found by the slope.
static inline mask torus_tube_hit(const Torus *torus, const Ray *ray, mask hit,
                                  const real breaks[TORUS_BREAKS], real unit, real closest_t, real *t)
{
    const TorusTube tube = torus_tube(torus);
    mask found = mask_none();
    real slope_low, slope_high, slope;
    const real margin = (real)(IS_DOUBLE ? 0x1p-25f : 0x1p-11f);
    real low = real_max(real_fma(breaks[0], unit, closest_t), ray->tmin);
    real before = torus_tube_value_at(&tube, ray, low, &slope_low);
    for (uint i = 1; i < TORUS_TUBE_ENDS; i++) {
        real high = real_max(real_fma(torus_tube_end(breaks, i, margin), unit, closest_t), low);
        real after = torus_tube_value_at(&tube, ray, high, &slope_high);
        mask entering = before > (real)(0), turns = (slope_low < (real)(0)) != (slope_high < (real)(0));
        mask hides =
            hit & !found & turns & (entering == (after > (real)(0))) & (entering == (slope_low < (real)(0)));
        real end = high, value_at_end = after;
        if (lanes_any(hides)) {
            real turn = torus_tube_turning_point(&tube, ray, low, high, slope_low, slope_high);
            end = lanes_select(hides, turn, high);
            value_at_end = torus_tube_value_at(&tube, ray, end, &slope);
        }
        mask first = hit & !found & (entering != (value_at_end > (real)(0)));
        if (lanes_any(first)) {
            *t = lanes_select(first, torus_tube_zero(&tube, ray, low, end, entering), *t);
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
    real major = (real)(torus->center_major.w), minor = (real)(torus->axis_minor.w);
    real closest_t;
    Vector closest = torus_closest(torus, ray, &closest_t);
    real bounding_radius = major + minor;
    real squared_distance = vector_dot(closest, closest);
    real half_chord_squared =
        real_fma(bounding_radius * (real)(TORUS_ENLARGEMENT), bounding_radius, -squared_distance);
    mask hit = RAY_ACTIVE(ray) & (half_chord_squared >= (real)(0));
    if (!lanes_any(hit)) return hit;

    Vector axis = vector_of(torus->axis_minor);
    real inverse_length = real_sqrt(ray->inverse_squared);
    Vector direction = vector_scale(ray->direction, inverse_length);
    real unit = (real)(1); // a power of two, in whose parts nothing overflows
    if (has_eye_power(torus->id)) {
        unit = real_inverse_power_of_two(bounding_radius);
        closest = vector_scale(closest, unit);
        squared_distance *= unit * unit;
        half_chord_squared *= unit * unit;
        major *= unit;
        minor *= unit;
    }
    TorusLine line = {vector_cross(closest, axis),
                      vector_cross(direction, axis),
                      vector_dot(closest, axis),
                      vector_dot(direction, axis),
                      major,
                      minor};
    real breaks[TORUS_BREAKS];
    torus_breaks(&line, squared_distance, real_sqrt(real_max(half_chord_squared, (real)(0))), breaks);

    if (has_eye_power(torus->id))
        return torus_tube_hit(torus, ray, hit, breaks, real_divide(inverse_length, unit), closest_t, t);

    real start = (ray->tmin - closest_t) * real_sqrt(ray->squared); // the ray's start as s
    real slope, found_s = (real)(LARGEST);
    real before = torus_distance(&line, breaks[0], &slope);
    mask found = mask_none();
    for (uint i = 0; i + 1 < TORUS_BREAKS; i++) {
        real after = torus_distance(&line, breaks[i + 1], &slope);
        mask entering = before > (real)(0);
        mask crosses = hit & !found & (entering != (after > (real)(0))) & (breaks[i + 1] > start);
        if (lanes_any(crosses)) {
            real s = torus_zero(&line, breaks[i], breaks[i + 1], entering);
            mask first = crosses & (real_fma(s, inverse_length, closest_t) > ray->tmin);
            found_s = lanes_select(first, s, found_s);
            found = found | first;
        }
        before = after;
    }
    *t = lanes_select(found, real_fma(found_s, inverse_length, closest_t), *t);
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
    if (has_eye_power(torus->id)) {
        const TorusTube tube = torus_tube(torus);
        torus_tube_value(&tube, ray_point(ray, t), &normal);
        normal = vector_normalize(normal);
    }
    SurfacePoint point = surface_point_make(position, normal, size);
    if (has_eye_power(torus->id)) surface_point_move_to_ray(&point, ray, t, size);
    return point;
}

// A torus prepared for hits with bounds. The quartic's derivative separates intervals where the distance to
// the tube has at most one zero. The distances at their ends and around the zero, beyond all errors, decide
// what is certain.
typedef struct {
    Vector start, axis; // the ray's origin, seen from the center
    real major, minor;
    real start_rounding, rounding_per_t; // bound roundings at t: start_rounding + rounding_per_t |t|
} CertainTorus;

typedef struct {
    real distance, slope, rho;
    real rounding, place; // bounds of its error: of roundings alone, and with the ray's error
} TorusPoint;

static inline CertainTorus certain_torus(const Torus *torus, const Ray *ray)
{
    CertainTorus certain;
    certain.start = vector_subtract(ray->origin, vector_of(torus->center_major));
    certain.axis = vector_of(torus->axis_minor);
    certain.major = (real)(torus->center_major.w);
    certain.minor = (real)(torus->axis_minor.w);
    certain.start_rounding = (real)(UNIT_ROUNDOFF) * ((real)(3) * vector_norm1(certain.start) +
                                                      (real)(2) * vector_norm1(ray->origin) +
                                                      (real)(28) * (certain.major + certain.minor));
    certain.rounding_per_t = (real)(3 * UNIT_ROUNDOFF) * vector_norm1(ray->direction);
    return certain;
}

static inline TorusPoint torus_point(const CertainTorus *torus, const Ray *ray, real t)
{
    TorusPoint point;
    Vector x = vector_fma(ray->direction, t, torus->start);
    real z = vector_dot(torus->axis, x), rise = vector_dot(torus->axis, ray->direction);
    Vector across = vector_fma(torus->axis, -z, x);
    point.rho = vector_norm(across);
    real off = point.rho - torus->major, from_circle = real_sqrt(real_fma(off, off, z * z));
    real rho_slope = vector_dot(across, ray->direction) * real_inverse_or_zero(point.rho);
    point.slope = real_fma(off, rho_slope, z * rise) * real_inverse_or_zero(from_circle);
    point.distance = from_circle - torus->minor;
    point.rounding = real_fma(torus->rounding_per_t, fabs(t), torus->start_rounding);
    point.place = point.rounding + ray_place_error(ray, ray->length * fabs(t));
    return point;
}

// Returns a bound on how fast the normal turns along the surface.
static inline real torus_curvature(const CertainTorus *torus, real rho)
{
    real least = real_min(rho, torus->minor);
    mask flat = least > (real)(SMALLEST_RATIO);
    return lanes_select(flat, real_divide((real)(2), lanes_select(flat, least, (real)(1))),
                        (real)(1 / SMALLEST_RATIO));
}

// Returns the t before which a ray that starts on the torus cannot return to it, or 0 if that is unknown.
// Within half of the smaller radius the distance bends by no more than 2 over that.
static inline real torus_departure(const CertainTorus *torus, const Ray *ray)
{
    TorusPoint start = torus_point(torus, ray, (real)(0));
    real curvature = torus_curvature(torus, start.rho), cosine = fabs(start.slope) * ray_inverse_length(ray);
    real error =
        real_fma((real)(2) * start.place, curvature, ray->direction_error) + (real)(32 * UNIT_ROUNDOFF);
    real least = real_divide((real)(2), curvature);
    mask known = cosine > (real)(4) * error; // the exact one is more than the half that is used
    return lanes_select(known, (real)(0.5f) * cosine * least * ray_inverse_length(ray), (real)(0));
}

// Returns the crossing in a bracket at whose ends the exact ray is certainly on different sides. The bracket
// is narrowed. Only signs beyond `place` count, and the constants only choose the points. The sign is
// certain beyond `place` over the slope, and a quarter more allows for a rough zero and for the curvature.
static inline CertainHit torus_crossing(const CertainTorus *torus, const Ray *ray, Interval bracket,
                                        mask crosses, mask entering)
{
    real low = bracket.near, high = bracket.far, t = (real)(0.5f) * (low + high);
    TorusPoint point;
    for (uint i = 0; i < TORUS_ZERO_STEPS; i++) {
        point = torus_point(torus, ray, t);
        mask before = (point.distance > (real)(0)) == entering, certain = fabs(point.distance) > point.place;
        bracket.near = lanes_select(before & certain, real_max(bracket.near, t), bracket.near);
        bracket.far = lanes_select(certain & !before, real_min(bracket.far, t), bracket.far);
        low = lanes_select(before, t, low);
        high = lanes_select(before, high, t);
        real next = bracket_next(low, high, t, point.distance, point.slope);
        mask settled = fabs(next - t) * fabs(point.slope) <= (real)(0.0625f) * point.place;
        next = lanes_select(settled, t, next);
        if (lanes_all(next == t)) break;
        t = next;
    }
    mask steep = fabs(point.slope) * ray_inverse_length(ray) > (real)(0x1p-10f);
    real width = real_divide((real)(1.25f) * point.place, lanes_select(steep, fabs(point.slope), (real)(1)));
    const real sides[2] = {t - width, t + width};
    for (uint i = 0; i < 2; i++) {
        TorusPoint side = torus_point(torus, ray, sides[i]);
        mask certain =
            steep & (fabs(side.distance) > side.place) & (sides[i] > bracket.near) & (sides[i] < bracket.far);
        mask before = (side.distance > (real)(0)) == entering;
        bracket.near = lanes_select(certain & before, sides[i], bracket.near);
        bracket.far = lanes_select(certain & !before, sides[i], bracket.far);
    }
    return certain_at(certain_crossing(ray, crosses, crosses, bracket.near, bracket.far), t);
}

static inline CertainHit torus_certain_hit(const Torus *torus, const Ray *ray)
{
    const CertainTorus certain = certain_torus(torus, ray);
    const real radius = certain.major + certain.minor;
    CertainSphere bounding = certain_sphere(vector_of(torus->center_major),
                                            radius * (real)(1 + 64 * UNIT_ROUNDOFF), ray, RAY_ACTIVE(ray));
    if (!lanes_any(bounding.perhaps)) return certain_miss();
    real from = sphere_near(&bounding, ray) - bounding.t_error,
         to = sphere_far(&bounding, ray) + bounding.t_error;
    mask lanes = bounding.perhaps & (to >= ray->tmin);
    if (!lanes_any(lanes)) return certain_miss();

    Vector closest = vector_fma(ray->direction, bounding.middle_t, certain.start);
    real inverse_length = real_sqrt(ray->inverse_squared);
    Vector direction = vector_scale(ray->direction, inverse_length);
    real squared_distance = vector_dot(closest, closest);
    real half_chord_squared = real_fma(radius * (real)(TORUS_ENLARGEMENT), radius, -squared_distance);
    TorusLine line = {vector_cross(closest, certain.axis),
                      vector_cross(direction, certain.axis),
                      vector_dot(closest, certain.axis),
                      vector_dot(direction, certain.axis),
                      certain.major,
                      certain.minor};
    real breaks[TORUS_BREAKS];
    torus_breaks(&line, squared_distance, real_sqrt(real_max(half_chord_squared, (real)(0))), breaks);

    mask leaves = ray->origin_object == (integer)((scalar_integer)torus->id.x);
    real start = real_max(from, ray->tmin), departure = torus_departure(&certain, ray);
    start = lanes_select(leaves, departure, start);
    TorusPoint point = torus_point(&certain, ray, start);
    // a break is a turning point within rounding; its distance moves by less than this part of the rounding
    const real margin = real_fma(radius, real_divide((real)(0.125f), certain.minor), (real)(2));
    mask outside = lanes_select(leaves, ray->leaves_outward, point.distance > (real)(0));
    mask known = fabs(point.distance) > point.place;
    known = lanes_select(leaves, known & (departure > (real)(0)) & (outside == (point.distance > (real)(0))),
                         known);
    mask enters = !leaves & (from > ray->tmin);
    outside = outside | enters;
    known = known | enters;

    CertainHit hit = certain_miss();
    real before = start;
    mask open = lanes;
    for (uint i = 1; i < TORUS_BREAKS; i++) {
        bool is_last = i + 1 == TORUS_BREAKS;
        real after = is_last ? to : real_min(real_fma(breaks[i], inverse_length, bounding.middle_t), to);
        after = real_max(after, before);
        point = torus_point(&certain, ray, after);
        mask after_outside = point.distance > (real)(0),
             after_known = fabs(point.distance) > margin * point.place;
        if (is_last) after_outside = after_known = mask_all();
        mask same_place = after == before; // before the start
        after_outside = lanes_select(same_place, outside, after_outside);
        after_known = lanes_select(same_place, known, after_known);
        mask uncertain = open & !(known & after_known),
             crosses = open & !uncertain & (outside != after_outside);
        if (lanes_any(crosses)) {
            CertainHit crossing = torus_crossing(&certain, ray, (Interval){before, after}, crosses, outside);
            hit = certain_select(crosses, crossing, hit);
        }
        CertainHit perhaps = certain_crossing(ray, mask_none(), uncertain, before, to);
        hit = certain_select(uncertain, perhaps, hit);
        open = open & !uncertain & !crosses;
        if (!lanes_any(open)) break;
        before = after;
        outside = after_outside;
        known = after_known;
    }
    return hit;
}

static inline mask torus_set_errors(const Torus *torus, const Ray *ray, real t, real place_error,
                                    SurfacePoint *point)
{
    const CertainTorus certain = certain_torus(torus, ray);
    const TorusPoint at = torus_point(&certain, ray, t);
    point->curvature = torus_curvature(&certain, at.rho);
    point->normal_error = (real)(4) * at.rounding * point->curvature;
    return mask_none();
}

#endif
