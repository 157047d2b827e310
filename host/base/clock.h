// The monotonic clock.
#pragma once

// Seconds since an arbitrary moment; never decreases.
double clock_seconds(void);
