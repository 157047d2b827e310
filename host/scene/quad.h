// Quadruple precision: numbers, vectors and functions.
#pragma once

#include "host/scene/vector.h"
#include <float.h>

// A Quad has 113 bits where the compiler and the C library support them, otherwise as many as a long double.
// Reports state QUAD_BITS. QUAD_CALL(sin) is the C library's sine of a Quad.
#if LDBL_MANT_DIG < 113 && defined(__SIZEOF_FLOAT128__) && defined(__GLIBC__)
__extension__ typedef __float128 Quad;
enum { QUAD_BITS = 113 };
#define QUAD_CALL(function) function##f128
// glibc has these functions on every x86, but its header does not declare them for clang.
Quad acosf128(Quad), atan2f128(Quad, Quad), cosf128(Quad), floorf128(Quad), fmodf128(Quad, Quad),
    log2f128(Quad), powf128(Quad, Quad), roundf128(Quad), sinf128(Quad), sqrtf128(Quad), tanf128(Quad);
#else
typedef long double Quad;
enum { QUAD_BITS = LDBL_MANT_DIG };
#define QUAD_CALL(function) function##l
#endif

typedef struct {
    Quad x, y, z;
} Quad3;

static inline Quad3 quad3(Vector3 a)
{
    return (Quad3){a.x, a.y, a.z};
}

static inline Vector3 quad3_rounded(Quad3 a)
{
    return (Vector3){(double)a.x, (double)a.y, (double)a.z};
}

static inline Quad3 quad3_add(Quad3 a, Quad3 b)
{
    return (Quad3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline Quad3 quad3_subtract(Quad3 a, Quad3 b)
{
    return (Quad3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline Quad3 quad3_scale(Quad3 a, Quad factor)
{
    return (Quad3){a.x * factor, a.y * factor, a.z * factor};
}

static inline Quad quad3_dot(Quad3 a, Quad3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline Quad3 quad3_cross(Quad3 a, Quad3 b)
{
    return (Quad3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Returns the normal, whose length is twice the triangle's area.
static inline Quad3 quad3_triangle_normal(Quad3 a, Quad3 b, Quad3 c)
{
    return quad3_cross(quad3_subtract(b, a), quad3_subtract(c, a));
}

static inline Quad quad_absolute(Quad a)
{
    return a < 0 ? -a : a;
}

// Returns the sum of |a_i b_i|, to which rounding errors of a . b are proportional.
static inline Quad quad3_dot_magnitude(Quad3 a, Quad3 b)
{
    return quad_absolute(a.x * b.x) + quad_absolute(a.y * b.y) + quad_absolute(a.z * b.z);
}

static inline Quad quad_minimum(Quad a, Quad b)
{
    return a < b ? a : b;
}

static inline Quad quad_maximum(Quad a, Quad b)
{
    return a > b ? a : b;
}

// Returns the square root, 0 where `a` is negative, or NaN where it is NaN. With a = near^2 + rest, the root
// is near + rest / (near + root), and near + root is 2 near + rest / (2 near) to three times the bits of a
// double. This takes half the time of the C library's function, which handles values outside the range of a
// double. A start from a long double would give different last bits on different processors.
static inline Quad quad_root(Quad a)
{
    if (a <= 0) return 0;
    if (!(a > 0x1p-900 && a < 0x1p900)) return QUAD_CALL(sqrt)(a);
    const double near = sqrt((double)a);
    const Quad rest = a - (Quad)near * near;
    return near + rest / (2 * near + (double)rest / (2 * near));
}

static inline Quad quad3_length(Quad3 a)
{
    return quad_root(quad3_dot(a, a));
}

// Returns the unit vector, or zero for the zero vector.
static inline Quad3 quad3_unit(Quad3 a)
{
    Quad length = quad3_length(a);
    return length > 0 ? quad3_scale(a, 1 / length) : a;
}

// Returns the world axis least aligned with `a`, or the first if several are.
static inline Quad3 quad3_least_axis(Quad3 a)
{
    Quad x = quad_absolute(a.x), y = quad_absolute(a.y), z = quad_absolute(a.z);
    if (x <= y && x <= z) return (Quad3){1, 0, 0};
    return y <= z ? (Quad3){0, 1, 0} : (Quad3){0, 0, 1};
}

// Returns a unit vector perpendicular to the unit vector `a`.
static inline Quad3 quad3_perpendicular(Quad3 a)
{
    Quad3 axis = quad3_least_axis(a);
    return quad3_unit(quad3_subtract(axis, quad3_scale(a, quad3_dot(axis, a))));
}
