// Where a pixel's samples lie: fixed, the same in every pixel, the same on every device.
#pragma once

#include <stdbool.h>
#include <stdint.h>

// x and y of each of `count` samples, from -1 to 1 across the pixel, in double where `wide`, else in float.
// One sample lies at the center. The caller frees.
void *sample_pattern(uint32_t count, bool wide);
