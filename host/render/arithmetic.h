// Which precisions a device's arithmetic suits, by its passports.
#pragma once

#include "host/opencl/passport.h"
#include "host/render/renderer.h"

// The passport of the kernels that render a precision's first pass, or all of it. NULL: the device failed.
const Passport *arithmetic_passport(Compute *compute, Precision precision, uint32_t lanes, bool no_cache);

// Acquires the passports that the settings need. False with a message: `strict`, `double` or `certified`
// relies on a property that is broken; without: the device failed.
bool arithmetic_suits(Compute *compute, const RenderSettings *settings, MessageList *messages);

// Appends which property of the passports known at the default widths refuses the precision; false: none.
bool arithmetic_refuses(const Device *device, Precision precision, Text *why);
