// Defines rays and hits.
#ifndef RAY_H
#define RAY_H

#include "numerics/vector.h"

#include "sampling.h"
#include "types.h"

// A t beyond every hit, for bounds where nothing is known. Sums of eight of them do not overflow.
#define NEVER ((real)(LARGEST / 8))

// 1 if rays with bounded errors may run inside a sphere (shading/chords.h).
#define HAS_CHORDS (IS_CERTIFIED && HAS_SPHERES && (HAS_REFLECTION || HAS_TRANSMISSION))

typedef struct {
    Vector origin, direction; // the direction need not be unit
    real squared;             // direction . direction
    real inverse_squared;
    real tmin, tmax; // hits lie strictly between
    mask active;     // lanes that carry a ray
    real travelled;  // distance from the eye to the origin, for texture filtering
    Sample sample;   // with HAS_AREA_LIGHTS
    // COMMON_ORIGIN_…: the lines of all lanes pass through it, within u |direction|
    uint common_origin;
    real cull_slack; // at `certified`: ray_cull_slack
    // At `certified`, bounds on the distance of the origin from the exact ray's line and on the direction's
    // error, relative to its length; the id of the object that the ray leaves, or -1; whether it certainly
    // leaves it outward; and whether the exact rays end at one point, a light, where the errors of their
    // origins have vanished. The exact ray starts between t = tmin <= 0 and -tmin.
    real origin_error, direction_error;
    integer origin_object;
    mask leaves_outward;
    bool ends_at_light;
    // With HAS_SMOOTH_NORMALS, whether the ray starts in front of the triangle that it leaves instead of on
    // it (shapes/triangle.h), and whether it certainly runs back to the triangle's plane.
    mask is_lifted, sinks;
    // the Chord's (shading/chords.h) if the ray runs along one of the sphere that it leaves, else NEVER
    real chord_turn, chord_end_position;
    real length;        // the direction's length, not below the exact one, within 48 u
    real across_length; // set by ray_prepare: a bound on the length of across_u and across_v
    Vector inverse;     // set by ray_prepare for boxes: 1 / direction
    // set by ray_prepare for triangles: two vectors across the direction, of length O(1) since they are
    // computed from a direction scaled by a power of two
    Vector across_u, across_v;
} Ray;

typedef struct {
    real t;
    integer object; // its id, or -1 if nothing is hit
    // At `certified`, `low` is not above this hit's exact t, and `high` is not below that of the exact ray's
    // first hit, whichever shape has it. `uncertain` marks the lanes where any of this is uncertain.
    real low, high;
    mask uncertain;
} Hit;

// Re-tests the stored mask. LLVM then sees that a lane is all ones or all zeros, and keeps what derives from
// it in mask registers. It does not see this through a function call, hence a macro.
#define RAY_ACTIVE(ray) ((ray)->active != (mask)(0))

static inline mask hit_found(const Hit *hit)
{
    return hit->object >= (integer)(0);
}

static inline real real_inverse_or_zero(real a)
{
    mask zero = a == 0;
    return lanes_select(zero, (real)(0), real_divide((real)(1), lanes_select(zero, (real)(1), a)));
}

// Returns 1 / a, or a huge number for 0, so that its product with a distance keeps the sign. A Newton step
// makes inexact device division nearly exact, and exact for powers of two, so that rays along an axis hit a
// box exactly at its face. BVH boxes, which have slack, do without.
static inline real real_inverse_or_huge(real a)
{
    mask zero = a == 0, steps = fabs(a) > SMALLEST_RATIO;
    real inverse = real_divide((real)(1), lanes_select(zero, (real)(1), a));
    if ((HAS_BOXES | HAS_TRIANGLES) & !IS_COMPENSATED)
        inverse = lanes_select(steps, real_fma(real_fma(-a, inverse, (real)(1)), inverse, inverse), inverse);
    return lanes_select(zero, (real)(1 / SMALLEST_RATIO), inverse);
}

