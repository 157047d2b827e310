// Encodes 8-bit images as PNG in memory, for files that embed images.
#pragma once

#include "host/base/text.h"
#include <stdint.h>

// Appends the image as PNG. `pixels` has 3 sRGB values or a palette index per pixel, with rows from the top.
// A failure of libpng is a fault.
void png_bytes_append(Text *png, const uint8_t *pixels, uint32_t width, uint32_t height,
                      const uint8_t (*palette)[3], uint32_t palette_count);
