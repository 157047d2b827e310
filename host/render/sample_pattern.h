// Places the samples of a pixel, the same in every pixel and on every device.
#pragma once

#include <stdbool.h>
#include <stdint.h>

// Returns x and y of `count` samples, which range from -1 to 1 across the pixel, as doubles if `is_double`,
// else as floats. A single sample is at the center. The caller frees the array.
void *sample_pattern(uint32_t count, bool is_double);
