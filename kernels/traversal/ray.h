// Rays, their hits, and what a surface looks like where one is hit.
#ifndef RAY_H
#define RAY_H

#include "numerics/vector.h"

#include "types.h"

typedef struct {
    Vector origin, direction; // the direction need not be unit
    real squared;             // direction . direction
    real inverse_squared;
    real near, far; // hits lie strictly between
    mask active;    // the lanes that carry a ray at all
    real travelled; // from the eye to the origin, for pictures on surfaces
    // APEX_…: all lanes' lines pass through one point, within u |direction|; at `fast`, whose compiler may
    // take the direction apart, within u of the origin
    uint common_origin;
    real apex_slack; // what cull_spheres count as larger by for the direction's sake
    // by ray_make_frame: 1 / direction, huge where the component is 0
    Vector inverse;
    // for triangles: two vectors across the direction, about as long as the square of its mantissas, and one
    // along it, whose product with a point seen from the origin is the point's t
    Vector across_u, across_v, along;
} Ray;

typedef struct {
    real t;
    integer object; // its id; -1: nothing hit
} Hit;

// A point of a surface. `size` is the magnitude of the numbers the point was computed from: its distance from
// the true surface is below 16 u size + 4 u |position|.
typedef struct {
    Vector position;
    Vector normal;         // unit, of the geometry, either side
    Vector shading_normal; // unit; differs on smooth triangles
    real size;
} Patch;

// A mask from memory, compared anew: then LLVM sees that a bit tells all of a lane, and keeps in mask
// registers what is made of it. Of a function's result it does not.
#define RAY_ACTIVE(ray) ((ray)->active != (mask)(0))

static inline real real_inverse_or_zero(real a)
{
    mask zero = a == (real)(0);
    return lanes_select(zero, (real)(0), real_divide((real)(1), lanes_select(zero, (real)(1), a)));
}

// 1 / a, huge for 0: the product with a distance then tells its sign. One Newton step makes what a device
// divides inexactly nearly exact, and exact for powers of two: a box's face is where it is for rays along an
// axis. The hierarchy can do without.
static inline real real_inverse_or_huge(real a)
{
    mask zero = a == (real)(0), steps = fabs(a) > (real)(SMALLEST_RATIO);
    real inverse = real_divide((real)(1), lanes_select(zero, (real)(1), a));
    if ((HAS_BOXES | HAS_TRIANGLES) & !IS_COMPENSATED)
        inverse = lanes_select(steps, real_fma(real_fma(-a, inverse, (real)(1)), inverse, inverse), inverse);
    return lanes_select(zero, (real)(1 / SMALLEST_RATIO), inverse);
}

// Two vectors across another, as long as each other and at right angles, without a branch (Duff et al.,
// Building an orthonormal basis, revisited, JCGT 6(1), 2017, listing 3; here multiplied by length (length +
// |z|), which spares the divisions).
static inline void frame_across(Vector d, Vector *u, Vector *v)
{
    real side = lanes_select(d.z >= (real)(0), (real)(1), (real)(-1));
    real norm = vector_length(d);
    real w = real_fma(side, norm, d.z);
    real norm_w = norm * w;
    *u = (Vector){real_fma(-side * d.x, d.x, norm_w), -side * d.x * d.y, -side * d.x * w};
    *v = (Vector){-d.x * d.y, real_fma(-d.y, d.y, side * norm_w), -d.y * w};
}

static inline Ray ray_make(Vector origin, Vector direction, real near, real far, mask active)
{
    Ray ray;
    ray.origin = origin;
    ray.direction = direction;
    ray.squared = vector_dot(direction, direction);
    ray.near = near;
    ray.far = far;
    ray.travelled = (real)(0);
    ray.common_origin = COMMON_ORIGIN_NONE;
    ray.active = active & (ray.squared > (real)(0));
    // 0 in lanes without a ray: then of spheres only one around the origin looks closer at them
    real divisor = lanes_select(ray.active, ray.squared, (real)(1));
    ray.inverse_squared = lanes_select(ray.active, real_divide((real)(1), divisor), (real)(0));
    return ray;
}

// What boxes, triangles and the hierarchy ask for: rays have it where there are any of those outside the
// hierarchy, or once they come near the hierarchy.
static inline void ray_make_frame(Ray *ray)
{
    Vector d = ray->direction;
    ray->inverse = (Vector){real_inverse_or_huge(d.x), real_inverse_or_huge(d.y), real_inverse_or_huge(d.z)};
    if (!HAS_TRIANGLES) return;
    real largest = real_max(real_max(fabs(d.x), fabs(d.y)), fabs(d.z));
    frame_across(vector_scale(d, real_inverse_power(largest)), &ray->across_u, &ray->across_v);
    ray->along = vector_scale(d, ray->inverse_squared);
}

