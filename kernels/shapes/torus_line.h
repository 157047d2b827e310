// Intersects a line with a torus, the points at distance `minor` from a circle of radius `major`.
//
// Everything is computed around the ray's closest approach to the center, where the quartic has no cubic term
// and no large numbers. In s, the length along the ray from there, it is
//     s^4 + p s^2 + q s + constant,   p = 2 k - 4 R^2 (1 - n^2),   q = 8 R^2 z n,
// for z and n the closest point's and the direction's parts along the axis and k = |closest|^2 + R^2 - r^2.
// The quartic's derivative only separates the intervals where the quartic is monotonic. In each the distance
// to the surface, whose sign is the quartic's, has at most one zero. There the distance itself,
//     sqrt((rho - R)^2 + z^2) - r,
// which is exact to a few u where the quartic cancels, is solved for its one zero. Everything uses + - * /
// sqrt and bracketing, so that axis-parallel and equatorial rays need no special cases.
#ifndef TORUS_LINE_H
#define TORUS_LINE_H

#include "shapes/interval.h"
#include "traversal/ray.h"

// The line s -> closest + s direction, |direction| = 1, in the torus' frame.
typedef struct {
    Vector closest_cross_axis, direction_cross_axis; // the first plus s times the second has the length rho
    real height, rise;                               // z = height + s rise
    real squared_distance;                           // |closest|^2
    real major, minor;
    real closest_t, t_per_s; // t = closest_t + s t_per_s
} TorusLine;

static inline real torus_line_t(const TorusLine *line, real s)
{
    return real_fma(s, line->t_per_s, line->closest_t);
}

// Returns the squared half chord of the bounding sphere, whose squared radius is enlarged so that the ends of
// the line in it lie outside the torus however numbers are rounded.
static inline real torus_half_chord_squared(real major, real minor, real squared_distance)
{
    const real radius = major + minor;
    return real_fma(radius * 1.001f, radius, -squared_distance);
}

// Returns the ray's line, whose closest point to the center is given relative to that. All its lengths are
// multiplied by `unit`, a power of two, so that nothing overflows.
static inline TorusLine torus_line(const Torus *torus, const Ray *ray, Vector closest, real closest_t,
                                   real unit)
{
    const Vector axis = vector_of(torus->axis_minor);
    const real inverse_length = real_sqrt(ray->inverse_squared);
    const Vector direction = vector_scale(ray->direction, inverse_length);
    closest = vector_scale(closest, unit);
    return (TorusLine){vector_cross(closest, axis),
                       vector_cross(direction, axis),
                       vector_dot(closest, axis),
                       vector_dot(direction, axis),
                       vector_dot(closest, closest),
                       (real)(torus->center_major.w) * unit,
                       (real)(torus->axis_minor.w) * unit,
                       closest_t,
                       inverse_length * real_inverse_power_of_two(unit)};
}

// The signed distance to the tube's surface, negative inside, its derivative along a line, and the distance
// from the axis.
typedef struct {
    real value, slope, rho;
} TorusDistance;

// Returns the distance of a point with the part `radial` across the axis and z along it. `direction` and
// `rise` are those parts of the line's direction.
static inline TorusDistance torus_distance(Vector radial, Vector direction, real z, real rise, real major,
                                           real minor)
{
    TorusDistance distance;
    distance.rho = vector_norm(radial);
    real off = distance.rho - major, from_circle = real_sqrt(real_fma(off, off, z * z));
    real rho_slope = vector_dot(radial, direction) * real_inverse_or_zero(distance.rho);
    distance.slope = real_fma(off, rho_slope, z * rise) * real_inverse_or_zero(from_circle);
    distance.value = from_circle - minor;
    return distance;
}

static inline TorusDistance torus_line_distance(const TorusLine *line, real s)
{
    return torus_distance(vector_fma(line->direction_cross_axis, s, line->closest_cross_axis),
                          line->direction_cross_axis, real_fma(line->rise, s, line->height), line->rise,
                          line->major, line->minor);
}

