// Defines a point of a surface, as a shape's formulas compute it.
#ifndef SURFACE_POINT_H
#define SURFACE_POINT_H

#include "traversal/ray.h"

// `rounding_scale` is the magnitude of the numbers that the position was computed from. The position is off
// the true surface by less than POINT_SCALE_ERROR u rounding_scale + POINT_POSITION_ERROR u |position|.
enum { POINT_SCALE_ERROR = 16, POINT_POSITION_ERROR = 4 };

#define HAS_SHADING_NORMALS (HAS_TRIANGLES || HAS_NORMAL_MAPS)

typedef struct {
    Vector position;
    Vector normal;         // geometric, unit, to either side
    Vector shading_normal; // unit; differs only with HAS_SHADING_NORMALS
    real rounding_scale;
    Vector lift; // with HAS_SMOOTH_NORMALS, from the position to where rays to lights start
    // At `certified`, the rate at which the shading normal turns along the surface, and a bound on its error
    // except for that from the position's error (shading/lane_points.h). For a flat surface, a bound on the
    // position's height over the exact surface, else NEVER.
    real curvature, normal_error, height;
    real lift_error; // at `certified`, a bound on the error of `lift`, 0 where nothing lifts
} SurfacePoint;

static inline SurfacePoint surface_point_make(Vector position, Vector normal, real rounding_scale)
{
    SurfacePoint point;
    point.position = position;
    point.normal = point.shading_normal = normal;
    point.rounding_scale = rounding_scale;
    if (HAS_SMOOTH_NORMALS) point.lift = (Vector){(real)(0), (real)(0), (real)(0)};
    if (IS_CERTIFIED) {
        point.lift_error = (real)(0);
        point.curvature = point.normal_error = (real)(0);
        point.height = NEVER;
    }
    return point;
}

// Replaces the position by the ray's point at t if the ray's origin and its path to the hit are below 1/16 of
// `shape_scale`, the magnitude of the shape's numbers. There their rounding would dominate, by meters on a
// planet. The shape's t must be accurate: along the normal off by at most 13 u of the ray's origin and path
// (a sphere at `single` with a device's worst quotients and roots; 3 u without them), plus the 6 u^2 of the
// shape's numbers that sums of exact products lose.
static inline void surface_point_move_to_ray(SurfacePoint *point, const Ray *ray, real t, real shape_scale)
{
    real path_length = vector_norm1(ray->direction) * fabs(t), limit = shape_scale * 0x1p-4f;
    if (RARELY(lanes_any(path_length < limit))) {
        real ray_scale = vector_norm1(ray->origin) + path_length;
        mask close = ray_scale < limit;
        vector_replace(&point->position, close, ray_point(ray, t));
        real_replace(&point->rounding_scale, close, real_fma((real)(UNIT_ROUNDOFF), shape_scale, ray_scale));
    }
}

static inline void surface_point_replace(SurfacePoint *point, mask where, const SurfacePoint *other)
{
    vector_replace(&point->position, where, other->position);
    vector_replace(&point->normal, where, other->normal);
    vector_replace(&point->shading_normal, where, other->shading_normal);
    real_replace(&point->rounding_scale, where, other->rounding_scale);
    if (HAS_SMOOTH_NORMALS) vector_replace(&point->lift, where, other->lift);
    if (!IS_CERTIFIED) return;
    real_replace(&point->curvature, where, other->curvature);
    real_replace(&point->normal_error, where, other->normal_error);
    real_replace(&point->height, where, other->height);
    if (HAS_SMOOTH_NORMALS) real_replace(&point->lift_error, where, other->lift_error);
}

#endif
