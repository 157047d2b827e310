// What a device can do at most, measured: the rate of fused multiply-adds that depend on no memory, and the
// rate of a copy too large for its caches (kernels/peak.cl).
#pragma once

#include "host/opencl/compute.h"

typedef struct {
    double flops_per_second[2]; // of float, of double; 0: not measured; an fma counts as 2
    double bytes_per_second;    // read and written
    bool by_events;             // whose clock: the device's, else the host's
} Peak;

// Takes up to about 0.3 s each, after the build of the kernels. `with_double`: also of double, which the
// device must have.
void peak_measure(Peak *peak, Compute *compute, bool with_double);
