// Intersects planes.
#ifndef PLANE_H
#define PLANE_H

#include "shapes/certain.h"
#include "shapes/surface_point.h"

// Sets t = height / along. Returns the lanes where it is finite, which is tested without dividing, and
// beyond the ray's start. Equal signs mean that the plane is ahead.
static inline mask plane_quotient(real height, real along, const Ray *ray, real *t)
{
    mask ahead = (height > (real)(0)) == (along > (real)(0));
    mask hit = RAY_ACTIVE(ray) & (ahead | (ray->tmin < (real)(0))) & quotient_is_bounded(height, along);
    if (!lanes_any(hit)) return hit;
    *t = real_divide(height, lanes_select(hit, along, (real)(1)));
    return hit & (*t > ray->tmin);
}

// Computes t = n . (p - o) / n . d, with the difference first. Only n . d = 0 is not a hit, since a threshold
// would cut the horizon.
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

// Returns the ray's point, moved onto the plane once. The normal's w is one over its length.
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

// Returns the lanes where the line crosses a plane, at n . (p - o) / n . d, with t in *crossing. In other
// lanes it may cross it at or beyond crossing->near. `size` is at least |n|. Components of n are rounded; n
// is also off by up to `normal_error`, an absolute error.
static inline mask certain_plane(Vector point, Vector normal, real size, scalar normal_error, const Ray *ray,
                                 Interval *crossing)
{
    Vector to_point = vector_subtract(point, ray->origin);
    real height = vector_dot(normal, to_point), along = vector_dot(normal, ray->direction);
    Vector unsigned_normal = {fabs(normal.x), fabs(normal.y), fabs(normal.z)};
    real height_error = (real)(UNIT_ROUNDOFF) * ((real)(6) * vector_norm1_along(unsigned_normal, to_point) +
                                                 (real)(2) * vector_norm1_along(unsigned_normal, point)) +
                        size * ray->origin_error;
    real along_error = (real)(5 * UNIT_ROUNDOFF) * vector_norm1_along(unsigned_normal, ray->direction) +
                       size * (ray->length * ray->direction_error);
    if (normal_error > 0) {
        height_error = real_fma((real)(normal_error), vector_norm1(to_point), height_error);
        along_error = real_fma((real)(normal_error), ray->length, along_error);
    }
    mask crosses = fabs(along) > (real)(8) * along_error;
    real inverse = real_divide((real)(1), lanes_select(crosses, along, (real)(1)));
    real t = height * inverse;
    // the exact n . d is at least 7/8 of this one, and 8/7 < 1.2
    real t_error = (real)(1.2f) * real_fma(fabs(t), along_error, height_error) * fabs(inverse) +
                   (real)(8 * UNIT_ROUNDOFF) * fabs(t);
    *crossing = (Interval){t - t_error, t + t_error};
    if (lanes_all(crosses)) return crosses;
    // nearly parallel, it crosses beyond the least distance over the greatest approach
    real least = real_max(fabs(height) - height_error, (real)(0));
    real greatest = (fabs(along) + along_error) * (real)(1 + 16 * UNIT_ROUNDOFF);
    real parallel_low = divide_or(least, greatest, (real)(LARGEST)) * (real)(1 - 16 * UNIT_ROUNDOFF);
    crossing->near = lanes_select(crosses, crossing->near, parallel_low);
    crossing->far = lanes_select(crosses, crossing->far, (real)(LARGEST));
    return crosses;
}

// Returns the lanes where the line crosses a plane, with bounds on t in *crossing. In other lanes it may
// cross it at or beyond crossing->near. The normal is exact except for its rounding; its w is one over its
// length.
static inline mask certain_plane_of(Vector point, scalar4 normal, const Ray *ray, Interval *crossing)
{
    real size = (real)(uniform_divide(1 + 16 * UNIT_ROUNDOFF, normal.w));
    return certain_plane(point, vector_of(normal), size, 0, ray, crossing);
}

static inline CertainHit plane_certain_hit(const Plane *plane, const Ray *ray)
{
    mask lanes = RAY_ACTIVE(ray) & !ray_cannot_rehit(ray, plane->id.x, true);
    if (!lanes_any(lanes)) return certain_miss();
    Interval crossing;
    mask crosses = certain_plane_of(vector_of(plane->point), plane->normal, ray, &crossing);
    return certain_crossing(ray, lanes & crosses, lanes, crossing.near, crossing.far);
}

// Returns a bound on the height of a point over a plane, times the length of the normal, which is rounded and
// off by up to `normal_error`.
static inline real certain_plane_height(Vector point, Vector normal, scalar normal_error, Vector position)
{
    Vector to_point = vector_subtract(point, position);
    Vector unsigned_normal = {fabs(normal.x), fabs(normal.y), fabs(normal.z)};
    real rounding = (real)(UNIT_ROUNDOFF) * ((real)(6) * vector_norm1_along(unsigned_normal, to_point) +
                                             (real)(2) * vector_norm1_along(unsigned_normal, point));
    if (normal_error > 0) rounding = real_fma((real)(normal_error), vector_norm1(to_point), rounding);
    return (fabs(vector_dot(normal, to_point)) + rounding) * (real)(1 + 16 * UNIT_ROUNDOFF);
}

static inline mask plane_set_errors(const Plane *plane, const Ray *ray, real t, real place_error,
                                    SurfacePoint *point)
{
    const real inverse_length = (real)(plane->normal.w);
    point->height = inverse_length * certain_plane_height(vector_of(plane->point), vector_of(plane->normal),
                                                          0, point->position);
    return mask_none();
}

#endif
