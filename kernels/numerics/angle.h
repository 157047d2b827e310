// Computes angles from + - * / and sqrt alone, so that every device gives the same bits.
#ifndef ANGLE_H
#define ANGLE_H

#include "numerics/vector.h"

// 2 pi, and 2 / pi.
#if IS_DOUBLE
#define TURN                 0x1.921fb54442d18p+2
#define INVERSE_QUARTER_TURN 0x1.45f306dc9c883p-1
#else
#define TURN                 0x1.921fb6p+2f
#define INVERSE_QUARTER_TURN 0x1.45f306p-1f
#endif

// Returns the angle from the first axis to (x, y) in turns, -1/2 to 1/2, or 0 for (0, 0). Its error is below
// u of a turn and below a relative error of 8 u (at most 0.84 and 7.1 in 20 million directions). Halving the
// angle twice, tan(a/2) = tan a / (1 + sqrt(1 + tan^2 a)), brings the tangent below 0.2, where Taylor's
// series is short (Abramowitz, Stegun, Handbook of Mathematical Functions, 4.4.42).
static inline real real_turns(real x, real y)
{
    real along = fabs(x), across = fabs(y);
    real larger = real_max(along, across), smaller = real_min(along, across);
    real tangent = real_divide(smaller, lanes_select(larger == 0, (real)(1), larger));
    for (uint halving = 0; halving < 2; halving++)
        tangent = real_divide(tangent, 1 + real_sqrt(real_fma(tangent, tangent, (real)(1))));
    real squared = tangent * tangent, series = series_of_odd_reciprocals(-squared, 25);
    real turns = real_fma(-(tangent * squared), series, tangent) * INVERSE_QUARTER_TURN;
    turns = lanes_select(across > along, 0.25f - turns, turns);
    turns = lanes_select(x < 0, 0.5f - turns, turns);
    return lanes_select(y < 0, -turns, turns);
}

// Returns the sine of an angle in turns, -1/4 to 1/4, by Taylor's series up to a^21 / 21! (Abramowitz,
// Stegun, 4.3.65), whose remainder is below 2^-59.
static inline real real_sine_of_turns(real turns)
{
#if IS_DOUBLE
#define ONE 1.0
#else
#define ONE 1.0f
#endif
    const real angle = turns * TURN, squared = angle * angle;
    real series = (real)(1);
    // The factor from a term to the next one, from literals, since a device's quotients may be inexact.
#define SERIES_STEP(n) series = real_fma(-squared * (real)(ONE / n), series, (real)(1))
    SERIES_STEP(420);
    SERIES_STEP(342);
    SERIES_STEP(272);
    SERIES_STEP(210);
    SERIES_STEP(156);
    SERIES_STEP(110);
    SERIES_STEP(72);
    SERIES_STEP(42);
    SERIES_STEP(20);
#undef SERIES_STEP
    return real_fma(-angle * squared * (ONE / 6), series, angle);
#undef ONE
}

// Returns the unit vector at an angle of -1/2 to 1/2 turns from the unit vector `forward` towards `right`,
// which is across it.
static inline Vector vector_of_turns(Vector forward, Vector right, real turns)
{
    const real quarter = (real)(0.25f), half_turn = (real)(0.5f);
    real away = fabs(turns), sine = real_sine_of_turns(real_min(away, half_turn - away));
    return vector_fma(right, lanes_select(turns < 0, -sine, sine),
                      vector_scale(forward, real_sine_of_turns(quarter - away)));
}

#endif