// Returns the quartic's derivative, 4 s^3 + 2 p s + q.
static inline real torus_cubic(real p, real q, real s, real *slope)
{
    *slope = real_fma(12 * s, s, p + p);
    return real_fma(real_fma(4 * s, s, p + p), s, q);
}

// Narrows a bracket to a side of s: the far one in the lanes where s lies `before` the zero. Returns the next
// iterate: Newton's step if it lies inside, else the middle.
static inline real bracket_narrow(Interval *bracket, mask before, real s, real value, real slope)
{
    real_replace(&bracket->near, before, s);
    bracket->far = lanes_select(before, bracket->far, s);
    mask usable = quotient_is_bounded(value, slope);
    real newton = s - real_divide(value, lanes_select(usable, slope, (real)(1)));
    mask inside = usable & (newton > bracket->near) & (newton < bracket->far);
    return lanes_select(inside, newton, interval_middle(*bracket));
}

// There are enough steps to find all bits if Newton's method fails and the bracket is halved. Turning points
// need fewer, since they only have to separate the distance's zeros.
enum { TORUS_ZERO_STEPS = IS_DOUBLE ? 60 : 30, TORUS_TURNING_STEPS = IS_DOUBLE ? 40 : 20 };

// Returns the cubic's zero between low and high if its signs differ there, else the end where it is nearer to
// 0.
static inline real torus_turning_point(real p, real q, real low, real high)
{
    real slope;
    real at_low = torus_cubic(p, q, low, &slope), at_high = torus_cubic(p, q, high, &slope);
    mask crosses = (at_low < 0) != (at_high < 0);
    mask rising = at_low < 0;
    real end = lanes_select(fabs(at_low) < fabs(at_high), low, high);
    Interval bracket = {low, high};
    real s = interval_middle(bracket);
    for (uint i = 0; i < TORUS_TURNING_STEPS; i++) {
        real value = torus_cubic(p, q, s, &slope);
        s = bracket_narrow(&bracket, (value < 0) == rising, s, value, slope);
    }
    return lanes_select(crosses, s, end);
}

// Returns the zero of the distance in a bracket where its signs differ.
static inline real torus_zero(const TorusLine *line, Interval bracket, mask entering)
{
    real s = interval_middle(bracket);
    for (uint i = 0; i < TORUS_ZERO_STEPS; i++) {
        const TorusDistance distance = torus_line_distance(line, s);
        mask before = (distance.value > 0) == entering;
        real next = bracket_narrow(&bracket, before, s, distance.value, distance.slope);
        if (lanes_all(next == s)) break;
        s = next;
    }
    return s;
}

// Returns the ray's closest point to the center, relative to the center, and its t.
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

// Finds the ends of the line in the bounding sphere and, in between, the zeros of the quartic's derivative.
// Between neighbors the distance has at most one zero. The derivative's turning points, +-sqrt(-p / 6),
// separate its zeros.
enum { TORUS_BREAKS = 5 };

static inline void torus_breaks(const TorusLine *line, real breaks[TORUS_BREAKS])
{
    const real half_chord_squared =
        torus_half_chord_squared(line->major, line->minor, line->squared_distance);
    const real span = real_sqrt(real_max(half_chord_squared, (real)(0)));
    real k = real_fma(line->major, line->major, line->squared_distance) - line->minor * line->minor;
    real squared_major = line->major * line->major;
    real p = real_fma(-4 * squared_major, vector_dot(line->direction_cross_axis, line->direction_cross_axis),
                      k + k);
    real q = 8 * squared_major * line->height * line->rise;
    real bend = real_min(real_sqrt(real_max(-p * (1.0f / 6), (real)(0))), span);
    breaks[0] = -span;
    breaks[1] = torus_turning_point(p, q, -span, -bend);
    breaks[2] = torus_turning_point(p, q, -bend, bend);
    breaks[3] = torus_turning_point(p, q, bend, span);
    breaks[4] = span;
}

#endif
