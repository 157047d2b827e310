// Intersects shapes around an axis that have ends: cylinder, cone and paraboloid.
#ifndef ENDS_H
#define ENDS_H

#include "shapes/interval.h"
#include "traversal/ray.h"

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