// Sets two vectors perpendicular to d and to each other, of equal length, without a branch (Duff et al.,
// Building an orthonormal basis, revisited, JCGT 6(1), 2017, listing 3; here times |d| (|d| + |z|), which
// saves the divisions).
static inline void frame_across(Vector d, Vector *u, Vector *v)
{
    real side = lanes_select(d.z >= 0, (real)(1), (real)(-1));
    real norm = vector_norm(d);
    real w = real_fma(side, norm, d.z);
    real norm_w = norm * w;
    *u = (Vector){real_fma(-side * d.x, d.x, norm_w), -side * d.x * d.y, -side * d.x * w};
    *v = (Vector){-d.x * d.y, real_fma(-d.y, d.y, side * norm_w), -d.y * w};
}

// Sets two vectors exactly perpendicular to d, so that products with points far along it do not cancel
// badly, by a shear along the largest component, as in Woop, Benthin, Wald (shapes/triangle.h).
static inline void shear_across(Vector d, Vector *u, Vector *v)
{
    const real zero = (real)(0);
    mask by_z = (fabs(d.z) >= fabs(d.x)) & (fabs(d.z) >= fabs(d.y)), by_x = !by_z & (fabs(d.x) > fabs(d.y));
    mask by_y = !by_z & !by_x;
    *u = (Vector){lanes_select(by_z, d.z, lanes_select(by_y, d.y, -d.y)),
                  lanes_select(by_z, zero, lanes_select(by_y, -d.x, d.x)), lanes_select(by_z, -d.x, zero)};
    *v = (Vector){lanes_select(by_x, -d.z, zero), lanes_select(by_z, d.z, lanes_select(by_y, -d.z, zero)),
                  lanes_select(by_z, -d.y, lanes_select(by_y, d.y, d.x))};
}

static inline Ray ray_make(Vector origin, Vector direction, real tmin, real tmax, mask active)
{
    Ray ray;
    ray.origin = origin;
    ray.direction = direction;
    ray.squared = vector_dot(direction, direction);
    ray.tmin = tmin;
    ray.tmax = tmax;
    if (HAS_IMAGES) ray.travelled = (real)(0);
    if (HAS_AREA_LIGHTS) ray.sample = (Sample){SAMPLE_CENTER, (word)(0)};
    ray.common_origin = COMMON_ORIGIN_NONE;
    if (IS_CERTIFIED) {
        ray.origin_error = ray.direction_error = (real)(0);
        ray.origin_object = (integer)(-1);
        ray.leaves_outward = mask_none();
        ray.ends_at_light = false;
        if (HAS_SMOOTH_NORMALS) ray.is_lifted = ray.sinks = mask_none();
        if (HAS_CHORDS) ray.chord_turn = ray.chord_end_position = NEVER;
    }
    ray.active = active & (ray.squared > 0);
    // 0 in inactive lanes, which only a sphere around the origin still examines
    real divisor = lanes_select(ray.active, ray.squared, (real)(1));
    ray.inverse_squared = lanes_select(ray.active, real_divide((real)(1), divisor), (real)(0));
    if (IS_CERTIFIED) ray.length = real_sqrt(ray.squared) * BOUND_SLACK;
    return ray;
}

// Returns one over the direction's length, not below the exact value, within 80 u.
static inline real ray_inverse_length(const Ray *ray)
{
    return ray->inverse_squared * ray->length * BOUND_SLACK;
}

// Returns 1 / direction, huge where a component is 0.
static inline Vector ray_inverse(const Ray *ray)
{
    Vector d = ray->direction;
    return (Vector){real_inverse_or_huge(d.x), real_inverse_or_huge(d.y), real_inverse_or_huge(d.z)};
}

// The error of a triangle's corner, in u of its distance from the ray's start, counts the roundings of the
// difference and of two products.
enum { TRIANGLE_ERROR = 5 };

