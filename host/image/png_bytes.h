// Encodes 8-bit images as PNG in memory, for files that embed images.
#pragma once

#include "host/base/text.h"
#include <stdint.h>

// `pixels`: 3 sRGB values per pixel, or a palette index; rows from the top. A failure of libpng is a fault.
void png_bytes_append(Text *png, const uint8_t *pixels, uint32_t width, uint32_t height,
                      const uint8_t (*palette)[3], uint32_t palette_count);
