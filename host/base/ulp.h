// The unit in the last place.
#pragma once

#include <math.h>

// Returns an ulp of a normal number with this many significant bits: 24 for float, 53 for double.
static inline double ulp_of(double value, int significant_bits)
{
    int exponent;
    frexp(value, &exponent);
    return ldexp(1, exponent - significant_bits);
}
