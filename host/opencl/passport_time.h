// Measures the cost of fma, and what a device's event timers do.
#pragma once

#include "host/opencl/passport_probe.h"

// Returns the time of fma over that of a product and a sum, without the time of an empty launch. Each is the
// least of launches that take turns, with more of them where fma seems slow, which may be chance. Sets
// timed_rounds.
double fma_cost(Measurement *measurement);

// Sets the passport's timer, from all launches so far and some more. Requires fma_cost.
void timer_measure(Measurement *measurement);
