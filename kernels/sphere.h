// Sphere.
#ifndef SPHERE_H
#define SPHERE_H

#include "quadratic.h"

// a r^2 - |E|^2 for the line's moment E = f x d and a = d . d.
static inline Pair sphere_discriminant(real radius, Pair a, PairVector moment)
{
    return pair_subtract(pair_multiply(a, pair_product(radius, radius)), pair_vector_dot(moment, moment));
}

// The cheap form measures how far the line passes from the center, l = f - (b / a) d, and is off by about 1.4
// u rho r at distance rho r (Haines, Gunther, Akenine-Moller, Precision improvements for ray/sphere
// intersection, Ray Tracing Gems, 2019, chapter 7). The compensated form takes the discriminant from the
// line's moment E = f x d, a r^2 - |E|^2 by Lagrange's identity, in pairs: its error does not grow with the
// distance. It first asks the cheap form, whose bound rejects most rays.
static inline mask sphere_hit(const Sphere *sphere, const Ray *ray, real *t)
{
    Vector center = vector_of(sphere->center_radius);
    real radius = (real)(sphere->center_radius.w);
    Vector f = vector_subtract(ray->origin, center);
    real b = vector_dot(f, ray->direction);
    Vector l = vector_fma(ray->direction, -b * ray->inverse_squared, f);
    real half_chord_squared = fma(radius, radius, -vector_dot(l, l));

    real doubt = (real)(0);
    if (IS_COMPENSATED) {
        // both l and f are off by a few u |f|; |l| is about the radius where it matters
        real reach =
            vector_magnitude(f) + fabs(radius) + vector_magnitude(ray->origin) + vector_magnitude(center);
        doubt = (real)(16 * UNIT_ROUNDOFF) * reach * (radius + (real)(16 * UNIT_ROUNDOFF) * reach);
    }
    mask hit = ray->active & (half_chord_squared >= -doubt);
    if (!lanes_any(hit)) return mask_none();

    Roots roots;
    if (IS_COMPENSATED) {
        PairVector exact_f = pair_vector_difference(ray->origin, center);
        PairVector moment = pair_vector_cross(exact_f, ray->direction);
        Pair a = pair_vector_dot(pair_vector_of(ray->direction), pair_vector_of(ray->direction));
        Pair discriminant = sphere_discriminant(radius, a, moment);
        Pair c = pair_subtract(pair_vector_dot(exact_f, exact_f), pair_product(radius, radius));
        real exact_b = pair_vector_dot_vector(exact_f, ray->direction).high;
        hit = hit & (discriminant.high >= (real)(0));
        roots = quadratic_roots(a.high, exact_b, c.high, discriminant.high);
    } else {
        real c = fma(-radius, radius, vector_dot(f, f));
        real discriminant = ray->squared * half_chord_squared;
        // Within a 32nd of the radius of the surface c cancels, and both roots with it: pairs instead. A ray
        // that leaves outward needs none.
        real squared_radius = radius * radius;
        mask leaves = (b > (real)(0)) & (c > (real)(8 * UNIT_ROUNDOFF) * squared_radius);
        mask beside = hit & !leaves & (fabs(c) < (real)(0x1p-4f) * squared_radius);
        if (lanes_any(beside)) {
            PairVector exact_f = pair_vector_difference(ray->origin, center);
            Pair exact_c = pair_subtract(pair_vector_dot(exact_f, exact_f), pair_product(radius, radius));
            real exact_b = pair_vector_dot_vector(exact_f, ray->direction).high;
            b = lanes_select(beside, exact_b, b);
            c = lanes_select(beside, exact_c.high, c);
            discriminant = lanes_select(beside, product_difference(b, b, ray->squared, c), discriminant);
        }
        roots = quadratic_roots(ray->squared, b, c, discriminant);
    }
    *t = sphere->id.y & ONLY_INSIDE ? roots.far : ray_first(ray, roots.near, roots.far);
    return hit & (*t > ray->near);
}

// The compensated normal is built from the moment as well, n = (l -+ h d) / r with l = d x E / a and h the
// root of the discriminant over a, so that it does not lose bits with the distance, nor at a low angle to a
// large sphere; the point is the center plus r n.
static inline Patch sphere_patch(const Sphere *sphere, const Ray *ray, real t)
{
    Vector center = vector_of(sphere->center_radius);
    real radius = (real)(sphere->center_radius.w);
    Vector outward;
    if (IS_COMPENSATED) {
        PairVector f = pair_vector_difference(ray->origin, center);
        PairVector moment = pair_vector_cross(f, ray->direction);
        Pair a = pair_vector_dot(pair_vector_of(ray->direction), pair_vector_of(ray->direction));
        real discriminant = real_max(sphere_discriminant(radius, a, moment).high, (real)(0));
        Vector l = vector_scale(vector_cross(ray->direction, pair_vector_high(moment)),
                                real_divide((real)(1), ray->squared));
        real h = real_divide(real_sqrt(discriminant), ray->squared);
        real b = pair_vector_dot_vector(f, ray->direction).high;
        mask far_side = fma(ray->squared, t, b) > (real)(0);
        outward = vector_fma(ray->direction, lanes_select(far_side, h, -h), l);
    } else {
        outward = vector_fma(ray->direction, t, vector_subtract(ray->origin, center));
    }
    Vector normal = vector_normalize(outward);
    return patch_make(vector_fma(normal, radius, center), normal, radius + vector_magnitude(center));
}

#endif
