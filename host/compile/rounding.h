// The scene's numbers in the kernel's precision and relative to the eye.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/scene/quad.h"
#include <string.h>

typedef struct {
    Vector3 eye;
    bool is_double; // the kernel's precision is double: numbers stay
    bool has_eye;   // rays start there, or where they lead; else anywhere
    bool is_local;  // numbers are a shared mesh's, in its own space
    bool certifies; // bounds are by the eye's power where the eye is near, for the shape's size
} Rounding;

// The eye is near a shape if it is within this part of the shape's size.
#define NEAR_EYE 0x1p-6

static inline double rounded(const Rounding *rounding, double value)
{
    return rounding->is_double ? value : rounded_to_float(value);
}

static inline Vector3 vector_rounded(const Rounding *rounding, Vector3 v)
{
    return (Vector3){rounded(rounding, v.x), rounded(rounding, v.y), rounded(rounding, v.z)};
}

static inline Vector3 point_from_eye(const Rounding *rounding, Vector3 point)
{
    return vector_rounded(rounding, vector_subtract(point, rounding->eye));
}

static inline double roundoff_of(const Rounding *rounding) // half an ulp of 1
{
    return (rounding->is_double ? DBL_EPSILON : FLT_EPSILON) / 2;
}

static inline Quad3 exact_from_eye(const Rounding *rounding, Vector3 point)
{
    return quad3_subtract(quad3(point), quad3(rounding->eye));
}

// Returns the same direction, scaled exactly by a power of two so that its largest component lies in 1/2..1.
static inline Vector3 axis_scaled(Vector3 axis)
{
    const double largest = vector_largest(axis);
    if (!(largest > 0x1p-1000 && largest < 0x1p1000)) { // the power of two may not be a double
        int exponent;
        return vector_scaled_down(axis, &exponent);
    }
    uint64_t bits;
    memcpy(&bits, &largest, sizeof bits);
    bits = (2045 - (bits >> 52)) << 52; // biased exponents
    double scale;
    memcpy(&scale, &bits, sizeof scale);
    return vector_scale(axis, scale);
}

// Returns a plane's normal, not unit, with one over its length in w.
static inline scalar4 normal_and_inverse_length(const Rounding *rounding, Vector3 normal)
{
    const Vector3 scaled = vector_rounded(rounding, axis_scaled(normal));
    return scalar4_of(scaled, 1 / vector_length(scaled));
}
