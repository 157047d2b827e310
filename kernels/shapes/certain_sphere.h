// Finds the crossings of lines with spheres, and with the bounding spheres of shapes, with bounds
// (docs/numerics.md).
#ifndef CERTAIN_SPHERE_H
#define CERTAIN_SPHERE_H

#include "shapes/certain.h"

// A sphere crossed by a line. With l the line's closest point to the center, r^2 - l^2 is the square of half
// the chord.
typedef struct {
    Vector start; // the ray's start, seen from the center
    real radius;
    mask certain, perhaps;       // the line crosses it, not behind the ray's start or beyond its end
    real middle_t, middle_error; // the closest point
    real half_chord, t_error;    // in t; t_error applies to sphere_near and sphere_far
    mask refines;                // a Newton step is taken
    real inverse_slope;          // for that step, of |x|^2 at the far crossing, with x seen from the center
} CertainSphere;

static inline real sphere_refine(const CertainSphere *sphere, const Ray *ray, real t, real inverse_slope)
{
    Vector x = vector_fma(ray->direction, t, sphere->start);
    real excess = real_fma(sphere->radius, sphere->radius, -vector_dot(x, x));
    return lanes_select(sphere->refines, real_fma(excess, inverse_slope, t), t);
}

// Return the two crossings.
static inline real sphere_near(const CertainSphere *sphere, const Ray *ray)
{
    return sphere_refine(sphere, ray, sphere->middle_t - sphere->half_chord, -sphere->inverse_slope);
}

static inline real sphere_far(const CertainSphere *sphere, const Ray *ray)
{
    return sphere_refine(sphere, ray, sphere->middle_t + sphere->half_chord, sphere->inverse_slope);
}

// A point that moves by p moves the crossing by p over the cosine there, the least half chord over r. With
// x = band / h^2 for the half chord h, that is h sqrt(1 - x), and 1 / sqrt(1 - x) < 1 + SPHERE_STEEPENING x
// up to x = 3/4. Beyond that, h changes by at most h x (1 + x) / 2 across the ray, and p counts along it,
// where SPHERE_ALONG x exceeds 1.
#define SPHERE_STEEPENING ((real)(1.6f))
#define SPHERE_ALONG      ((real)(1.4f))
// The band counts by half, as it is about 2 r p, and a 50th more for roundings.
#define SPHERE_HALF_BAND ((real)(0.51f))
// The roundings of a crossing after a Newton step, relative to the distance.
#define SPHERE_REFINED_ERROR ((real)(2.5f * UNIT_ROUNDOFF))
// Before the step a crossing is off by no more than twice the closest point's error along the ray. The step
// squares that and divides by twice the half chord. It is taken where the half chord exceeds the closest
// point's error by this factor, so that at most a 32nd of that error remains.
#define SPHERE_REFINING ((real)(64))

// The errors of a line next to a sphere.
typedef struct {
    real distance; // bounds the start's distance from the center, where that counts
    real position; // of points of the line: of the ray, and of rounding
    real along;    // of the closest point, along the line
    real band;     // of the square of half the chord
} SphereErrors;

static inline SphereErrors sphere_errors(real radius, real middle_t, const Ray *ray)
{
    SphereErrors errors;
    // not less than |f| if |l| is up to twice the radius; beyond, errors in proportion to |l| do not count
    const real distance = errors.distance = real_fma(fabs(middle_t), ray->length, radius + radius);
    const real rounding =
        UNIT_ROUNDOFF * real_fma((real)(3), distance, real_fma((real)(6), radius, vector_norm1(ray->origin)));
    // neither crossings nor the closest point are farther than this and the error
    const real farthest = distance - radius,
               position_error = ray_position_error(ray, farthest) * BOUND_SLACK + rounding;
    errors.position = real_fma(ray->direction_error, position_error, position_error);
    errors.along = 16 * UNIT_ROUNDOFF * distance;
    errors.band = real_fma(errors.position * (1 + 8 * UNIT_ROUNDOFF), radius + radius + errors.position,
                           errors.along * errors.along);
    return errors;
}

