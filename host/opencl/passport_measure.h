// Measures a passport.
#pragma once

#include "host/opencl/passport.h"

// Measures the passport. Returns false if the device failed.
bool passport_measure(Passport *passport, Compute *compute, PassportMode mode, uint32_t lanes,
                      bool is_thorough, bool no_cache);
