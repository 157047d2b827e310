// Measures how exactly a device divides and takes square roots.
#pragma once

#include "host/opencl/passport_probe.h"

// Sets the passport's quotients and roots. Takes the rest of PASSPORT_SECONDS_MAX where it is thorough.
void quotients_measure(Measurement *measurement);
