// Textbook disc: the plane, then the crossing's distance from the center.
#ifndef DISC_H
#define DISC_H

#include "plane.h"

static inline mask disc_hit(const Disc *disc, const Ray *ray, real *t)
{
    Vector center = vector_of(disc->center_radius);
    real radius = (real)(disc->center_radius.w);
    mask hit = plane_crossing(center, vector_of(disc->normal), ray, t);
    Vector from_center = vector_subtract(ray_point(ray, *t), center);
    return hit & (vector_dot(from_center, from_center) <= radius * radius);
}

static inline SurfacePoint disc_surface_point(const Disc *disc, const Ray *ray, real t)
{
    return surface_point_make(ray_point(ray, t), vector_normalize(vector_of(disc->normal)), TEXTBOOK_SIZE);
}

#endif
