// Finds hits with proven bounds, for images at `certified`. Each shape is intersected with the exact ray,
// which the packet's ray only approximates, and as the exact shape, whose numbers were rounded.
// docs/numerics.md derives every bound. Constants leave slack beyond what it needs.
//
// The exact ray's point at t, or its line's point before it starts, lies within origin_error +
// direction_error |d| t of the packet's. So a shape is certainly hit if the packet's ray hits it shrunk by
// all errors, and certainly missed if the ray misses it enlarged by them. In between, the answer is
// uncertain.
#ifndef CERTAIN_H
#define CERTAIN_H

#include "shapes/interval.h"
#include "traversal/ray.h"

// A number and a bound on its error, which only `certified` sets.
typedef struct {
    real value, error;
} Bounded;

// A divisor must exceed its error by this factor. The exact divisor is then at least 7/8 of the computed one,
// and 8/7 is below DIVISOR_SLACK.
#define DIVISOR_MIN   ((real)(8))
#define DIVISOR_SLACK ((real)(1.2f))

// Returns a / b, with an error of NEVER where b is too uncertain to divide by.
static inline Bounded bounded_quotient(Bounded a, Bounded b)
{
    const mask usable = fabs(b.value) > DIVISOR_MIN * b.error;
    const real inverse = real_divide((real)(1), lanes_select(usable, b.value, (real)(1)));
    const real quotient = a.value * inverse;
    const real error = DIVISOR_SLACK * real_fma(fabs(quotient), b.error, a.error) * fabs(inverse) +
                       (real)(8 * UNIT_ROUNDOFF) * fabs(quotient);
    return (Bounded){quotient, lanes_select(usable, error, NEVER)};
}

// The answer of a lane: a hit, where the exact ray's t is between low and high and near t; a miss; or
// uncertain, where a hit, if any, is not before low.
typedef struct {
    mask found, uncertain;
    real t, low, high;
} CertainHit;

// Returns a bound on the distance of the exact ray from the packet's, up to a distance along it.
static inline real ray_place_error(const Ray *ray, real distance)
{
    return real_fma(ray->direction_error, distance, ray->origin_error);
}

// Returns the lanes whose ray starts on the object with this id.
static inline mask ray_starts_on(const Ray *ray, uint id)
{
    return ray->origin_object == (integer)((scalar_integer)id);
}

// Returns the lanes whose ray starts on this shape and does not hit it again, because it is flat, or convex
// and left outward.
static inline mask ray_cannot_rehit(const Ray *ray, uint id, bool is_flat)
{
    return is_flat ? ray_starts_on(ray, id) : ray_starts_on(ray, id) & ray->leaves_outward;
}

// Returns a t that is not before the exact ray's end. For a ray to a light that is t = 1, and its tmax is 32
// u less.
static inline real ray_end_above(const Ray *ray)
{
    return ray->tmax * (real)(1 + 64 * UNIT_ROUNDOFF);
}

// Returns the lanes whose crossing between low and high lies before the ray's start or beyond its end.
static inline mask ray_excludes(const Ray *ray, real low, real high)
{
    return (low > ray_end_above(ray)) | (high < ray->tmin);
}

// Classifies a crossing by the ray's start and end. The line certainly crosses in the lanes `certain`, and
// may cross only in the lanes `perhaps`, between low and high.
static inline CertainHit certain_crossing(const Ray *ray, mask certain, mask perhaps, real low, real high)
{
    CertainHit hit;
    const mask excluded = ray_excludes(ray, low, high);
    low = lanes_select(low == low, low, (real)(-LARGEST)); // beyond the range of numbers, it may be anywhere
    perhaps = perhaps & !excluded;
    hit.found = certain & perhaps & (low > -ray->tmin) & (high < ray->tmax);
    hit.uncertain = perhaps & !hit.found;
    hit.t = (real)(0.5f) * (low + high);
    hit.low = low;
    hit.high = high;
    return hit;
}

// Moves a hit to t, which may be far from the middle of its bounds, unless t is outside them.
static inline CertainHit certain_at(CertainHit hit, real t)
{
    real_replace(&hit.t, (t >= hit.low) & (t <= hit.high), t);
    return hit;
}

static inline CertainHit certain_select(mask condition, CertainHit yes, CertainHit no)
{
    return (CertainHit){lanes_select(condition, yes.found, no.found),
                        lanes_select(condition, yes.uncertain, no.uncertain),
                        lanes_select(condition, yes.t, no.t), lanes_select(condition, yes.low, no.low),
                        lanes_select(condition, yes.high, no.high)};
}

static inline CertainHit certain_miss(void)
{
    return (CertainHit){mask_none(), mask_none(), (real)(0), (real)(0), (real)(0)};
}

// The interval of t in which the exact ray is inside a convex set. If `certain`, it contains `inner`. If
// `perhaps`, it lies within `outer`. Its ends are close to those of `roots`, unless these are NEVER.
typedef struct {
    Interval outer, inner, roots;
    mask certain, perhaps;
} CertainInterval;

