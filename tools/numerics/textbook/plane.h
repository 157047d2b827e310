// Textbook plane: a ray within a millionth of parallel to it does not meet it (Glassner, An introduction to
// ray tracing, 1989, section 2.2).
#ifndef PLANE_H
#define PLANE_H

#include "quadratic.h"

static inline mask plane_crossing(Vector point, Vector normal, const Ray *ray, real *t)
{
    real along = vector_dot(normal, ray->direction);
    *t = vector_dot(normal, vector_subtract(point, ray->origin)) / along;
    return RAY_ACTIVE(ray) & (fabs(along) > (real)(1e-6f)) & (*t > ray->tmin);
}

static inline mask plane_hit(const Plane *plane, const Ray *ray, real *t)
{
    return plane_crossing(vector_of(plane->point), vector_of(plane->normal), ray, t);
}

static inline SurfacePoint plane_surface_point(const Plane *plane, const Ray *ray, real t)
{
    Vector unit = vector_scale(vector_of(plane->normal), (real)(plane->normal.w));
    return surface_point_make(ray_point(ray, t), unit, TEXTBOOK_SIZE);
}

#endif
