// Base64 (RFC 4648, "The Base16, Base32, and Base64 Data Encodings", 2006, section 4).
#pragma once

#include "host/base/text.h"
#include <stdint.h>

void base64_append(Text *text, const uint8_t *bytes, size_t count);
