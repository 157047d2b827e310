// Intersects shapes around an axis that have ends: cylinder, cone and paraboloid.
#ifndef ENDS_H
#define ENDS_H

#include "shapes/interval.h"
#include "traversal/ray.h"

// Finds the first hit on a surface of revolution. The ray is inside the side within `side` and between the
// ends within `slab`. A capped solid is the intersection of both. One comparison decides both, so that no
// ray passes between side and cap. An open or unbounded one is hit at a root between the ends.
static inline mask ends_first_hit(uint flags, const Ray *ray, Interval side, Interval slab, real *t)
{
    if (flags & REVOLUTION_CAPPED) {
        real near = real_max(side.near, slab.near);
        real far = real_min(side.far, slab.far);
        *t = ray_first(ray, near, far);
        return near <= far;
    }
    mask seen = flags & IGNORES_FRONT_FACES ? mask_none() : mask_all();
    mask near_valid = seen & (side.near > ray->tmin) & (side.near >= slab.near) & (side.near <= slab.far);
    *t = lanes_select(near_valid, side.near, side.far);
    return (*t >= slab.near) & (*t <= slab.far);
}

// Returns whether the hit at t is on a cap, which is so if the cap's crossing is nearer to t than the
// side's. At the rim it is on the side.
static inline mask ends_on_cap(Interval side, Interval slab, real t)
{
    real to_slab = real_min(fabs(t - slab.near), fabs(t - slab.far));
    real to_side = real_min(fabs(t - side.near), fabs(t - side.far));
    return to_slab < to_side;
}

#endif
