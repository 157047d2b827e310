// Intersects tori, from the ray's closest approach to the center (shapes/torus_line.h) or as seen from the
// eye.
//
// With the eye's power the zeros are those of F / (2 r), F = (rho - R)^2 + z^2 - r^2, from the eye on. For a
// point x from there, with the parts x_u along `radial`, x_v across it and x_w along the axis,
//     F = F(0) + 2 a . x + 2 A delta + (x_u + delta)^2 + x_w^2,   delta = rho - rho(0) - x_u,
// where delta = x_v^2 / (rho + rho(0) + x_u). Next to the eye, only terms that cancel exactly are large.
#ifndef TORUS_H
#define TORUS_H

#include "shapes/certain_sphere.h"
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
        mask first = hit & !found & (entering != (value_at_end > 0));
        if (lanes_any(first)) {
            real_replace(t, first, torus_tube_zero(&tube, ray, (Interval){low, end}, entering));
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
    TorusDistance distance;
    real rounding, position_error; // bounds of its error: of roundings alone, and with the ray's error
    mask outside, known;           // known: the exact ray's point is on the same side
} TorusPoint;

static inline CertainTorus certain_torus(const Torus *torus, const Ray *ray)
{
    const Vector start = vector_subtract(ray->origin, vector_of(torus->center_major));
    const real major = (real)(torus->center_major.w), minor = (real)(torus->axis_minor.w),
               per_t = 3 * UNIT_ROUNDOFF * vector_norm1(ray->direction),
               at_start = UNIT_ROUNDOFF *
                          (3 * vector_norm1(start) + 2 * vector_norm1(ray->origin) + 28 * (major + minor));
    return (CertainTorus){start, vector_of(torus->axis_minor), major, minor, at_start, per_t};
}

static inline TorusPoint torus_point(const CertainTorus *torus, const Ray *ray, real t)
{
    TorusPoint point;
    Vector x = vector_fma(ray->direction, t, torus->start);
    real z = vector_dot(torus->axis, x), rise = vector_dot(torus->axis, ray->direction);
    point.distance =
        torus_distance(vector_fma(torus->axis, -z, x), ray->direction, z, rise, torus->major, torus->minor);
    point.rounding = real_fma(torus->rounding_per_t, fabs(t), torus->start_rounding);
    point.position_error = point.rounding + ray_position_error(ray, ray->length * fabs(t));
    point.outside = point.distance.value > 0;
    point.known = fabs(point.distance.value) > point.position_error;
    return point;
}

// Returns a bound on how fast the normal turns along the surface.
static inline real torus_curvature(const CertainTorus *torus, real rho)
{
    return divide_or((real)(2), real_min(rho, torus->minor), (real)(2 / SMALLEST_RATIO));
}

// Returns the t before which a ray that starts on the torus cannot return to it, or 0 if that is unknown.
// Within half of the smaller radius the distance bends by no more than 2 over that.
static inline real torus_departure(const CertainTorus *torus, const Ray *ray)
{
    TorusPoint start = torus_point(torus, ray, (real)(0));
    real curvature = torus_curvature(torus, start.distance.rho),
         cosine = fabs(start.distance.slope) * ray_inverse_length(ray);
    real error = real_fma(2 * start.position_error, curvature, ray->direction_error) + 32 * UNIT_ROUNDOFF;
    real least = real_divide((real)(2), curvature);
    mask known = cosine > 4 * error; // the exact one is more than the half that is used
    return lanes_select(known, 0.5f * cosine * least * ray_inverse_length(ray), (real)(0));
}

// The search of a crossing, whose constants only choose points: the part of a point's error below which a
// step ends it; the least slope per length at which points next to the zero are evaluated; and their
// distance, in errors over the slope, where a quarter allows for a rough zero and for the curvature.
#define TORUS_SETTLED     ((real)(0x1p-4f))
#define TORUS_STEEPNESS   ((real)(0x1p-10f))
#define TORUS_SIDE_ERRORS ((real)(1.25f))
// At a break, a turning point within rounding, the distance is off by BREAK_ERRORS times a point's error and
// by BREAK_BEND (R + r) / r times it, for the torus' radii.
#define BREAK_ERRORS ((real)(2))
#define BREAK_BEND   ((real)(0.125f))

