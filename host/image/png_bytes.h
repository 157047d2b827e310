// A small way to PNG: display values of 8 bits, whole, into memory, for what carries pictures within itself.
#pragma once

#include "host/base/text.h"
#include <stdint.h>

// `pixels`: 3 sRGB values a pixel, or where there is a palette an index into it; rows from the top. What
// libpng cannot do is a fault.
void png_bytes_append(Text *png, const uint8_t *pixels, uint32_t width, uint32_t height,
                      const uint8_t (*palette)[3], uint32_t palette_count);
