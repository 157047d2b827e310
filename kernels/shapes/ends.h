// Intersects shapes around an axis that have ends: cylinder, cone and paraboloid.
#ifndef ENDS_H
#define ENDS_H

#include "shapes/interval.h"
#include "traversal/ray.h"

// Returns the lanes whose line from + t d stays at least 2% farther than `reach` from the axis w through 0.
// With q = d x w it is |from . q| > reach |q|. Roundings change the two sides by less than 15 u (|from| +
// reach) |d| |w|, and (a + b)^2 <= (1 + 2^-6) a^2 + (1 + 2^6) b^2.
static inline mask line_is_off_axis(Vector from, real reach, Vector axis, real squared_axis, const Ray *ray)
{
    const Vector q = vector_cross(ray->direction, axis);
    const real moment = vector_dot(from, q), squared_reach = reach * reach;
    const real slack = (real)(0x1p15f * UNIT_ROUNDOFF * UNIT_ROUNDOFF) *
                       ((vector_dot(from, from) + squared_reach) * ray->squared * squared_axis);
    return moment * moment >
           real_fma((real)(1 + 0x1p-4f) * squared_reach, vector_dot(q, q), slack + (real)(SMALLEST_RATIO));
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
