#include "host/compile/rounding.h"

// GCC 12 at -O2 drops a conversion to float and back where it merges stores (-ftree-slp-vectorize); volatile
// keeps it.
double rounded(const Rounding *rounding, double value)
{
    if (rounding->is_double) return value;
    volatile float narrow = (float)value;
    return narrow;
}

Vector3 vector_rounded(const Rounding *rounding, Vector3 v)
{
    return (Vector3){rounded(rounding, v.x), rounded(rounding, v.y), rounded(rounding, v.z)};
}

Vector3 point_from_eye(const Rounding *rounding, Vector3 point)
{
    return vector_rounded(rounding, vector_subtract(point, rounding->eye));
}

Vector3 axis_scaled(Vector3 axis)
{
    int exponent;
    frexp(vector_largest(axis), &exponent);
    return (Vector3){ldexp(axis.x, -exponent), ldexp(axis.y, -exponent), ldexp(axis.z, -exponent)};
}

scalar4 normal_and_inverse_length(const Rounding *rounding, Vector3 normal)
{
    Vector3 scaled = vector_rounded(rounding, axis_scaled(normal));
    return scalar4_of(scaled, 1 / vector_length(scaled));
}
