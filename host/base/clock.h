// Clocks.
#pragma once

// Seconds since an arbitrary moment; never decreases.
double clock_seconds(void);

// Of all processors together, that this process has used.
double clock_processor_seconds(void);
