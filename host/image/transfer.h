// Converts linear values to display values, whole rows at a time.
#pragma once

#include "host/image/image.h"

// Writes `count` values as image_quantize returns them: one byte each, or two in big-endian order (as in PNG
// and PPM) if `bits` is 16.
void transfer_quantize(uint8_t *bytes, const float *values, size_t count, Transfer transfer, unsigned bits);
