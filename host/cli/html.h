// Pieces of HTML: texts made safe, numbers set as in print.
#pragma once

#include "host/base/text.h"
#include <stdint.h>

// Any bytes as text, also within a quoted attribute. What is not UTF-8 becomes U+FFFD.
void html_text(Text *page, const char *text);
// Three digits; beyond 0.01 and 10,000 two of them and a power of ten: 3.1·10⁻⁶. Infinity: ∞; NaN: not
// finite.
void html_number(Text *page, double value);
// Digits in groups of three: 921 600.
void html_count(Text *page, uint64_t count);
void html_power_of_ten(Text *page, int exponent);
// A PNG file as an address that holds it.
void html_png_address(Text *page, const uint8_t *pixels, uint32_t width, uint32_t height,
                      const uint8_t (*palette)[3], uint32_t palette_count);
