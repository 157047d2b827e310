// A point of a surface, as a shape's own formulas give it.
#ifndef SURFACE_POINT_H
#define SURFACE_POINT_H

#include "traversal/ray.h"

// `size` is the magnitude of the numbers that the position was computed from: its distance from the true
// surface is below 16 u size + 4 u |position|.
typedef struct {
    Vector position;
    Vector normal;         // geometric, unit, to either side
    Vector shading_normal; // unit; differs on smooth triangles
    real size;
} SurfacePoint;

static inline SurfacePoint surface_point_make(Vector position, Vector normal, real size)
{
    return (SurfacePoint){position, normal, normal, size};
}

// Replaces the position by the ray's own point at t where the ray's origin and length are far smaller than
// the shape's numbers, of that magnitude, whose rounding would dominate: on a planet, meters. For shapes
// whose t is accurate enough: along the normal off by at most 13 u of the ray's origin and length (a sphere
// at `single` with a device's worst quotients and roots; 3 u without) plus, from what sums of exact products
// still lose, 6 u^2 of the size.
static inline void surface_point_move_to_ray(SurfacePoint *point, const Ray *ray, real t, real magnitude)
{
    real path_length = vector_norm1(ray->direction) * fabs(t), limit = magnitude * (real)(0x1p-4f);
    if (RARELY(lanes_any(path_length < limit))) {
        real reach = vector_norm1(ray->origin) + path_length;
        mask close = reach < limit;
        point->position = vector_select(close, ray_point(ray, t), point->position);
        point->size = lanes_select(close, real_fma((real)(UNIT_ROUNDOFF), magnitude, reach), point->size);
    }
}

static inline void surface_point_replace(SurfacePoint *point, mask where, const SurfacePoint *other)
{
    point->position = vector_select(where, other->position, point->position);
    point->normal = vector_select(where, other->normal, point->normal);
    point->shading_normal = vector_select(where, other->shading_normal, point->shading_normal);
    point->size = lanes_select(where, other->size, point->size);
}

#endif
