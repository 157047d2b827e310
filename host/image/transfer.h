// The way from linear values to display values, whole rows at a time.
#pragma once

#include "host/image/image.h"

// Writes `count` values as image_quantize gives them: a byte each, or two, the greater first (as PNG and PPM
// have them), where `bits` is 16.
void transfer_quantize(uint8_t *bytes, const float *values, size_t count, Transfer transfer, unsigned bits);