// Sets the crossings and their bound. `squared` is the square of half the chord.
static inline void sphere_set_crossings(CertainSphere *sphere, const Ray *ray, real squared,
                                        const SphereErrors *errors)
{
    const real inverse_length = ray_inverse_length(ray), radius = sphere->radius,
               position_error = errors->position;
    // In t. If it is uncertain, this is the half chord of the band, between 0 and that of twice the band.
    sphere->half_chord = real_sqrt(real_max(squared, errors->band) * ray->inverse_squared);
    const mask usable = sphere->half_chord > 0;
    const real inverse = real_divide((real)(1), lanes_select(usable, sphere->half_chord, (real)(1)));
    sphere->inverse_slope = 0.5f * ray->inverse_squared * inverse;
    const real inverse_chord = inverse * inverse_length, x = errors->band * (inverse_chord * inverse_chord),
               steepness = real_fma(SPHERE_STEEPENING * inverse_chord, x, inverse_chord),
               few_squares = 4 * UNIT_ROUNDOFF * (radius * radius);
    const real moved = real_fma(
        real_fma(SPHERE_HALF_BAND, errors->band, real_fma(position_error, position_error, few_squares)),
        steepness, SPHERE_ALONG * x * position_error);
    sphere->refines = SPHERE_REFINING * errors->along * steepness < 1;
    const real computed =
        lanes_select(sphere->refines, SPHERE_REFINED_ERROR * errors->distance, errors->along + errors->along);
    sphere->t_error = inverse_length * (moved + computed);
    sphere->middle_error = inverse_length * (position_error + errors->along);
}

// Returns how the lines of the rays in `lanes` cross a sphere.
static inline CertainSphere certain_sphere(Vector center, real radius, const Ray *ray, mask lanes)
{
    const Vector start = vector_subtract(ray->origin, center);
    const real middle_t = -vector_dot(start, ray->direction) * ray->inverse_squared;
    const Vector closest = vector_fma(ray->direction, middle_t, start);
    const real squared = real_fma(radius, radius, -vector_dot(closest, closest));
    const SphereErrors errors = sphere_errors(radius, middle_t, ray);
    // excluded if all of it lies behind the start or beyond the end
    const real reach = ray_inverse_length(ray) * (radius + 2 * (errors.position + errors.along));
    const mask apart = ray_excludes(ray, middle_t - reach, middle_t + reach);
    CertainSphere crossed = {.start = start,
                             .radius = radius,
                             .certain = lanes & (squared > errors.band),
                             .perhaps = lanes & !((squared < -errors.band) | apart),
                             .middle_t = middle_t};
    if (lanes_any(crossed.perhaps)) sphere_set_crossings(&crossed, ray, squared, &errors);
    return crossed;
}

// The part of a line within the bounding sphere of a finite shape, in the lanes where it is not empty or
// behind the ray's start.
typedef struct {
    mask lanes;
    Interval part;
    real middle_t; // the closest point to the center
} BoundedLine;

// Returns the part of each active ray's line within a bounding sphere.
static inline BoundedLine line_within_bounds(Vector center, real radius, const Ray *ray)
{
    const CertainSphere bounding =
        certain_sphere(center, radius * (1 + 64 * UNIT_ROUNDOFF), ray, RAY_ACTIVE(ray));
    BoundedLine line = {bounding.perhaps, {(real)(0), (real)(0)}, bounding.middle_t};
    if (!lanes_any(line.lanes)) return line;
    line.part = (Interval){sphere_near(&bounding, ray) - bounding.t_error,
                           sphere_far(&bounding, ray) + bounding.t_error};
    line.lanes = line.lanes & (line.part.far >= ray->tmin);
    return line;
}

#endif
