// Intersects shapes around an axis that have ends: cylinder, cone and paraboloid.
#ifndef ENDS_H
#define ENDS_H

#include "shapes/interval.h"
#include "traversal/ray.h"

// Returns the lanes whose line from + t d stays farther than the reach from the axis w through 0, by 2% if
// error_per_t is 0, although its points may be off by error_per_t |t|.
//
// With q = d x w the line's distance is |from . q| / |q| at the closest point, where |t| is at most
// |from| |w| / |q|. If error_per_t is at most an eighth of |q| / |w|, points farther along the line lose less
// than they gain, up to a factor of 1.016 for the squares. Roundings change the sides by less than
// 15 u (|from| + reach) |d| |w|.
//
// The constants follow from (a + b)^2 <= (1 + m) a^2 + (1 + 1 / m) b^2. With m = 1/64, 29,300 of the 2^15 are
// needed. Where there is an error_per_t, m is 0.045 and 47 of the 2^7 are needed.
static inline mask line_is_off_axis(Vector from, real squared_reach, Vector axis, real squared_axis,
                                    real error_per_t, const Ray *ray)
{
    const Vector q = vector_cross(ray->direction, axis);
    const real moment = vector_dot(from, q), squared_q = vector_dot(q, q),
               squared_error = error_per_t * error_per_t;
    const real slack =
        (vector_dot(from, from) + squared_reach) * squared_axis *
        real_fma((real)(0x1p7f), squared_error, 0x1p15f * UNIT_ROUNDOFF * UNIT_ROUNDOFF * ray->squared);
    return (moment * moment > real_fma((1 + 0x1p-4f) * squared_reach, squared_q, slack + SMALLEST_RATIO)) &
           (0x1p6f * squared_error * squared_axis <= squared_q);
}

// Returns the lanes whose line from + t d certainly stays off the double cone of a slope k around the unit
// axis w through its apex 0.
//
// The plane through the line and the apex has the normal n = from x d. It stays off the cone if the sine of
// its angle to the axis, |n . w| / |n|, exceeds the sine of the cone's angle, k / sqrt(1 + k^2).
//
// The line's points are off by start_error + error_per_t |t|, where error_per_t |d| is at least 16 u |d|^2
// for roundings. They are at least |n| / |d| from the apex, so the error is at most
// (start_error |d| + 2 error_per_t |from|) / |n| of their distance. The difference of both sines must exceed
// it, since the sine of the difference of both angles is at least that.
//
// By (a + b)^2 <= (1 + 1/16) a^2 + 17 b^2 and twice the squares of b's two terms, each square counts 34
// times.
static inline mask line_is_off_cone(Vector from, real slope, Vector axis, real start_error, real error_per_t,
                                    const Ray *ray)
{
    const Vector n = vector_cross(from, ray->direction);
    const real along = vector_dot(n, axis), squared_slope = slope * slope, squared_secant = 1 + squared_slope,
               spread = 3 * error_per_t * vector_norm1(from),
               squared_error = real_fma(spread, spread, start_error * start_error * ray->squared);
    return squared_secant * (along * along - 34 * squared_error) >
           real_fma((1 + 0x1p-4f) * squared_slope, vector_dot(n, n), (real)(SMALLEST_RATIO));
}

// The intervals of t that decide where a ray hits the side and the caps.
typedef struct {
    Interval side;   // inside the side; between the nappes of an unbounded cone, outside it
    Interval slab;   // between the ends
    mask real_roots; // the line crosses the side or is inside it everywhere
} EndedCrossings;

// Finds the first hit on a surface of revolution. A capped solid is the intersection of both intervals. One
// comparison decides both, so that no ray passes between side and cap. An open or unbounded one is hit at a
// root between the ends.
static inline mask ends_first_hit(uint flags, const Ray *ray, const EndedCrossings *crossings, real *t)
{
    const Interval side = crossings->side, slab = crossings->slab;
    if (flags & REVOLUTION_CAPPED) {
        const Interval solid = intervals_common(side, slab);
        *t = ray_first(ray, solid.near, solid.far);
        return crossings->real_roots & (solid.near <= solid.far);
    }
    mask seen = flags & IGNORES_FRONT_FACES ? mask_none() : mask_all();
    mask near_valid = seen & (side.near > ray->tmin) & (side.near >= slab.near) & (side.near <= slab.far);
    *t = lanes_select(near_valid, side.near, side.far);
    return crossings->real_roots & (*t >= slab.near) & (*t <= slab.far);
}

// Returns whether the hit at t is on a cap, which is so if the cap's crossing is nearer to t than the
// side's. At the rim it is on the side.
static inline mask ends_on_cap(const EndedCrossings *crossings, real t)
{
    return interval_end_distance(crossings->slab, t) < interval_end_distance(crossings->side, t);
}

#endif
