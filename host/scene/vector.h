// Numbers and vectors in double.
#pragma once

#include <float.h>
#include <math.h>
#include <stdbool.h>

#if FLT_EVAL_METHOD != 0 || defined(__FAST_MATH__)
#error "glint needs IEEE arithmetic: no -ffast-math, and on 32-bit x86 -msse2 -mfpmath=sse"
#endif

typedef struct {
    double sum, error; // exactly what was added
} ExactSum;

// Returns a sum with its error (Knuth, The Art of Computer Programming 2, 4.2.2).
static inline ExactSum two_sum(double a, double b)
{
    const double sum = a + b, part = sum - a;
    return (ExactSum){sum, (a - (sum - part)) + (b - part)};
}

// Returns a number rounded to float. GCC 12 at -O2 drops a conversion to float and back where it merges
// stores
// (-ftree-slp-vectorize); volatile keeps it.
static inline double rounded_to_float(double value)
{
    volatile float single = (float)value;
    return single;
}

typedef struct {
    double x, y, z;
} Vector3;

// Returns the vector of three consecutive numbers, such as a pixel of a film.
static inline Vector3 vector_from(const double parts[3])
{
    return (Vector3){parts[0], parts[1], parts[2]};
}

static inline Vector3 vector_all(double component)
{
    return (Vector3){component, component, component};
}

static inline Vector3 vector_add(Vector3 a, Vector3 b)
{
    return (Vector3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline Vector3 vector_subtract(Vector3 a, Vector3 b)
{
    return (Vector3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline Vector3 vector_scale(Vector3 a, double factor)
{
    return (Vector3){a.x * factor, a.y * factor, a.z * factor};
}

// Multiplies component by component.
static inline Vector3 vector_multiply(Vector3 a, Vector3 b)
{
    return (Vector3){a.x * b.x, a.y * b.y, a.z * b.z};
}

// Return the lesser or the greater of each component.
static inline Vector3 vector_min(Vector3 a, Vector3 b)
{
    return (Vector3){b.x < a.x ? b.x : a.x, b.y < a.y ? b.y : a.y, b.z < a.z ? b.z : a.z};
}

static inline Vector3 vector_max(Vector3 a, Vector3 b)
{
    return (Vector3){b.x > a.x ? b.x : a.x, b.y > a.y ? b.y : a.y, b.z > a.z ? b.z : a.z};
}

// Returns the largest of the components' magnitudes.
static inline double vector_largest(Vector3 a)
{
    return fmax(fabs(a.x), fmax(fabs(a.y), fabs(a.z)));
}

static inline double vector_mean(Vector3 a)
{
    return (a.x + a.y + a.z) / 3;
}

// Returns whether no component is NaN or has a magnitude above `largest`.
static inline bool vector_is_within(Vector3 a, double largest)
{
    return fabs(a.x) <= largest && fabs(a.y) <= largest && fabs(a.z) <= largest;
}

static inline double vector_dot(Vector3 a, Vector3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline Vector3 vector_cross(Vector3 a, Vector3 b)
{
    return (Vector3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Returns the normal, whose length is twice the triangle's area.
static inline Vector3 triangle_normal(Vector3 a, Vector3 b, Vector3 c)
{
    return vector_cross(vector_subtract(b, a), vector_subtract(c, a));
}

// Returns `a` divided by 2^exponent, the least power of two above its largest component. Returns the zero
// vector unchanged.
static inline Vector3 vector_scaled_down(Vector3 a, int *exponent)
{
    frexp(vector_largest(a), exponent);
    return (Vector3){ldexp(a.x, -*exponent), ldexp(a.y, -*exponent), ldexp(a.z, -*exponent)};
}

// Returns the length, without overflow or underflow. Does not call hypot, which differs in the last bit
// between processors.
static inline double vector_length(Vector3 a)
{
    const double square = vector_dot(a, a);
    if (square > 0x1p-900 && square < 0x1p900) return sqrt(square);
    int exponent;
    const Vector3 scaled = vector_scaled_down(a, &exponent);
    return ldexp(sqrt(vector_dot(scaled, scaled)), exponent);
}

static inline double hypotenuse(double a, double b)
{
    return vector_length((Vector3){a, b, 0});
}

// Returns the unit vector, without overflow or underflow, or zero for the zero vector.
static inline Vector3 vector_normalize(Vector3 a)
{
    if (vector_largest(a) == 0) return a;
    int exponent;
    const Vector3 scaled = vector_scaled_down(a, &exponent);
    return vector_scale(scaled, 1 / sqrt(vector_dot(scaled, scaled)));
}

static inline bool vector_is_zero(Vector3 a)
{
    return a.x == 0 && a.y == 0 && a.z == 0;
}

static inline bool vectors_equal(Vector3 a, Vector3 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

// Returns the world axis least aligned with a direction, or the first of x, y and z if several are.
static inline Vector3 vector_least_aligned_axis(Vector3 direction)
{
    double x = fabs(direction.x), y = fabs(direction.y), z = fabs(direction.z);
    if (x <= y && x <= z) return (Vector3){1, 0, 0};
    if (y <= z) return (Vector3){0, 1, 0};
    return (Vector3){0, 0, 1};
}
