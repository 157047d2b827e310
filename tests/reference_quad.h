// Quadruple precision without a library: vectors and the square root.
#pragma once

#include "tests/reference.h"
#include <math.h>

static inline Quad3 quad3(Vector3 a)
{
    return (Quad3){a.x, a.y, a.z};
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

static inline Quad quad_minimum(Quad a, Quad b)
{
    return a < b ? a : b;
}

// The x87 or IEEE root, then two of Newton's steps, each of which doubles the bits.
static inline Quad quad_root(Quad a)
{
    if (!(a > 0)) return 0;
    Quad root = sqrtl((long double)a);
    root = (root + a / root) / 2;
    return (root + a / root) / 2;
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

// A unit vector square to the unit vector `a`.
static inline Quad3 quad3_beside(Quad3 a)
{
    Quad3 axis = quad3_least_axis(a);
    return quad3_unit(quad3_subtract(axis, quad3_scale(a, quad3_dot(axis, a))));
}
