#include "host/compile/rounding.h"

scalar4 normal_and_inverse_length(const Rounding *rounding, Vector3 normal)
{
    Vector3 scaled = vector_rounded(rounding, axis_scaled(normal));
    return scalar4_of(scaled, 1 / vector_length(scaled));
}
