// Computes the 99.9th percentile.
#pragma once

#include <stddef.h>

// Returns the smallest of the magnitudes (none negative, none NaN) that 99.9% of them do not exceed, or 0 if
// there are none.
double percentile_999(const float *magnitudes, size_t count);
