// Intervals of t.
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
    return (real)(0.5f) * (interval.near + interval.far);
}

static inline real interval_clamp(Interval interval, real t)
{
    return real_clamp(t, interval.near, interval.far);
}

#endif
