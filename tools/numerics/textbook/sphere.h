// Textbook sphere: b^2 - a c (Glassner, An introduction to ray tracing, 1989, section 2.1).
#ifndef SPHERE_H
#define SPHERE_H

#include "quadratic.h"

static inline mask sphere_hit(const Sphere *sphere, const Ray *ray, real *t)
{
    real radius = (real)(sphere->center_radius.w);
    Vector f = vector_subtract(ray->origin, vector_of(sphere->center_radius));
    real b = vector_dot(f, ray->direction);
    real c = vector_dot(f, f) - radius * radius;
    real discriminant = b * b - ray->squared * c;
    mask hit = RAY_ACTIVE(ray) & (discriminant >= (real)(0));
    if (!lanes_any(hit)) return hit;
    Roots roots = quadratic_roots(ray->inverse_squared, b, discriminant);
    *t = sphere->id.y & IGNORES_FRONT_FACES ? roots.far : ray_first(ray, roots.near, roots.far);
    return hit & (*t > ray->tmin);
}

static inline SurfacePoint sphere_surface_point(const Sphere *sphere, const Ray *ray, real t)
{
    Vector point = ray_point(ray, t);
    Vector normal = vector_scale(vector_subtract(point, vector_of(sphere->center_radius)),
                                 (real)(1 / sphere->center_radius.w));
    return surface_point_make(point, normal, TEXTBOOK_SIZE);
}

#endif
