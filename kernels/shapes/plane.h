// Intersects planes.
#ifndef PLANE_H
#define PLANE_H

#include "shapes/certain.h"
#include "shapes/surface_point.h"

// Sets t = height / along. Returns the lanes where it is finite, which is tested without dividing, and
// beyond the ray's start. Equal signs mean that the plane is ahead.
static inline mask plane_quotient(real height, real along, const Ray *ray, real *t)
{
    mask ahead = (height > 0) == (along > 0);
    mask hit = RAY_ACTIVE(ray) & (ahead | (ray->tmin < 0)) & quotient_is_bounded(height, along);
    if (!lanes_any(hit)) return hit;
    *t = real_divide(height, lanes_select(hit, along, (real)(1)));
    return hit & (*t > ray->tmin);
}

// Returns n . (p - from), with the difference first. Components of n are rounded; n is also off by up to
// `normal_error`, an absolute error.
static inline Bounded plane_height(Vector point, Vector normal, scalar normal_error, Vector from)
{
    const Vector to_point = vector_subtract(point, from);
    Bounded height = {IS_COMPENSATED ? pair_vector_dot_once(pair_vector_difference(point, from), normal)
                                     : vector_dot(normal, to_point),
                      (real)(0)};
    if (!IS_CERTIFIED) return height;
    height.error =
        UNIT_ROUNDOFF * (6 * vector_norm1_along(normal, to_point) + 2 * vector_norm1_along(normal, point));
    if (normal_error > 0) height.error = real_fma((real)(normal_error), vector_norm1(to_point), height.error);
    return height;
}

// Returns n . d.
static inline Bounded plane_along(Vector normal, Vector direction)
{
    Bounded along = {IS_COMPENSATED ? vector_dot_compensated(normal, direction)
                                    : vector_dot(normal, direction),
                     (real)(0)};
    if (IS_CERTIFIED) along.error = 5 * UNIT_ROUNDOFF * vector_norm1_along(normal, direction);
    return along;
}

// Computes t = n . (p - o) / n . d. Only n . d = 0 is not a hit, since a threshold would cut the horizon.
static inline mask plane_hit(const Plane *plane, const Ray *ray, real *t)
{
    const Vector normal = vector_of(plane->normal);
    const real height = plane_height(vector_of(plane->point), normal, 0, ray->origin).value;
    return plane_quotient(height, plane_along(normal, ray->direction).value, ray, t);
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
    Bounded height = plane_height(point, normal, normal_error, ray->origin),
            along = plane_along(normal, ray->direction);
    height.error = height.error + size * ray->origin_error;
    along.error = along.error + size * (ray->length * ray->direction_error);
    if (normal_error > 0) along.error = real_fma((real)(normal_error), ray->length, along.error);
    const Bounded t = bounded_quotient(height, along);
    const mask crosses = t.error < NEVER;
    *crossing = (Interval){t.value - t.error, t.value + t.error};
    if (lanes_all(crosses)) return crosses;
    // nearly parallel, it crosses beyond the least distance over the greatest approach
    real least = real_max(fabs(height.value) - height.error, (real)(0));
    real greatest = (fabs(along.value) + along.error) * BOUND_SLACK;
    real parallel_low = divide_or(least, greatest, (real)(LARGEST)) * (1 - 16 * UNIT_ROUNDOFF);
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
    mask lanes = RAY_ACTIVE(ray) & !ray_starts_on(ray, plane->id.x);
    if (!lanes_any(lanes)) return certain_miss();
    Interval crossing;
    mask crosses = certain_plane_of(vector_of(plane->point), plane->normal, ray, &crossing);
    return certain_crossing(ray, lanes & crosses, lanes, crossing.near, crossing.far);
}

// Returns a bound on the height of a point over a plane, times the length of the normal, which is rounded and
// off by up to `normal_error`.
static inline real certain_plane_height(Vector point, Vector normal, scalar normal_error, Vector position)
{
    const Bounded height = plane_height(point, normal, normal_error, position);
    return (fabs(height.value) + height.error) * BOUND_SLACK;
}

// Sets a point's height over a plane. The w of `normal` is one over its length. No lane is uncertain.
static inline mask plane_point_set_height(Vector on_plane, scalar4 normal, SurfacePoint *point)
{
    point->height = (real)(normal.w) * certain_plane_height(on_plane, vector_of(normal), 0, point->position);
    return mask_none();
}

static inline mask plane_set_errors(const Plane *plane, const Ray *ray, real t, real position_error,
                                    SurfacePoint *point)
{
    return plane_point_set_height(vector_of(plane->point), plane->normal, point);
}

#endif
