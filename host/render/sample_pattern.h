// The positions of a pixel's samples: the same in every pixel and on every device.
#pragma once

#include <stdbool.h>
#include <stdint.h>

// x and y of each of `count` samples, from -1 to 1 across the pixel, in double where `is_double`, else in
// float. A single sample is at the center. Caller frees.
void *sample_pattern(uint32_t count, bool is_double);
