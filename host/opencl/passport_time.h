// Measures the cost of fma and the behavior of a device's event timers.
#pragma once

#include "host/opencl/passport_probe.h"

// Returns the ratio of fma's time to that of a product and a sum, each without the time of an empty launch.
// Each time is the shortest of alternating launches, of which there are more if fma seems slow, since that
// may be chance. Sets timed_rounds.
double fma_cost(Measurement *measurement);

// Sets the passport's timer from all launches so far and some more. Call fma_cost first.
void timer_measure(Measurement *measurement);