// Computes what boxes and triangles need. It is idempotent and called only before leaves of the BVH, and
// boxes and triangles outside it, are tested.
static inline void ray_prepare(Ray *ray)
{
    Vector d = ray->direction;
    if (HAS_BOXES) ray->inverse = ray_inverse(ray);
    if (!HAS_TRIANGLES) return;
    real largest = real_max_of_3(fabs(d.x), fabs(d.y), fabs(d.z));
    real scale = real_inverse_power_of_two(largest);
    if (IS_CERTIFIED) {
        shear_across(vector_scale(d, scale), &ray->across_u, &ray->across_v);
        real least = real_min_of_3(fabs(d.x), fabs(d.y), fabs(d.z)),
             second = vector_norm1(d) - largest - least;
        ray->across_length = BOUND_SLACK * scale * hypotenuse_above(second, largest);
    } else {
        frame_across(vector_scale(d, scale), &ray->across_u, &ray->across_v);
    }
}

// Returns a ray without a far end whose direction is a unit vector or 0. Its square is 1 + e with e of a few
// u; the reciprocal is 1 - e within e^2.
static inline Ray ray_make_unit(Vector origin, Vector direction, mask active)
{
    Ray ray = ray_make(origin, direction, (real)(0), (real)(LARGEST), active);
    if (IS_CERTIFIED) ray.length = BOUND_SLACK;
    if (IS_COMPENSATED) return ray;
    ray.inverse_squared = lanes_select(ray.active, 2 - ray.squared, (real)(0));
    return ray;
}

// Sets the common origin. `skips_culling` marks the lanes whose errors are too large for culling.
static inline void ray_set_common_origin(Ray *ray, uint common_origin, mask skips_culling)
{
    ray->common_origin = common_origin;
    if (!IS_CERTIFIED) return;
    real slack = CERTIFIED_CULL_DIRECTION_SLACK * UNIT_ROUNDOFF * ray->squared;
    if (common_origin == COMMON_ORIGIN_EYE) slack = (real)(0); // rays start exactly there
    ray->cull_slack = lanes_select(skips_culling, (real)(LARGEST), slack);
}

// Returns the amount by which the powers of cull spheres are lowered because rays to a light miss it by the
// rounding of their direction.
static inline real ray_cull_slack(const Ray *ray)
{
    if (IS_CERTIFIED) return ray->cull_slack;
    if (ray->common_origin == COMMON_ORIGIN_EYE) return (real)(0);
    return CULL_DIRECTION_SLACK * UNIT_ROUNDOFF * ray->squared;
}

// Returns near_t, or far_t if near_t is not beyond the ray's start, for crossings near_t <= far_t.
static inline real ray_first(const Ray *ray, real near_t, real far_t)
{
    return lanes_select(near_t > ray->tmin, near_t, far_t);
}

// Returns the vector whose dot product with a point seen from the origin is the point's t.
static inline Vector ray_along(const Ray *ray)
{
    return vector_scale(ray->direction, ray->inverse_squared);
}

static inline Vector ray_point(const Ray *ray, real t)
{
    return vector_fma(ray->direction, t, ray->origin);
}

// Returns start + direction t, rounded about once.
static inline real ray_coordinate(Pair start, real direction, real t)
{
    Pair offset = two_product(direction, t), sum = two_sum(start.high, offset.high);
    return sum.high + (sum.low + (start.low + offset.low));
}

// Returns the ray's point at t minus `from`. The compensated form is as exact as t at any distance.
static inline Vector ray_point_from(const Ray *ray, Vector from, real t)
{
    if (!IS_COMPENSATED) return vector_fma(ray->direction, t, vector_subtract(ray->origin, from));
    PairVector start = pair_vector_difference(ray->origin, from);
    return (Vector){ray_coordinate(start.x, ray->direction.x, t),
                    ray_coordinate(start.y, ray->direction.y, t),
                    ray_coordinate(start.z, ray->direction.z, t)};
}

#endif
