// Intersects axis-aligned boxes, faces included.
#ifndef BOX_H
#define BOX_H

#include "shapes/certain.h"
#include "shapes/interval.h"
#include "shapes/surface_point.h"

// The intervals of t where a ray is between the two faces across each axis.
typedef struct {
    Interval x, y, z;
} BoxSlabs;

// Returns the slabs, at `certified` those of the box enlarged by `more`.
static inline BoxSlabs box_slabs(const Box *box, const Ray *ray, real more)
{
    Vector low = vector_of(box->low), high = vector_of(box->high), o = ray->origin, d = ray->direction;
    return (BoxSlabs){slab_crossings(low.x, high.x, more, o.x, d.x, ray->inverse.x),
                      slab_crossings(low.y, high.y, more, o.y, d.y, ray->inverse.y),
                      slab_crossings(low.z, high.z, more, o.z, d.z, ray->inverse.z)};
}

// Returns the interval where a ray is between all faces.
static inline Interval slabs_common(BoxSlabs slabs)
{
    return intervals_common(intervals_common(slabs.x, slabs.y), slabs.z);
}

static inline mask box_hit(const Box *box, const Ray *ray, real *t)
{
    const Interval inside = slabs_common(box_slabs(box, ray, (real)(0)));
    *t = ray_first(ray, inside.near, inside.far);
    return RAY_ACTIVE(ray) & (inside.near <= inside.far) & (*t > ray->tmin);
}

// Returns |t - crossing| for the nearer of a slab's crossings. Sets *low_face if that is the slab's low
// face, where a ray towards larger coordinates enters.
static inline real slab_distance(Interval slab, real direction, real t, mask *low_face)
{
    mask entering = fabs(t - slab.near) <= fabs(t - slab.far);
    *low_face = entering == (direction > 0);
    return interval_end_distance(slab, t);
}

// Returns one coordinate of a point on a box. It is the face's in the lanes `on_face`, else one clamped to
// the box.
static inline real box_coordinate(real low, real high, mask on_face, mask low_face, real coordinate)
{
    return lanes_select(on_face, lanes_select(low_face, low, high), real_clamp(coordinate, low, high));
}

// Returns the point on the face whose crossing is nearest to t, or the first of x, y and z if several are.
// The position lies exactly on that face.
static inline SurfacePoint box_surface_point(const Box *box, const Ray *ray, real t)
{
    Vector low = vector_of(box->low), high = vector_of(box->high);
    const BoxSlabs slabs = box_slabs(box, ray, (real)(0));
    mask low_x, low_y, low_z;
    real to_x = slab_distance(slabs.x, ray->direction.x, t, &low_x);
    real to_y = slab_distance(slabs.y, ray->direction.y, t, &low_y);
    real to_z = slab_distance(slabs.z, ray->direction.z, t, &low_z);
    mask on_x = (to_x <= to_y) & (to_x <= to_z);
    mask on_y = !on_x & (to_y <= to_z);
    mask on_z = !on_x & !on_y;

    const Vector p = ray_point(ray, t);
    const Vector position = {box_coordinate(low.x, high.x, on_x, low_x, p.x),
                             box_coordinate(low.y, high.y, on_y, low_y, p.y),
                             box_coordinate(low.z, high.z, on_z, low_z, p.z)};
    const real zero = (real)(0), one = (real)(1);
    Vector normal = {lanes_select(on_x, lanes_select(low_x, -one, one), zero),
                     lanes_select(on_y, lanes_select(low_y, -one, one), zero),
                     lanes_select(on_z, lanes_select(low_z, -one, one), zero)};
    return surface_point_make(position, normal, zero);
}

// Returns the hit with bounds. The enlarged box contains the interval of the exact crossings, and the shrunk
// box lies within it.
static inline CertainHit box_certain_hit(const Box *box, const Ray *ray)
{
    mask leaves = ray_starts_on(ray, box->id.x), lanes = RAY_ACTIVE(ray) & !(leaves & ray->leaves_outward);
    Vector to_low = vector_subtract(vector_of(box->low), ray->origin),
           to_high = vector_subtract(vector_of(box->high), ray->origin);
    real distance = vector_norm1((Vector){real_max(fabs(to_low.x), fabs(to_high.x)),
                                          real_max(fabs(to_low.y), fabs(to_high.y)),
                                          real_max(fabs(to_low.z), fabs(to_high.z))});
    real position_error = ray_position_error(ray, distance) +
                          UNIT_ROUNDOFF * real_fma((real)(8), distance, 2 * vector_norm1(ray->origin));
    Interval outer = slabs_common(box_slabs(box, ray, position_error));
    mask perhaps = lanes & (outer.near <= outer.far) & (outer.far >= ray->tmin);
    if (!lanes_any(perhaps)) return certain_miss();
    Interval inner = slabs_common(box_slabs(box, ray, -position_error));
    mask certain = perhaps & (inner.near < inner.far);
    const CertainInterval inside = {outer, inner, {-NEVER, NEVER}, certain, perhaps};
    return certain_interval_hit(&inside, ray, leaves & certain);
}

// Sets the errors of a point. Faces that join at an edge have different normals, so another face that is as
// near as the error makes the lane uncertain.
static inline mask box_set_errors(const Box *box, const Ray *ray, real t, real position_error,
                                  SurfacePoint *point)
{
    Vector position = point->position, normal = point->normal;
    const real zero = (real)(0), error = position_error + position_error;
    Vector low = vector_of(box->low), high = vector_of(box->high);
    real x = interval_end_distance((Interval){low.x, high.x}, position.x);
    real y = interval_end_distance((Interval){low.y, high.y}, position.y);
    real z = interval_end_distance((Interval){low.z, high.z}, position.z);
    real along = lanes_select(normal.x != zero, x, lanes_select(normal.y != zero, y, z));
    point->height = real_fma((real)(4 * UNIT_ROUNDOFF), vector_norm1(position) + along, along);
    return ((normal.x == zero) & (x <= error)) | ((normal.y == zero) & (y <= error)) |
           ((normal.z == zero) & (z <= error));
}

#endif
