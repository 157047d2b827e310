// Computes with linear RGB colors.
#ifndef COLOR_H
#define COLOR_H

#include "numerics/vector.h"

typedef Vector Color3;

static inline Color3 color_gray(real value)
{
    return (Color3){value, value, value};
}

static inline Color3 color_multiply(Color3 a, Color3 b)
{
    return (Color3){a.x * b.x, a.y * b.y, a.z * b.z};
}

static inline Color3 color_divide(Color3 color, real divisor)
{
    return (Color3){real_divide(color.x, divisor), real_divide(color.y, divisor),
                    real_divide(color.z, divisor)};
}

static inline Color3 color_add_weighted(Color3 sum, Color3 weight, Color3 color)
{
    return (Color3){real_fma(weight.x, color.x, sum.x), real_fma(weight.y, color.y, sum.y),
                    real_fma(weight.z, color.z, sum.z)};
}

// Returns the largest channel.
static inline real color_largest(Color3 color)
{
    return real_max_of_3(color.x, color.y, color.z);
}

#endif
