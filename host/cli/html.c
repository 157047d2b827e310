#include "host/cli/html.h"

#include "host/base/base64.h"
#include "host/image/png_bytes.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void html_text(Text *page, const char *text)
{
    for (size_t length = strlen(text), size; length > 0; text += size, length -= size) {
        size = text_character_size(text, length);
        const char *stand_in = size == 0      ? "\uFFFD"
                               : *text == '<' ? "&lt;"
                               : *text == '>' ? "&gt;"
                               : *text == '&' ? "&amp;"
                               : *text == '"' ? "&quot;"
                                              : NULL;
        if (stand_in)
            text_append(page, stand_in, strlen(stand_in));
        else
            text_append(page, text, size);
        if (size == 0) size = 1;
    }
}

void html_power_of_ten(Text *page, int exponent)
{
    static const char *const digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    char decimal[16];
    snprintf(decimal, sizeof decimal, "%d", exponent);
    text_appendf(page, "10");
    for (const char *at = decimal; *at; at++)
        text_appendf(page, "%s", *at == '-' ? "⁻" : digits[*at - '0']);
}

void html_number(Text *page, double value)
{
    if (isnan(value)) {
        text_appendf(page, "not finite");
        return;
    }
    if (signbit(value) && value != 0) text_appendf(page, "−");
    value = fabs(value);
    if (isinf(value)) {
        text_appendf(page, "∞");
    } else if (value == 0) {
        text_appendf(page, "0");
    } else if (value >= 0.01 && value < 9999.5) {
        text_appendf(page, "%.*f",
                     value < 0.09995  ? 4
                     : value < 0.9995 ? 3
                     : value < 9.995  ? 2
                     : value < 99.95  ? 1
                                      : 0,
                     value);
    } else {
        char rounded[32];
        snprintf(rounded, sizeof rounded, "%.1e", value);
        char *sign = strchr(rounded, 'e');
        text_appendf(page, "%.*s·", (int)(sign - rounded), rounded);
        html_power_of_ten(page, (int)strtol(sign + 1, NULL, 10));
    }
}

void html_count(Text *page, uint64_t count)
{
    char digits[24];
    size_t length = (size_t)snprintf(digits, sizeof digits, "%" PRIu64, count);
    for (size_t i = 0; i < length; i++) {
        if (i > 0 && (length - i) % 3 == 0 && length > 4) text_appendf(page, "\u202F");
        text_append(page, digits + i, 1);
    }
}

void html_png_address(Text *page, const uint8_t *pixels, uint32_t width, uint32_t height,
                      const uint8_t (*palette)[3], uint32_t palette_count)
{
    Text png = {0};
    png_bytes_append(&png, pixels, width, height, palette, palette_count);
    text_appendf(page, "data:image/png;base64,");
    base64_append(page, (const uint8_t *)png.items, png.count);
    text_free(&png);
}
