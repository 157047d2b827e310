// What nearly all of many magnitudes do not exceed.
#pragma once

#include <stddef.h>

// The smallest of the magnitudes (none negative, none NaN) that 99.9 % of them are no larger than; 0 of none.
double percentile_999(const float *magnitudes, size_t count);
