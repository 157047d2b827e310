// Torus: the points at distance `minor` from a circle of radius `major`.
//
// Everything happens around the ray's closest approach to the center, where the quartic has no cubic term and
// no large numbers: in s, the length along the ray from there, it is
//     s^4 + p s^2 + q s + constant,   p = 2 k - 4 R^2 (1 - n^2),   q = 8 R^2 z n,
// for z and n the closest point's and the direction's parts along the axis and k = |closest|^2 + R^2 - r^2.
// The quartic's derivative only separates the intervals where the quartic is monotonic: in each the distance
// to the surface, whose sign is the quartic's, has at most one zero. There the distance itself,
//     sqrt((rho - R)^2 + z^2) - r,
// which is exact to a few u where the quartic cancels, is solved for its one zero. All by + - * / sqrt and
// bracketing, so that axis-parallel and equatorial rays need no case of their own.
//
// With the eye's power the zeros are those of F / (2 r), F = (rho - R)^2 + z^2 - r^2, from the eye on: for a
// point x from there, with the parts x_u along `radial`, x_v across it and x_w along the axis,
//     F = F(0) + 2 a . x + 2 A delta + (x_u + delta)^2 + x_w^2,   delta = rho - rho(0) - x_u,
// where delta = x_v^2 / (rho + rho(0) + x_u). Nothing is large next to the eye but what cancels exactly.
#ifndef TORUS_H
#define TORUS_H

#include "shapes/eye_power.h"
#include "shapes/surface_point.h"

// The line s -> closest + s direction, |direction| = 1, in the torus' frame.
typedef struct {
    Vector closest_cross_axis, direction_cross_axis; // the first plus s times the second has the length rho
    real height, rise;                               // z = height + s rise
    real major, minor;
} TorusLine;

// The signed distance to the tube's surface, negative inside, and its derivative along the line.
static inline real torus_distance(const TorusLine *line, real s, real *slope)
{
    Vector radial = vector_fma(line->direction_cross_axis, s, line->closest_cross_axis);
    real rho = vector_norm(radial);
    real z = real_fma(line->rise, s, line->height);
    real radial_offset = rho - line->major;
    real from_circle = real_sqrt(real_fma(radial_offset, radial_offset, z * z));
    real rho_slope = vector_dot(radial, line->direction_cross_axis) * real_inverse_or_zero(rho);
    *slope = real_fma(radial_offset, rho_slope, z * line->rise) * real_inverse_or_zero(from_circle);
    return from_circle - line->minor;
}

// The quartic's derivative, 4 s^3 + 2 p s + q.
static inline real torus_cubic(real p, real q, real s, real *slope)
{
    *slope = real_fma((real)(12) * s, s, p + p);
    return real_fma(real_fma((real)(4) * s, s, p + p), s, q);
}

// The next iterate within a bracket: Newton's step if it lies inside, else the middle.
static inline real bracket_next(real low, real high, real s, real value, real slope)
{
    mask usable = quotient_is_bounded(value, slope);
    real newton = s - real_divide(value, lanes_select(usable, slope, (real)(1)));
    mask inside = usable & (newton > low) & (newton < high);
    return lanes_select(inside, newton, (real)(0.5f) * (low + high));
}

// Steps enough to find all bits where Newton's method fails and the bracket is halved. Turning points need
// fewer: they only have to separate the distance's zeros.
enum { TORUS_ZERO_STEPS = IS_DOUBLE ? 60 : 30, TORUS_TURNING_STEPS = IS_DOUBLE ? 40 : 20 };

// The bounding sphere's squared radius is taken this much larger: the ends of the line in it lie outside the
// torus whatever is rounded.
#define TORUS_ENLARGEMENT 1.001f

// The cubic's zero between low and high if its signs differ there; else the end where it is nearer to 0.
static inline real torus_turning_point(real p, real q, real low, real high)
{
    real slope;
    real at_low = torus_cubic(p, q, low, &slope), at_high = torus_cubic(p, q, high, &slope);
    mask crosses = (at_low < (real)(0)) != (at_high < (real)(0));
    mask rising = at_low < (real)(0);
    real end = lanes_select(fabs(at_low) < fabs(at_high), low, high);
    real s = (real)(0.5f) * (low + high);
    for (uint i = 0; i < TORUS_TURNING_STEPS; i++) {
        real value = torus_cubic(p, q, s, &slope);
        mask before = (value < (real)(0)) == rising;
        low = lanes_select(before, s, low);
        high = lanes_select(before, high, s);
        s = bracket_next(low, high, s, value, slope);
    }
    return lanes_select(crosses, s, end);
}

