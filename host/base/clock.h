// The monotonic clock.
#pragma once

// Seconds since an arbitrary moment; never goes back.
double clock_seconds(void);
