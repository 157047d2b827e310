// A fixed amount of the host's own work, whose time follows the speed of the machine: no device or driver
// takes part, so nothing that is measured can change it.
#pragma once

#include "host/measure/series.h"

enum {
    CALIBRATION_ROUNDS = 1 << 20
}; // of eight chains of a product and a sum in double, over all processors

// Seconds of each calibration; zeroed: none yet.
typedef struct {
    Series wall;
    Series processor; // of all processors together
} Calibration;

void calibration_run(Calibration *calibration);  // some 3 ms of processor time; adds to each series
void calibration_free(Calibration *calibration); // and zeroes
