// Measures wall-clock and processor time.
#pragma once

// Returns the seconds since an arbitrary moment, which never decrease.
double clock_seconds(void);

// Returns the processor time of this process in seconds, summed over all processors.
double clock_processor_seconds(void);
