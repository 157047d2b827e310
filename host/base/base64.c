#include "host/base/base64.h"

#include <string.h>

static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

void base64_append(Text *text, const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i += 3) {
        size_t left = count - i;
        unsigned group = (unsigned)bytes[i] << 16 | (left > 1 ? (unsigned)bytes[i + 1] << 8 : 0u) |
                         (left > 2 ? bytes[i + 2] : 0u);
        char quartet[] = {digits[group >> 18], digits[group >> 12 & 63],
                          left > 1 ? digits[group >> 6 & 63] : '=', left > 2 ? digits[group & 63] : '='};
        text_append(text, quartet, sizeof quartet);
    }
}

bool base64_decode(Text *bytes, const char *text, size_t length)
{
    uint8_t values[256];
    memset(values, 64, sizeof values);
    for (uint8_t i = 0; i < 64; i++)
        values[(unsigned char)digits[i]] = i;
    for (int padding = 0; padding < 2 && length > 0 && text[length - 1] == '='; padding++)
        length--;
    unsigned group = 0;
    for (size_t i = 0; i < length; i++) {
        const uint8_t value = values[(unsigned char)text[i]];
        if (value == 64) return false;
        group = group << 6 | value;
        const char byte = (char)(group >> (6 - 2 * (i & 3)) & 255);
        if ((i & 3) > 0) text_append(bytes, &byte, 1);
    }
    return (length & 3) != 1;
}
