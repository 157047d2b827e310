// Intersects spheres. With f from the center to the ray's start, b = f . d, c = f . f - r^2, and the
// discriminant is b^2 - a c.
#ifndef SPHERE_H
#define SPHERE_H

#include "shapes/certain_solid.h"
#include "shapes/eye_power.h"
#include "shapes/quadratic.h"

typedef struct {
    real b, c, discriminant;
    Vector moment; // E = f x d
} SphereQuadratic;

// Returns the quadratic for rays that start near the closest approach. b and c, the origin's power, are each
// rounded about once, and the discriminant, b^2 - a c, is off by 2 u (b^2 + |a c|).
static inline SphereQuadratic sphere_quadratic_near(const Sphere *sphere, const Ray *ray)
{
    const Vector center = vector_of(sphere->center_radius);
    const PairVector to_center = pair_vector_difference(center, ray->origin); // -f
    SphereQuadratic quadratic;
    quadratic.b = -pair_vector_dot_once(to_center, ray->direction);
    if (has_eye_power(sphere->id)) {
        quadratic.c = eye_power_at(sphere->id, center, ray->origin);
    } else {
        const Pair rr = two_product((real)(sphere->center_radius.w), (real)(sphere->center_radius.w));
        PairVector twice_low = to_center;
        twice_low.x.low *= 2;
        twice_low.y.low *= 2;
        twice_low.z.low *= 2;
        quadratic.c = power_sum((Pair){-rr.high, -rr.low}, pair_vector_high(to_center), twice_low);
    }
    quadratic.discriminant = difference_of_products(quadratic.b, quadratic.b, ray->squared, quadratic.c);
    return quadratic;
}

// Sets the quadratic for all rays. Far from the closest approach the discriminant is a r^2 - |E|^2
// (Lagrange's identity), off by about 10 u a r^2 at any distance.
static inline ALWAYS_INLINE void sphere_quadratic_set(SphereQuadratic *quadratic, const Sphere *sphere,
                                                      const Ray *ray)
{
    const real radius = (real)(sphere->center_radius.w);
    const PairVector to_center = pair_vector_difference(vector_of(sphere->center_radius), ray->origin);
    *quadratic = sphere_quadratic_near(sphere, ray);
    const Vector moment = quadratic->moment = pair_vector_cross_once(to_center, ray->direction);
    const mask is_far = !(quadratic->b * quadratic->b < ray->squared * radius * radius);
    real_replace(&quadratic->discriminant, is_far,
                 real_fma(ray->squared * radius, radius, -vector_dot(moment, moment)));
}

// Returns the lanes whose rays start outside the sphere and leave it outward. b and c are the coefficients
// of the textbook's test.
static inline mask leaves_sphere(real c, real squared_radius, real b, real tmin)
{
    return (c > 32 * UNIT_ROUNDOFF * squared_radius) & (b > 0) & (tmin >= 0);
}

// Tests whether rays leave spheres outward, as sphere_hit does. `from` is the start seen from the center.
static inline mask ray_leaves_sphere(Vector from, Vector direction, real tmin, real radius)
{
    const real squared_radius = radius * radius;
    return leaves_sphere(vector_dot(from, from) - squared_radius, squared_radius, vector_dot(from, direction),
                         tmin);
}

// Intersects a sphere after two conservative rejects. The first is b^2 - a c, divided by a to stay in range
// for any direction, with f . f lowered by more than all roundings (about 20 u), which costs no more than the
// textbook's test. The second rejects rays that leave the sphere outward.
//
// The plain form takes the line's closest point to the center, l = f - (b / a) d, and is off by about 1.4 u
// rho r at distance rho r (Haines, Gunther, Akenine-Moller, Precision improvements for ray/sphere
// intersection, Ray Tracing Gems, 2019, chapter 7). Within 0.4 radii of the surface c cancels, and both roots
// with it: up to 21 ulp at 1.1 radii, but 3.5 from c rounded once. There b^2 - a c also decides hit or miss,
// because |l|^2, off by about 3 u r^2, would break the horizon of a ground sphere. The compensated form
// rounds each number once.
static inline mask sphere_hit(const Sphere *sphere, const Ray *ray, real *t)
{
    Vector center = vector_of(sphere->center_radius);
    real radius = (real)(sphere->center_radius.w), squared_radius = radius * radius;
    Vector f = vector_subtract(ray->origin, center);
    real b = vector_dot(f, ray->direction), squared_distance = vector_dot(f, f);
    real lowered_c = real_fma(-radius, radius, squared_distance * (1 - 32 * UNIT_ROUNDOFF));
    mask hit = !(b * (b * ray->inverse_squared) < lowered_c);
    if (!lanes_any(hit)) return mask_none();
    hit = hit & RAY_ACTIVE(ray);

    real c = squared_distance - squared_radius;
    hit = hit & !leaves_sphere(c, squared_radius, b, ray->tmin);
    if (!lanes_any(hit)) return mask_none();

    real discriminant;
    if (IS_COMPENSATED) {
        SphereQuadratic compensated;
        sphere_quadratic_set(&compensated, sphere, ray);
        discriminant = compensated.discriminant;
        b = compensated.b;
        c = compensated.c;
        hit = hit & (discriminant >= 0);
    } else {
        Vector l = vector_fma(ray->direction, -b * ray->inverse_squared, f);
        real half_chord_squared = real_fma(radius, radius, -vector_dot(l, l));
        discriminant = ray->squared * half_chord_squared;
        mask hits = half_chord_squared >= 0, near_surface = hit & (fabs(c) < 0.5f * squared_distance);
        if (RARELY(lanes_any(near_surface))) {
            const SphereQuadratic compensated = sphere_quadratic_near(sphere, ray);
            real_replace(&b, near_surface, compensated.b);
            real_replace(&c, near_surface, compensated.c);
            real_replace(&discriminant, near_surface, compensated.discriminant);
            hits = lanes_select(near_surface, discriminant >= 0, hits);
        }
        hit = hit & hits;
    }
    *t = quadratic_first_root(ray, b, c, discriminant, sphere->id.y & IGNORES_FRONT_FACES);
    return hit & (*t > ray->tmin);
}

