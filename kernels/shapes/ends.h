// Intersects shapes around an axis that have ends: cylinder, cone and paraboloid.
#ifndef ENDS_H
#define ENDS_H

#include "shapes/interval.h"
#include "traversal/ray.h"

// Returns the lanes whose line from + t d stays at least 2% farther than `reach` from the axis w through 0,
// even if its points are off by error_per_t |t|. With q = d x w its distance at the closest point is |from .
// q| / |q|, and |t| there at most |from| |w| / |q|. If error_per_t is below an eighth of |q| / |w|, points
// farther along the line lose less by it than 1% of that distance and their own gain. Roundings change the
// sides by less than 15 u (|from| + reach) |d| |w|, and (a + b)^2 <= (1 + 2^-6) a^2 + (1 + 2^6) b^2.
static inline mask line_is_off_axis(Vector from, real reach, Vector axis, real squared_axis, real error_per_t,
                                    const Ray *ray)
{
    const Vector q = vector_cross(ray->direction, axis);
    const real moment = vector_dot(from, q), squared_q = vector_dot(q, q), squared_reach = reach * reach,
               squared_error = error_per_t * error_per_t;
    const real slack = (vector_dot(from, from) + squared_reach) * squared_axis *
                       real_fma((real)(0x1p7f), squared_error,
                                (real)(0x1p15f * UNIT_ROUNDOFF * UNIT_ROUNDOFF) * ray->squared);
    return (moment * moment >
            real_fma((real)(1 + 0x1p-4f) * squared_reach, squared_q, slack + (real)(SMALLEST_RATIO))) &
           ((real)(0x1p6f) * squared_error * squared_axis <= squared_q);
}

// Returns the lanes whose line from + t d stays clearly off the double cone of a slope k around the unit axis
// w through its apex 0. The plane through line and apex, with the normal n = from x d, then does, since |n .
// w| / |n|, the sine of its angle to the axis, exceeds the cone's, k / sqrt(1 + k^2), by more than the errors
// of points over their distances from the apex, |n| / |d| or more. A point at t is off by start_error +
// error_per_t |t|. `size` bounds |from| and its rounding; error_per_t counts roundings of at least 16 u |d|.
static inline mask line_is_off_cone(Vector from, real size, real slope, Vector axis, real start_error,
                                    real error_per_t, const Ray *ray)
{
    const Vector n = vector_cross(from, ray->direction);
    const real along = vector_dot(n, axis), squared_slope = slope * slope,
               squared_secant = (real)(1) + squared_slope, spread = (real)(3) * error_per_t * size,
               squared_error = real_fma(spread, spread, start_error * start_error * ray->squared);
    return squared_secant * (along * along - (real)(34) * squared_error) >
           real_fma((real)(1 + 0x1p-4f) * squared_slope, vector_dot(n, n), (real)(SMALLEST_RATIO));
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
