// Intervals of t.
#ifndef INTERVAL_H
#define INTERVAL_H

#include "numerics/numerics.h"

typedef struct {
    real near, far; // empty if near > far
} Interval;

static inline real interval_clamp(Interval interval, real t)
{
    return real_min(real_max(t, interval.near), interval.far);
}

#endif
