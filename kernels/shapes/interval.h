// Computes with intervals of t.
#ifndef INTERVAL_H
#define INTERVAL_H

#include "numerics/numerics.h"

typedef struct {
    real near, far; // empty if near > far
} Interval;

static inline Interval intervals_common(Interval a, Interval b)
{
    return (Interval){real_max(a.near, b.near), real_min(a.far, b.far)};
}

// Returns the distance from t to the nearer end.
static inline real interval_end_distance(Interval interval, real t)
{
    return real_min(fabs(t - interval.near), fabs(t - interval.far));
}

static inline real interval_middle(Interval interval)
{
    return 0.5f * (interval.near + interval.far);
}

static inline real interval_clamp(Interval interval, real t)
{
    return real_clamp(t, interval.near, interval.far);
}

// Returns the interval of t where the ray is between low and high on one axis. A direction of exactly 0, of
// either sign, is always or never between them, which comparisons decide, since 0 times infinity is NaN. At
// `certified` both planes are moved outward by `more`, and directions too small to divide by count as 0.
// `inverse` must be exact within 2 u unless `more` is 0.
static inline Interval slab_crossings(real low, real high, real more, real origin, real direction,
                                      real inverse)
{
    const real from = low - origin, to = high - origin;
    const mask parallel = IS_CERTIFIED ? fabs(direction) <= SMALLEST_RATIO : direction == 0;
    const mask between = (from <= more) & (to >= -more);
    real to_low = from * inverse, to_high = to * inverse;
    if (IS_COMPENSATED) {
        const real divisor = lanes_select(parallel, (real)(1), direction);
        to_low = real_divide(from, divisor);
        to_high = real_divide(to, divisor);
    }
    Interval crossings = {real_min(to_low, to_high), real_max(to_low, to_high)};
    if (IS_CERTIFIED) {
        const real more_t = more * fabs(inverse);
        crossings = (Interval){crossings.near - more_t, crossings.far + more_t};
    }
    const real always = lanes_select(between, (real)(LARGEST), (real)(-LARGEST));
    real_replace(&crossings.near, parallel, -always);
    real_replace(&crossings.far, parallel, always);
    return crossings;
}

#endif
