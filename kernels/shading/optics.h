// Implements the laws of reflection and refraction at a surface.
#ifndef OPTICS_H
#define OPTICS_H

#include "numerics/vector.h"

// Reflects a unit direction at a unit normal.
static inline Vector vector_reflect(Vector direction, Vector normal)
{
    real away = vector_dot(direction, normal);
    return vector_renormalize(vector_fma(normal, -2 * away, direction));
}

// Returns the square under the root of vector_refract, which is c^2 + k for s = c on entering a body of
// index n, and s^2 - k for s = n c on leaving it. It is negative in total internal reflection.
static inline real refraction_squared(real s, mask entering, real ior)
{
    real above_one = lanes_select(entering, 1 - ior, ior - 1);
    return difference_of_products(s, s, above_one, ior + 1);
}

// Returns (a - b) / (a + b) for a and b >= 0, and 0 where both are 0.
static inline real relative_difference(real a, real b)
{
    return real_divide(a - b, real_max(a + b, (real)(SMALLEST_RATIO)));
}

// Returns the fraction of unpolarized light that a body of index n reflects, from outside or inside, by
// Fresnel's equations (Born, Wolf, Principles of Optics, 1999, section 1.5.2); 1 in total internal
// reflection. With the s of refraction_squared and the root r the amplitudes are (s - r) / (s + r) and
// (n^2 s - r) / (n^2 s + r) on entering, (s - n^2 r) / (s + n^2 r) on leaving.
static inline real fresnel_reflectance(Vector direction, Vector normal, mask entering, real ior)
{
    const real one = (real)(1), zero = (real)(0);
    real cosine = real_max(-vector_dot(direction, normal), zero);
    real s = lanes_select(entering, cosine, ior * cosine), squared = refraction_squared(s, entering, ior);
    real root = real_sqrt(real_max(squared, zero));
    real across = relative_difference(s, root);
    real along = relative_difference(s * lanes_select(entering, ior * ior, one),
                                     root * lanes_select(entering, one, ior * ior));
    real reflectance = 0.5f * real_fma(across, across, along * along);
    return lanes_select(squared < zero, one, reflectance);
}

// Returns the fraction of unpolarized light that a conductor reflects, for the cosine c and the sine s of
// the angle. With (a + i b)^2 = (n + i k)^2 - s^2 the fraction of light across the plane of incidence is
// (a^2 + b^2 - 2 a c + c^2) / (a^2 + b^2 + 2 a c + c^2), and along it that times
// (c^2 (a^2 + b^2) - 2 a c s^2 + s^4) / (c^2 (a^2 + b^2) + 2 a c s^2 + s^4) (Born, Wolf, section 14.2). The
// smaller of a^2 and b^2 is computed from their product, which does not cancel.
static inline real conductor_channel(real cosine, real index_real, real index_imaginary_squared)
{
    const real zero = (real)(0), one_half = (real)(0.5f);
    const real cosine_squared = cosine * cosine, sine_squared = 1 - cosine_squared;
    real difference = index_real - sine_squared;                                     // a^2 - b^2
    real sum = real_sqrt(real_fma(difference, difference, index_imaginary_squared)); // a^2 + b^2
    real larger = one_half * (sum + fabs(difference));
    real smaller = real_divide(0.25f * index_imaginary_squared, real_max(larger, (real)(SMALLEST_RATIO)));
    real twice_a_c = (cosine + cosine) * real_sqrt(lanes_select(difference < zero, smaller, larger));
    real across = real_max(relative_difference(sum + cosine_squared, twice_a_c), zero);
    real rest = relative_difference(real_fma(cosine_squared, sum, sine_squared * sine_squared),
                                    twice_a_c * sine_squared);
    return one_half * across * (1 + real_max(rest, zero));
}

// Refracts a unit direction by Snell's law at a unit normal that faces it. Returns the lanes of total
// internal reflection. With k = (n - 1)(n + 1) and the cosine c, the ray into a body of index n runs along d
// + N (c - sqrt(c^2 + k)), and the ray out of it along n d + N (n c - sqrt((n c)^2 - k)). In this form
// grazing rays survive if n is near 1, and n = 1 bends nothing however inexact a device's division is.
static inline mask vector_refract(Vector direction, Vector normal, mask entering, real ior, Vector *refracted)
{
    real scale = lanes_select(entering, (real)(1), ior);
    real scaled = scale * -vector_dot(direction, normal);
    real squared = refraction_squared(scaled, entering, ior);
    mask total = squared < 0;
    real cosine = real_sqrt(real_max(squared, (real)(0)));
    *refracted = vector_normalize(vector_fma(normal, scaled - cosine, vector_scale(direction, scale)));
    return total;
}

#endif