// Without an end, along a direction that is unit, or 0: its square is 1 + e with e of a few u, one over that
// is 1 - e but for the square of e.
static inline Ray ray_make_unit(Vector origin, Vector direction, mask active)
{
    Ray ray = ray_make(origin, direction, (real)(0), (real)(LARGEST), active);
    if (IS_COMPENSATED) return ray;
    ray.inverse_squared = lanes_select(ray.active, (real)(2) - ray.squared, (real)(0));
    return ray;
}

// Once it is settled which lanes carry a ray: those that do not miss all.
static inline void ray_take_apex(Ray *ray, uint common_origin)
{
    ray->common_origin = common_origin;
    real slack = (real)(CULL_DIRECTION_SLACK * UNIT_ROUNDOFF) * (ray->squared * ray->squared);
    if (common_origin == COMMON_ORIGIN_EYE) slack = (real)(0); // where rays start
    ray->apex_slack = lanes_select(ray->active, slack, (real)(-LARGEST));
}

// The lines that certainly miss a ball, for rays with an common_origin. A line along d through a point misses
// a ball around v, seen from there, if (v . d)^2 < p d^2 for the point's power p = v^2 - r^2. The ball counts
// as larger by 64 u (|v| + |d|): by what a test of the shape in it may be off, by roundings here, and by the
// line's own way past the common_origin. That is less than 256 u v^2, which p has been lowered by, and 128 u
// d^2; rays from the eye start there, and need the former alone.
static inline mask ray_misses_cull_sphere(const Ray *ray, global const CullSphere *ball)
{
    global const scalar *center_power = (global const scalar *)ball;
    real along = real_fma(
        (real)(center_power[0]), ray->direction.x,
        real_fma((real)(center_power[1]), ray->direction.y, (real)(center_power[2]) * ray->direction.z));
    return real_fma(along, along, ray->apex_slack) < ray->squared * (real)(center_power[3]);
}

// The nearer of two crossings, near_t <= far_t, that lies beyond the ray's start: far_t where near_t lies
// before it.
static inline real ray_first(const Ray *ray, real near_t, real far_t)
{
    return lanes_select(near_t > ray->near, near_t, far_t);
}

static inline Vector ray_point(const Ray *ray, real t)
{
    return vector_fma(ray->direction, t, ray->origin);
}

// start + direction t, rounded about once.
static inline real ray_coordinate(Pair start, real direction, real t)
{
    Pair way = pair_product(direction, t), sum = pair_sum(start.high, way.high);
    return sum.high + (sum.low + (start.low + way.low));
}

// The same point as seen from another; compensated, it is as exact as t is, however far the ray has come.
static inline Vector ray_point_from(const Ray *ray, Vector from, real t)
{
    if (!IS_COMPENSATED) return vector_fma(ray->direction, t, vector_subtract(ray->origin, from));
    PairVector start = pair_vector_difference(ray->origin, from);
    return (Vector){ray_coordinate(start.x, ray->direction.x, t),
                    ray_coordinate(start.y, ray->direction.y, t),
                    ray_coordinate(start.z, ray->direction.z, t)};
}

static inline Patch patch_make(Vector position, Vector normal, real size)
{
    return (Patch){position, normal, normal, size};
}

// Puts the point where the ray is at t, if origin and way there are far smaller than the numbers of the
// shape, of that magnitude, which its own form would lose bits to: on a planet, meters. For shapes whose t is
// then exact enough: off by at most 13 u of origin and way along the normal (of a sphere at `single` with a
// device's worst quotients and roots; 3 u without) and, from what the sums of exact products still lose, 6
// u^2 of the size.
static inline void patch_move_to_ray(Patch *patch, const Ray *ray, real t, real magnitude)
{
    real way = vector_magnitude(ray->direction) * fabs(t), limit = magnitude * (real)(0x1p-4f);
    if (RARELY(lanes_any(way < limit))) {
        real reach = vector_magnitude(ray->origin) + way;
        mask beside = reach < limit;
        patch->position = vector_select(beside, ray_point(ray, t), patch->position);
        patch->size = lanes_select(beside, real_fma((real)(UNIT_ROUNDOFF), magnitude, reach), patch->size);
    }
}

static inline void patch_keep(Patch *patch, mask where, const Patch *other)
{
    patch->position = vector_select(where, other->position, patch->position);
    patch->normal = vector_select(where, other->normal, patch->normal);
    patch->shading_normal = vector_select(where, other->shading_normal, patch->shading_normal);
    patch->size = lanes_select(where, other->size, patch->size);
}

#endif
