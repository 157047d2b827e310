// Plane.
#ifndef PLANE_H
#define PLANE_H

#include "shapes/surface_point.h"

// t = height / along where that is finite, tested without dividing; equal signs mean ahead of the ray.
static inline mask plane_quotient(real height, real along, const Ray *ray, real *t)
{
    mask ahead = (height > (real)(0)) == (along > (real)(0));
    mask hit = RAY_ACTIVE(ray) & (ahead | (ray->tmin < (real)(0))) & quotient_is_bounded(height, along);
    if (!lanes_any(hit)) return hit;
    *t = real_divide(height, lanes_select(hit, along, (real)(1)));
    return hit & (*t > ray->tmin);
}

// t = n . (p - o) / n . d, the difference first. Only n . d = 0 is no hit: a threshold would cut the horizon.
static inline mask plane_crossing(Vector point, Vector normal, const Ray *ray, real *t)
{
    real along, height;
    if (IS_COMPENSATED) {
        along = vector_dot_compensated(normal, ray->direction);
        height = pair_vector_dot_once(pair_vector_difference(point, ray->origin), normal);
    } else {
        along = vector_dot(normal, ray->direction);
        height = vector_dot(normal, vector_subtract(point, ray->origin));
    }
    return plane_quotient(height, along, ray, t);
}

static inline mask plane_hit(const Plane *plane, const Ray *ray, real *t)
{
    return plane_crossing(vector_of(plane->point), vector_of(plane->normal), ray, t);
}

// The ray's point, moved onto the plane once. The normal's w is one over its length.
static inline SurfacePoint plane_crossing_point(Vector point, scalar4 normal, const Ray *ray, real t)
{
    Vector unit = IS_COMPENSATED ? vector_normalize(vector_of(normal))
                                 : vector_scale(vector_of(normal), (real)(normal.w));
    Vector crossing = ray_point(ray, t), to_point = vector_subtract(point, crossing);
    SurfacePoint crossed = surface_point_make(vector_fma(unit, vector_dot(unit, to_point), crossing), unit,
                                              vector_norm1_along(unit, to_point));
    if (IS_COMPENSATED) surface_point_move_to_ray(&crossed, ray, t, crossed.rounding_scale);
    return crossed;
}

static inline SurfacePoint plane_surface_point(const Plane *plane, const Ray *ray, real t)
{
    return plane_crossing_point(vector_of(plane->point), plane->normal, ray, t);
}

#endif