// Returns where the ray enters the set or, if it starts inside or on its surface in the lanes `leaves`, where
// it leaves it.
static inline CertainHit certain_interval_hit(const CertainInterval *inside, const Ray *ray, mask leaves)
{
    const mask certain = inside->certain, perhaps = inside->perhaps;
    real near_high = lanes_select(certain, inside->inner.near, NEVER),
         far_low = lanes_select(certain, inside->inner.far, ray->tmin);
    CertainHit near = certain_crossing(ray, certain, perhaps, inside->outer.near, near_high),
               far = certain_crossing(ray, certain, perhaps, far_low, inside->outer.far);
    return certain_select(leaves | (near_high < ray->tmin), certain_at(far, inside->roots.far),
                          certain_at(near, inside->roots.near));
}

static inline CertainHit certain_restrict(CertainHit hit, mask lanes)
{
    hit.found = hit.found & lanes;
    hit.uncertain = hit.uncertain & lanes;
    return hit;
}

// A sphere crossed by a line. With l the line's closest point to the center, r^2 - l^2 is half the chord
// squared.
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

// A place that moves by p moves the crossing by p over the cosine there, the least half chord over r. With
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

static inline CertainSphere certain_sphere(Vector center, real radius, const Ray *ray, mask lanes)
{
    CertainSphere crossed;
    Vector f = vector_subtract(ray->origin, center);
    crossed.start = f;
    crossed.radius = radius;
    crossed.middle_t = -vector_dot(f, ray->direction) * ray->inverse_squared;
    Vector l = vector_fma(ray->direction, crossed.middle_t, f);
    real squared = real_fma(radius, radius, -vector_dot(l, l));
    // not less than |f| if |l| is up to twice the radius; beyond, errors in proportion to |l| do not count
    real distance = real_fma(fabs(crossed.middle_t), ray->length, radius + radius);
    real rounding = (real)(UNIT_ROUNDOFF)*real_fma((real)(3), distance,
                                                   real_fma((real)(6), radius, vector_norm1(ray->origin)));
    // neither crossings nor the closest point are farther than this and the place
    real farthest = distance - radius;
    real place = ray_place_error(ray, farthest) * BOUND_SLACK + rounding;
    place = real_fma(ray->direction_error, place, place);
    real along = (real)(16 * UNIT_ROUNDOFF) * distance; // error of the closest point along the ray
    real band = real_fma(place * (real)(1 + 8 * UNIT_ROUNDOFF), radius + radius + place, along * along);
    // excluded if all of it lies behind the start or beyond the end
    const real inverse_length = ray_inverse_length(ray);
    real reach = inverse_length * (radius + (real)(2) * (place + along));
    mask apart = ray_excludes(ray, crossed.middle_t - reach, crossed.middle_t + reach);
    crossed.certain = lanes & (squared > band);
    crossed.perhaps = lanes & !((squared < -band) | apart);
    crossed.half_chord = crossed.inverse_slope = crossed.middle_error = crossed.t_error = (real)(0);
    crossed.refines = mask_none();
    if (!lanes_any(crossed.perhaps)) return crossed;
    // In t. If it is uncertain, this is the half chord of the band, between 0 and that of twice the band.
    crossed.half_chord = real_sqrt(real_max(squared, band) * ray->inverse_squared);
    mask usable = crossed.half_chord > (real)(0);
    real inverse = real_divide((real)(1), lanes_select(usable, crossed.half_chord, (real)(1)));
    crossed.inverse_slope = (real)(0.5f) * ray->inverse_squared * inverse;
    real inverse_chord = inverse * inverse_length;
    real x = band * (inverse_chord * inverse_chord);
    real steepness = real_fma(SPHERE_STEEPENING * inverse_chord, x, inverse_chord);
    const real few_squares = (real)(4 * UNIT_ROUNDOFF) * (radius * radius);
    real moved = real_fma(real_fma(SPHERE_HALF_BAND, band, real_fma(place, place, few_squares)), steepness,
                          SPHERE_ALONG * x * place);
    crossed.middle_error = inverse_length * (place + along);
    crossed.refines = SPHERE_REFINING * along * steepness < (real)(1);
    real computed = lanes_select(crossed.refines, SPHERE_REFINED_ERROR * distance, along + along);
    crossed.t_error = inverse_length * (moved + computed);
    return crossed;
}

// The part of a line within the bounding sphere of a finite shape, in the lanes where it is not empty or
// behind the ray's start.
typedef struct {
    mask lanes;
    Interval part;
    real middle_t; // the closest point to the center
} BoundedLine;

static inline BoundedLine line_within_bounds(Vector center, real radius, const Ray *ray)
{
    const CertainSphere bounding =
        certain_sphere(center, radius * (real)(1 + 64 * UNIT_ROUNDOFF), ray, RAY_ACTIVE(ray));
    BoundedLine line = {bounding.perhaps, {(real)(0), (real)(0)}, bounding.middle_t};
    if (!lanes_any(line.lanes)) return line;
    line.part = (Interval){sphere_near(&bounding, ray) - bounding.t_error,
                           sphere_far(&bounding, ray) + bounding.t_error};
    line.lanes = line.lanes & (line.part.far >= ray->tmin);
    return line;
}

#endif
