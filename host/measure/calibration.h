// A fixed workload on the host, whose time follows the speed of the host's processors. No device or driver
// takes part in it. Builds by other compilers or with other CFLAGS may take another time.
#pragma once

#include "host/measure/series.h"

// Rounds of eight chains of a product and a sum in double, shared by all processors.
enum { CALIBRATION_ROUNDS = 1 << 20 };

// Seconds of each calibration; zeroed: none yet.
typedef struct {
    Series wall;
    Series processor; // of all processors together
} Calibration;

// Takes some 3 ms of processor time, and adds to each series.
void calibration_run(Calibration *calibration);
void calibration_free(Calibration *calibration); // and zeroes