// The zero of the distance in a bracket where its signs differ.
static inline real torus_zero(const TorusLine *line, real low, real high, mask entering)
{
    real s = (real)(0.5f) * (low + high);
    for (uint i = 0; i < TORUS_ZERO_STEPS; i++) {
        real slope;
        real value = torus_distance(line, s, &slope);
        mask before = (value > (real)(0)) == entering;
        low = lanes_select(before, s, low);
        high = lanes_select(before, high, s);
        real next = bracket_next(low, high, s, value, slope);
        if (lanes_all(next == s)) break;
        s = next;
    }
    return s;
}

// The ray's closest point to the center, relative to the center, and its t.
static inline Vector torus_closest(const Torus *torus, const Ray *ray, real *closest_t)
{
    Vector center = vector_of(torus->center_major);
    if (IS_COMPENSATED) {
        PairVector f = pair_vector_difference(ray->origin, center);
        Vector moment = pair_vector_high(pair_vector_cross(f, ray->direction));
        Pair squared = pair_vector_dot(pair_vector_of(ray->direction), pair_vector_of(ray->direction));
        *closest_t = -real_divide(pair_vector_dot_vector(f, ray->direction).high, squared.high);
        return vector_scale(vector_cross(ray->direction, moment), ray->inverse_squared);
    }
    Vector f = vector_subtract(ray->origin, center);
    *closest_t = -vector_dot(f, ray->direction) * ray->inverse_squared;
    return vector_scale(vector_cross(ray->direction, vector_cross(f, ray->direction)), ray->inverse_squared);
}

// The ends of the line in the bounding sphere, and in between the zeros of the quartic's derivative: between
// neighbors the distance has at most one zero. The derivative's turning points, +-sqrt(-p / 6), separate its
// zeros.
enum { TORUS_BREAKS = 5 };

static inline void torus_breaks(const TorusLine *line, real squared_distance, real span,
                                real breaks[TORUS_BREAKS])
{
    real k = real_fma(line->major, line->major, squared_distance) - line->minor * line->minor;
    real squared_major = line->major * line->major;
    real p = real_fma((real)(-4) * squared_major,
                      vector_dot(line->direction_cross_axis, line->direction_cross_axis), k + k);
    real q = (real)(8) * squared_major * line->height * line->rise;
    real bend = real_min(real_sqrt(real_max(-p * (real)(1.0f / 6), (real)(0))), span);
    breaks[0] = -span;
    breaks[1] = torus_turning_point(p, q, -span, -bend);
    breaks[2] = torus_turning_point(p, q, -bend, bend);
    breaks[3] = torus_turning_point(p, q, bend, span);
    breaks[4] = span;
}

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

// F / (2 r) at a point and its gradient, by which it is also the normal.
static inline real torus_tube_value(const TorusTube *tube, Vector x, Vector *normal)
{
    real off = vector_dot(x, tube->across), z = vector_dot(x, tube->axis),
         along = vector_dot(x, tube->radial);
    real y = tube->eye_rho + along;
    real rho = real_sqrt(real_fma(y, y, off * off)), inverse_rho = real_inverse_or_zero(rho);
    mask beyond = y <= (real)(0); // of the axis
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

// As torus_zero, along the ray. The first guess is its start, where that is in the bracket: next to it the
// bracket's middle is far away.
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

// Where the slope is 0 in a bracket where its signs differ, by false position and halving in turn.
static inline real torus_tube_turning_point(const TorusTube *tube, const Ray *ray, real low, real high,
                                            real slope_low, real slope_high)
{
    mask rising = slope_low < (real)(0);
    for (uint i = 0; i < TORUS_ZERO_STEPS; i++) {
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
    return low;
}

// The first zero beyond the ray's start; the breaks are in s, in parts of `unit`.
static inline mask torus_tube_hit(const Torus *torus, const Ray *ray, mask hit,
                                  const real breaks[TORUS_BREAKS], real unit, real closest_t, real *t)
{
    const TorusTube tube = torus_tube(torus);
    mask found = mask_none();
    real slope_low, slope_high, slope;
    real low = real_max(real_fma(breaks[0], unit, closest_t), ray->tmin);
    real before = torus_tube_value_at(&tube, ray, low, &slope_low);
    for (uint i = 0; i + 1 < TORUS_BREAKS; i++) {
        real high = real_max(real_fma(breaks[i + 1], unit, closest_t), ray->tmin);
        real after = torus_tube_value_at(&tube, ray, high, &slope_high);
        mask entering = before > (real)(0), turns = (slope_low < (real)(0)) != (slope_high < (real)(0));
        // a break is off by some roundings of the torus' size: two zeros next to it may be on one side
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
    real unit = (real)(1); // a power of two below which nothing overflows
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

    real start = (ray->tmin - closest_t) * real_sqrt(ray->squared); // of the ray, as s
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
    if (!IS_FAST && has_eye_power(torus->id)) surface_point_move_to_ray(&point, ray, t, size);
    return point;
}

#endif
