// Measures a passport.
#pragma once

#include "host/opencl/passport.h"

// The program of passport.cl for a mode and a width. The prelude is the caller's to free.
ProgramRequest passport_request(const Device *device, PassportMode mode, uint32_t lanes, bool has_fma,
                                bool no_cache, Text *prelude);

// False: the device failed.
bool passport_measure(Passport *passport, Compute *compute, PassportMode mode, uint32_t lanes,
                      bool is_thorough, bool no_cache);
