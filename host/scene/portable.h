// Functions of a double whose values reach the flat arrays. The C library's own functions differ in the last
// bit between processors, and on one processor between sets of instructions. Rounded from 113 bits they give
// the nearest double, except in about one case of 2^59, so that a scene has the same arrays everywhere.
#pragma once

#include "host/scene/quad.h"
#include "host/scene/vector.h"

static inline double portable_sine(double angle)
{
    return (double)QUAD_CALL(sin)((Quad)angle);
}

static inline double portable_cosine(double angle)
{
    return (double)QUAD_CALL(cos)((Quad)angle);
}

static inline double portable_tangent(double angle)
{
    return (double)QUAD_CALL(tan)((Quad)angle);
}

// Returns a vector turned about a unit axis by an angle in radians, right-handed (Rodrigues, 1840).
static inline Vector3 vector_rotated(Vector3 v, Vector3 axis, double angle)
{
    const double cosine = portable_cosine(angle);
    const Vector3 along = vector_scale(axis, vector_dot(axis, v) * (1 - cosine));
    const Vector3 across = vector_scale(vector_cross(axis, v), portable_sine(angle));
    return vector_add(vector_add(vector_scale(v, cosine), across), along);
}

static inline double portable_log2(double value)
{
    return (double)QUAD_CALL(log2)((Quad)value);
}
