// Finds hits with proven bounds, for images at `certified`. Each shape is intersected with the exact ray,
// which the packet's ray only approximates, and as the exact shape, whose numbers were rounded.
// docs/numerics.md states every bound. Constants leave slack beyond what it needs.
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

static inline Bounded bounded_select(mask condition, Bounded yes, Bounded no)
{
    return (Bounded){lanes_select(condition, yes.value, no.value),
                     lanes_select(condition, yes.error, no.error)};
}

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
                       8 * UNIT_ROUNDOFF * fabs(quotient);
    return (Bounded){quotient, lanes_select(usable, error, NEVER)};
}

// The answer of a lane: a hit, where the exact ray's t is between low and high and near t; a miss; or
// uncertain, where a hit, if any, is not before low.
typedef struct {
    mask found, uncertain;
    real t, low, high;
} CertainHit;

// Returns a bound on the distance of the exact ray from the packet's, up to a distance along it.
static inline real ray_position_error(const Ray *ray, real distance)
{
    return real_fma(ray->direction_error, distance, ray->origin_error);
}

// Returns the lanes whose ray starts on the object with this id. Such a ray does not hit it again if the
// object is flat, or if it is convex and the ray leaves outward.
static inline mask ray_starts_on(const Ray *ray, uint id)
{
    return ray->origin_object == integer_of(id);
}

// Returns a t that is not before the exact ray's end. For a ray to a light that is t = 1, and its tmax is 32
// u less.
static inline real ray_end_above(const Ray *ray)
{
    return ray->tmax * (1 + 64 * UNIT_ROUNDOFF);
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
    const mask excluded = ray_excludes(ray, low, high);
    low = lanes_select(low == low, low, (real)(-LARGEST)); // beyond the range of numbers, it may be anywhere
    perhaps = perhaps & !excluded;
    const mask found = certain & perhaps & (low > -ray->tmin) & (high < ray->tmax);
    return (CertainHit){found, perhaps & !found, 0.5f * (low + high), low, high};
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
// `perhaps`, it lies within `outer`. Its ends are close to those of `roots`, unless these are NEVER or
// beyond.
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

#endif