// Returns the crossing in a bracket at whose ends the exact ray is certainly on different sides. The bracket
// is narrowed. Only signs beyond `position_error` count.
static inline CertainHit torus_crossing(const CertainTorus *torus, const Ray *ray, Interval bracket,
                                        mask crosses, mask entering)
{
    Interval computed = bracket; // where the packet's ray crosses
    real t = interval_middle(bracket), steepness;
    TorusPoint point;
    for (uint i = 0; i < TORUS_ZERO_STEPS; i++) {
        point = torus_point(torus, ray, t);
        steepness = fabs(point.distance.slope);
        mask before = point.outside == entering;
        real_replace(&bracket.near, point.known & before, real_max(bracket.near, t));
        real_replace(&bracket.far, point.known & !before, real_min(bracket.far, t));
        real next = bracket_narrow(&computed, before, t, point.distance.value, point.distance.slope);
        mask settled = fabs(next - t) * steepness <= TORUS_SETTLED * point.position_error;
        next = lanes_select(settled, t, next);
        if (lanes_all(next == t)) break;
        t = next;
    }
    mask steep = steepness * ray_inverse_length(ray) > TORUS_STEEPNESS;
    real width =
        real_divide(TORUS_SIDE_ERRORS * point.position_error, lanes_select(steep, steepness, (real)(1)));
    const real sides[2] = {t - width, t + width};
    for (uint i = 0; i < 2; i++) {
        TorusPoint side = torus_point(torus, ray, sides[i]);
        mask certain = steep & side.known & (sides[i] > bracket.near) & (sides[i] < bracket.far);
        mask before = side.outside == entering;
        real_replace(&bracket.near, certain & before, sides[i]);
        real_replace(&bracket.far, certain & !before, sides[i]);
    }
    return certain_at(certain_crossing(ray, crosses, crosses, bracket.near, bracket.far), t);
}

static inline CertainHit torus_certain_hit(const Torus *torus, const Ray *ray)
{
    const CertainTorus certain = certain_torus(torus, ray);
    const real radius = certain.major + certain.minor;
    const BoundedLine bounded = line_within_bounds(vector_of(torus->center_major), radius, ray);
    if (!lanes_any(bounded.lanes)) return certain_miss();

    Vector closest = vector_fma(ray->direction, bounded.middle_t, certain.start);
    const TorusLine line = torus_line(torus, ray, closest, bounded.middle_t, (real)(1));
    real breaks[TORUS_BREAKS];
    torus_breaks(&line, breaks);

    mask leaves = ray_starts_on(ray, torus->id.x);
    real departure = torus_departure(&certain, ray);
    real before = lanes_select(leaves, departure, real_max(bounded.part.near, ray->tmin));
    TorusPoint point = torus_point(&certain, ray, before);
    const real margin = real_fma(radius, real_divide(BREAK_BEND, certain.minor), BREAK_ERRORS);
    mask outside = lanes_select(leaves, ray->leaves_outward, point.outside),
         known = point.known & (!leaves | ((departure > 0) & (outside == point.outside))),
         enters = !leaves & (bounded.part.near > ray->tmin);
    outside = outside | enters;
    known = known | enters;

    CertainHit hit = certain_miss();
    mask open = bounded.lanes;
    for (uint i = 1; i < TORUS_BREAKS; i++) {
        bool is_last = i + 1 == TORUS_BREAKS;
        real after = is_last ? bounded.part.far : real_min(torus_line_t(&line, breaks[i]), bounded.part.far);
        after = real_max(after, before);
        point = torus_point(&certain, ray, after);
        mask after_outside = point.outside,
             after_known = fabs(point.distance.value) > margin * point.position_error;
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
        CertainHit perhaps = certain_crossing(ray, mask_none(), uncertain, before, bounded.part.far);
        hit = certain_select(uncertain, perhaps, hit);
        open = open & !uncertain & !crosses;
        if (!lanes_any(open)) break;
        before = after;
        outside = after_outside;
        known = after_known;
    }
    return hit;
}

static inline mask torus_set_errors(const Torus *torus, const Ray *ray, real t, real position_error,
                                    SurfacePoint *point)
{
    const CertainTorus certain = certain_torus(torus, ray);
    const TorusPoint at = torus_point(&certain, ray, t);
    point->curvature = torus_curvature(&certain, at.distance.rho);
    point->normal_error = 4 * at.rounding * point->curvature;
    return mask_none();
}

#endif
