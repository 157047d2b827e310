// Measures how exactly a device divides and takes square roots.
#pragma once

#include "host/opencl/passport_probe.h"

// Sets the passport's quotients and roots. A thorough measurement uses the rest of PASSPORT_SECONDS_MAX.
void quotients_measure(Measurement *measurement);
