// Base64 (RFC 4648, "The Base16, Base32, and Base64 Data Encodings", 2006, section 4).
#pragma once

#include "host/base/text.h"
#include <stdint.h>

void base64_append(Text *text, const uint8_t *bytes, size_t count);
// Appends the bytes that base64 text stands for; the padding at its end may be missing. False if other
// characters occur.
bool base64_decode(Text *bytes, const char *text, size_t length);
