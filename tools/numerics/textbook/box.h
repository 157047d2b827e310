// Textbook box: slabs, by division (Kay, Kajiya, Ray tracing complex scenes, SIGGRAPH 1986); zeros in the
// direction are left to infinities.
#ifndef BOX_H
#define BOX_H

#include "quadratic.h"

static inline Roots slab_crossings(real low, real high, real origin, real direction)
{
    real to_low = (low - origin) / direction, to_high = (high - origin) / direction;
    return (Roots){real_min(to_low, to_high), real_max(to_low, to_high)};
}

static inline mask box_hit(const Box *box, const Ray *ray, real *t)
{
    Roots x = slab_crossings((real)(box->low.x), (real)(box->high.x), ray->origin.x, ray->direction.x);
    Roots y = slab_crossings((real)(box->low.y), (real)(box->high.y), ray->origin.y, ray->direction.y);
    Roots z = slab_crossings((real)(box->low.z), (real)(box->high.z), ray->origin.z, ray->direction.z);
    real near = real_max(real_max(x.near, y.near), z.near);
    real far = real_min(real_min(x.far, y.far), z.far);
    *t = ray_first(ray, near, far);
    return RAY_ACTIVE(ray) & (near <= far) & (*t > ray->tmin);
}

// The face of the axis on which the point lies farthest out, as a part of the box.
static inline SurfacePoint box_surface_point(const Box *box, const Ray *ray, real t)
{
    Vector low = vector_of(box->low), high = vector_of(box->high);
    Vector point = ray_point(ray, t);
    Vector out = vector_subtract(vector_subtract(point, low), vector_subtract(high, point));
    out.x = out.x / (high.x - low.x);
    out.y = out.y / (high.y - low.y);
    out.z = out.z / (high.z - low.z);
    mask on_x = (fabs(out.x) >= fabs(out.y)) & (fabs(out.x) >= fabs(out.z));
    mask on_y = !on_x & (fabs(out.y) >= fabs(out.z));
    mask on_z = !on_x & !on_y;
    const real zero = (real)(0);
    Vector normal = {lanes_select(on_x, sign(out.x), zero), lanes_select(on_y, sign(out.y), zero),
                     lanes_select(on_z, sign(out.z), zero)};
    return surface_point_make(point, normal, TEXTBOOK_SIZE);
}

#endif
