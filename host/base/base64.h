// Base64 (RFC 4648, "The Base16, Base32, and Base64 Data Encodings", 2006, section 4).
#pragma once

#include "host/base/text.h"
#include <stdint.h>

void base64_append(Text *text, const uint8_t *bytes, size_t count);
// Decodes base64 text and appends its bytes. Any padding at the end is skipped, and may be missing. Returns
// false if other characters occur, or if a last character remains that makes no byte.
bool base64_decode(Text *bytes, const char *text, size_t length);