// Returns the outward normal. The compensated form is n = (l -+ h d) / r with l = d x E / a and h the root of
// the discriminant over a, which loses no bits with distance.
static inline Vector sphere_normal(const Sphere *sphere, const Ray *ray, real t)
{
    if (!IS_COMPENSATED) return vector_normalize(ray_point_from(ray, vector_of(sphere->center_radius), t));
    SphereQuadratic quadratic;
    sphere_quadratic_set(&quadratic, sphere, ray);
    real inverse = real_divide((real)(1), ray->squared);
    Vector l = vector_scale(vector_cross(quadratic.moment, ray->direction), inverse);
    real h = real_sqrt(real_max(quadratic.discriminant, (real)(0))) * inverse;
    mask far_side = real_fma(ray->squared, t, quadratic.b) > 0;
    return vector_normalize(vector_fma(ray->direction, lanes_select(far_side, h, -h), l));
}

static inline SurfacePoint sphere_surface_point(const Sphere *sphere, const Ray *ray, real t)
{
    Vector center = vector_of(sphere->center_radius);
    real radius = (real)(sphere->center_radius.w);
    Vector normal = sphere_normal(sphere, ray, t);
    SurfacePoint point =
        surface_point_make(vector_fma(normal, radius, center), normal, radius + vector_norm1(center));
    surface_point_move_to_ray(&point, ray, t, point.rounding_scale);
    return point;
}

// The power along the exact ray, over the direction's square, is t^2 + 2 middle t + start for a sphere with
// the eye's power. The bounds count the errors of the ray and of the center, which for `start` counts only by
// the origin's distance from the eye.
typedef struct {
    Bounded middle, start;
} BoundedPower;

static inline BoundedPower sphere_power_along(const Sphere *sphere, const Ray *ray)
{
    const Vector center = vector_of(sphere->center_radius), from = vector_subtract(ray->origin, center);
    const real u = (real)(UNIT_ROUNDOFF), power = eye_power_of(sphere->id), moved = ray->origin_error;
    const real size = vector_norm1(ray->origin), center_size = vector_norm1(center),
               sizes = size + center_size, distance = real_fma(16 * u, sizes, vector_norm1(from));
    const real turned = real_fma(ray->length, ray->direction_error, ray->ends_at_light ? moved : (real)(0));
    const Vector beyond = vector_fma(center, (real)(-2), ray->origin);
    const Bounded a = {ray->squared,
                       real_fma(turned, ray->length + ray->length + turned, 8 * u * ray->squared)};
    const Bounded b = {vector_dot(from, ray->direction),
                       real_fma(turned, distance + moved, ray->length * real_fma(8 * u, sizes, moved))};
    const Bounded c = {power + vector_dot(ray->origin, beyond),
                       real_fma(16 * u, real_fma(size, sizes + center_size, fabs(power)),
                                moved * (distance + distance + moved))};
    BoundedPower along = {bounded_quotient(b, a), bounded_quotient(c, a)};
    along.start.error = along.start.error + SMALLEST_RATIO; // its terms may underflow
    return along;
}

// A discriminant must exceed its error by this factor to be certain. The error of its root is at most the
// discriminant's over the root.
#define DISCRIMINANT_MIN ((real)(8))

