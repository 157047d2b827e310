// Quadruple precision without a library: numbers, vectors and the square root.
#pragma once

#include "host/scene/vector.h"
#include <float.h>

// Of 113 bits wherever the compiler has them, else a long double.
#if LDBL_MANT_DIG >= 113 || !defined(__SIZEOF_FLOAT128__)
typedef long double Quad;
enum { QUAD_BITS = LDBL_MANT_DIG };
#else
__extension__ typedef __float128 Quad;
enum { QUAD_BITS = 113 };
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

static inline Quad quad_absolute(Quad a)
{
    return a < 0 ? -a : a;
}

// The sum of |a_i b_i|: what roundings of a . b are proportional to.
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

// The root in long double, then one of Newton's steps, which doubles its bits; as long double has the same
// range, one more where its bits are not enough.
static inline Quad quad_root(Quad a)
{
    if (!(a > 0)) return 0;
    Quad root = sqrtl((long double)a);
    root = (root + a / root) / 2;
    return LDBL_MANT_DIG > QUAD_BITS / 2 ? root : (root + a / root) / 2;
}

static inline Quad quad3_length(Quad3 a)
{
    return quad_root(quad3_dot(a, a));
}

// The zero vector stays zero.
static inline Quad3 quad3_unit(Quad3 a)
{
    Quad length = quad3_length(a);
    return length > 0 ? quad3_scale(a, 1 / length) : a;
}

// The world axis least aligned with `a`; the first of equals.
static inline Quad3 quad3_least_axis(Quad3 a)
{
    Quad x = quad_absolute(a.x), y = quad_absolute(a.y), z = quad_absolute(a.z);
    if (x <= y && x <= z) return (Quad3){1, 0, 0};
    return y <= z ? (Quad3){0, 1, 0} : (Quad3){0, 0, 1};
}

// A unit vector perpendicular to the unit vector `a`.
static inline Quad3 quad3_perpendicular(Quad3 a)
{
    Quad3 axis = quad3_least_axis(a);
    return quad3_unit(quad3_subtract(axis, quad3_scale(a, quad3_dot(axis, a))));
}
