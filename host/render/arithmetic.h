// Decides from passports which precisions suit a device's arithmetic.
#pragma once

#include "host/opencl/passport.h"
#include "host/render/renderer.h"

// Returns the passport of the kernels that render all of a precision's image, or its first pass at
// `certified`. Returns NULL if the device failed.
const Passport *arithmetic_passport(Compute *compute, Precision precision, uint32_t lanes, bool no_cache);

// Acquires the passports that the settings need. Returns false with a message if `strict`, `double` or
// `certified` relies on a property that the device does not have, and false with no message if the device
// failed.
bool arithmetic_suits(Compute *compute, const RenderSettings *settings, MessageList *messages);

// Returns false with a message if the settings do not fit the device (settings_fit) or its arithmetic
// (arithmetic_suits), and false with no message if the device failed.
bool device_suits(Compute *compute, const RenderSettings *settings, MessageList *messages);

// Returns true and appends the reason to `why` if a known passport refuses the precision at the default
// widths.
bool arithmetic_refuses(const Device *device, Precision precision, Text *why);
