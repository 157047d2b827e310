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

#include "numerics/vector.h"
#include "traversal/ray.h"

// The line s -> closest + s direction, |direction| = 1, in the torus' frame.
typedef struct {
    Vector closest_cross_axis, direction_cross_axis; // the first plus s times the second has the length rho
    real height, rise;                               // z = height + s rise
    real major, minor;
} TorusLine;

// Returns the signed distance to the tube's surface, negative inside, and its derivative along the line.
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

// Returns the quartic's derivative, 4 s^3 + 2 p s + q.
static inline real torus_cubic(real p, real q, real s, real *slope)
{
    *slope = real_fma((real)(12) * s, s, p + p);
    return real_fma(real_fma((real)(4) * s, s, p + p), s, q);
}

// Returns the next iterate within a bracket: Newton's step if it lies inside, else the middle.
static inline real bracket_next(real low, real high, real s, real value, real slope)
{
    mask usable = quotient_is_bounded(value, slope);
    real newton = s - real_divide(value, lanes_select(usable, slope, (real)(1)));
    mask inside = usable & (newton > low) & (newton < high);
    return lanes_select(inside, newton, (real)(0.5f) * (low + high));
}

// There are enough steps to find all bits if Newton's method fails and the bracket is halved. Turning points
// need fewer, since they only have to separate the distance's zeros.
enum { TORUS_ZERO_STEPS = IS_DOUBLE ? 60 : 30, TORUS_TURNING_STEPS = IS_DOUBLE ? 40 : 20 };

// The bounding sphere's squared radius is enlarged by this factor, so that the ends of the line in it lie
// outside the torus however numbers are rounded.
#define TORUS_ENLARGEMENT 1.001f

// Returns the cubic's zero between low and high if its signs differ there, else the end where it is nearer to
// 0.
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

// Returns the zero of the distance in a bracket where its signs differ.
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

#endif
