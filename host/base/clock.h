// Clocks.
#pragma once

// Returns the seconds since an arbitrary moment, which never decrease.
double clock_seconds(void);

// Returns the seconds of all processors together that this process has used.
double clock_processor_seconds(void);
