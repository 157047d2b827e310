// Textbook torus: the quartic in t from the ray's start, by Ferrari (Schwarze, Cubic and quartic roots,
// Graphics Gems, 1990, with its threshold of 1e-9 for zero).
#ifndef TORUS_H
#define TORUS_H

#include "revolution.h"

static inline mask textbook_is_zero(real x)
{
    return fabs(x) < (real)(1e-9f);
}

// A real root of x^3 + a x^2 + b x + c.
static inline real cubic_root(real a, real b, real c)
{
    const real third = (real)(1.0f / 3);
    real aa = a * a;
    real p = third * (b - third * aa);
    real q = (real)(0.5f) * ((real)(2.0f / 27) * a * aa - third * a * b + c);
    real ppp = p * p * p;
    real discriminant = q * q + ppp;
    // three real roots
    real ratio = -q / sqrt(lanes_select(ppp < (real)(0), -ppp, (real)(1)));
    real three = (real)(2) * sqrt(real_max(-p, (real)(0))) *
                 cos(third * acos(real_min(real_max(ratio, (real)(-1)), (real)(1))));
    // one
    real root = sqrt(real_max(discriminant, (real)(0)));
    real one = cbrt(root - q) - cbrt(root + q);
    return lanes_select(discriminant < (real)(0), three, one) - third * a;
}

// Offers the real roots of y^2 + b y + c, moved by `shift`.
static inline void quadratic_offer(real b, real c, real shift, mask counts, const Ray *ray, Nearest *nearest)
{
    real half_b = (real)(0.5f) * b;
    real discriminant = half_b * half_b - c;
    Roots roots = quadratic_roots((real)(1), half_b, real_max(discriminant, (real)(0)));
    mask real_roots = counts & (discriminant >= (real)(0));
    nearest_take(nearest, ray, roots.near - shift, real_roots);
    nearest_take(nearest, ray, roots.far - shift, real_roots);
}

static inline mask torus_hit(const Torus *torus, const Ray *ray, real *t)
{
    Vector axis = vector_of(torus->axis_minor);
    real major = (real)(torus->center_major.w), minor = (real)(torus->axis_minor.w);
    // |direction| = 1 makes the quartic's first coefficient 1
    real norm = sqrt(ray->squared), inverse_length = (real)(1) / norm;
    Vector d = vector_scale(ray->direction, inverse_length);
    Vector f = vector_subtract(ray->origin, vector_of(torus->center_major));
    real m = vector_dot(f, d), n = vector_dot(f, f);
    real z = vector_dot(f, axis), dz = vector_dot(d, axis);
    real k = n + major * major - minor * minor, four = (real)(4) * major * major;
    real a = (real)(4) * m;
    real b = (real)(4) * m * m + (real)(2) * k - four * ((real)(1) - dz * dz);
    real c = (real)(4) * m * k - (real)(2) * four * (m - z * dz);
    real e = k * k - four * (n - z * z);

    // x^4 + p x^2 + q x + r with x = t + a / 4
    real aa = a * a;
    real p = b - (real)(3.0f / 8) * aa;
    real q = (real)(1.0f / 8) * aa * a - (real)(0.5f) * a * b + c;
    real r = (real)(-3.0f / 256) * aa * aa + (real)(1.0f / 16) * aa * b - (real)(0.25f) * a * c + e;
    real shift = (real)(0.25f) * a;

    // two quadratics by a root of the resolvent cubic
    real y = cubic_root((real)(-0.5f) * p, -r, (real)(0.5f) * r * p - (real)(1.0f / 8) * q * q);
    real u = y * y - r, v = (real)(2) * y - p;
    mask splits =
        RAY_ACTIVE(ray) & (textbook_is_zero(u) | (u > (real)(0))) & (textbook_is_zero(v) | (v > (real)(0)));
    u = sqrt(real_max(u, (real)(0)));
    v = sqrt(real_max(v, (real)(0)));
    v = lanes_select(q < (real)(0), -v, v);
    Ray unit = *ray;
    unit.tmin = ray->tmin * norm;
    Nearest nearest = {*t, mask_none()};
    quadratic_offer(v, y - u, shift, splits, &unit, &nearest);
    quadratic_offer(-v, y + u, shift, splits, &unit, &nearest);
    *t = nearest.t * inverse_length;
    return nearest.found;
}

static inline SurfacePoint torus_surface_point(const Torus *torus, const Ray *ray, real t)
{
    Vector axis = vector_of(torus->axis_minor);
    real major = (real)(torus->center_major.w);
    Vector point = ray_point(ray, t);
    Vector p = vector_subtract(point, vector_of(torus->center_major));
    Vector radial = vector_normalize(vector_fma(axis, -vector_dot(p, axis), p));
    Vector normal = vector_normalize(vector_fma(radial, -major, p));
    return surface_point_make(point, normal, TEXTBOOK_SIZE);
}

#endif
