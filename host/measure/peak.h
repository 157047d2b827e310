// What a device can do at most, measured: the rate of fused multiply-adds that depend on no memory, and the
// rate of a copy too large for its caches (kernels/peak.cl).
#pragma once

#include "host/opencl/compute.h"

typedef struct {
    double flops_per_second[2]; // of float, of double; 0: not measured; an fma counts as 2
    double bytes_per_second;    // read and written
    bool by_events;             // whose clock: the device's, else the host's
    bool is_stable;             // every rate was reached again and again
    double seconds;             // time limit of each rate
} Peak;

// Takes some 0.3 s for each rate, and up to 1 s or `seconds` until it is stable, after the build of the
// kernels. `with_double`: also of double, which the device must have.
void peak_measure(Peak *peak, Compute *compute, bool with_double, double seconds);

enum { PEAK_WINDOWS_NEEDED = 3 };

// The best rates of the windows of a measurement; zeroed: none yet.
typedef struct {
    double best[PEAK_WINDOWS_NEEDED]; // descending
    size_t count;
} PeakWindows;

void peak_windows_add(PeakWindows *windows, double rate);
// Whether the three best rates agree within 3 %.
bool peak_windows_stable(const PeakWindows *windows);