// Returns the first hit of a sphere with the eye's power. The roots are start / q and q or -q for q =
// |middle| + sqrt(middle^2 - start), in which nothing cancels.
static inline CertainHit sphere_power_certain_hit(const Sphere *sphere, const Ray *ray, mask lanes,
                                                  mask leaves)
{
    const real u = (real)(UNIT_ROUNDOFF);
    const BoundedPower along = sphere_power_along(sphere, ray);
    const Bounded middle = along.middle, start = along.start;
    const real far_middle = fabs(middle.value);
    const Bounded discriminant = {real_fma(middle.value, middle.value, -start.value),
                                  real_fma(middle.error, far_middle + far_middle + middle.error,
                                           real_fma(8 * u, middle.value * middle.value, start.error))};
    // Whether the ray starts outside or inside, wherever between tmin and -tmin.
    const real change = 2.0625f * (far_middle + middle.error);
    const mask outside = start.value - start.error > change * -ray->tmin,
               inside = start.value + start.error < (change - ray->tmin) * ray->tmin;
    const mask misses =
                   (outside & (middle.value > middle.error)) | (discriminant.value < -discriminant.error),
               perhaps = lanes & !misses;
    if (!lanes_any(perhaps)) return certain_miss();

    const mask is_far = sphere->id.y & IGNORES_FRONT_FACES ? mask_all() : leaves | inside;
    const mask certain = perhaps & (discriminant.value > DISCRIMINANT_MIN * discriminant.error) &
                         (inside | ((outside | leaves) & (middle.value < -middle.error)));
    const real root = real_sqrt(lanes_select(certain, discriminant.value, (real)(1)));
    const Bounded q = {far_middle + root,
                       middle.error + real_fma(8 * u, root, real_divide(discriminant.error, root))};
    const Bounded size = {fabs(start.value), start.error};
    const Bounded t = bounded_select(is_far & (middle.value < 0), q, bounded_quotient(size, q));
    const real earliest =
        lanes_select(outside, real_divide(start.value - start.error, change), (real)(-LARGEST));
    const real low = lanes_select(certain, t.value - t.error, earliest),
               high = lanes_select(certain, t.value + t.error, NEVER);
    return certain_at(certain_crossing(ray, certain, perhaps, low, high), t.value);
}

// A ray that starts on the sphere crosses it again twice as far as the closest point, whose error counts
// twice, and a 20th more for the error of the start.
#define CHORD_END_ERRORS ((real)(2.1f))

static inline CertainHit sphere_certain_hit(const Sphere *sphere, const Ray *ray)
{
    mask leaves = ray_starts_on(ray, sphere->id.x);
    mask lanes = RAY_ACTIVE(ray) & !(leaves & ray->leaves_outward);
    if (!lanes_any(lanes)) return certain_miss();
    if (has_eye_power(sphere->id)) return sphere_power_certain_hit(sphere, ray, lanes, leaves);
    CertainSphere crossed =
        certain_sphere(vector_of(sphere->center_radius), (real)(sphere->center_radius.w), ray, lanes);
    if (!lanes_any(crossed.perhaps)) return certain_miss();
    real near = sphere_near(&crossed, ray), near_high = near + crossed.t_error;
    CertainHit hit =
        certain_crossing(ray, crossed.certain, crossed.perhaps, near - crossed.t_error, near_high);
    mask passed = crossed.perhaps;
    if (!(sphere->id.y & IGNORES_FRONT_FACES)) passed = passed & (near_high < ray->tmin);
    leaves = leaves & lanes;
    if (!lanes_any(passed | leaves)) return hit;
    real far = sphere_far(&crossed, ray), far_low = far - crossed.t_error, far_high = far + crossed.t_error;
    hit = certain_select(passed, certain_crossing(ray, crossed.certain, crossed.perhaps, far_low, far_high),
                         hit);
    if (!lanes_any(leaves)) return hit;
    // one crossing is the start, and the other lies twice as far as the closest point
    real t = 2 * crossed.middle_t, t_error = CHORD_END_ERRORS * crossed.middle_error;
    CertainHit other = certain_crossing(ray, leaves, leaves, real_max(t - t_error, far_low),
                                        real_min(t + t_error, far_high));
    return certain_select(leaves, other, hit);
}

static inline mask sphere_set_errors(const Sphere *sphere, const Ray *ray, real t, real position_error,
                                     SurfacePoint *point)
{
    point->curvature = real_divide((real)(1), (real)(sphere->center_radius.w));
    // the roundings of the point seen from the center
    real sizes = 4 * vector_norm1(vector_of(sphere->center_radius)) + 2 * vector_norm1(ray->origin);
    point->normal_error = UNIT_ROUNDOFF * point->curvature * sizes;
    return mask_none();
}

#endif
