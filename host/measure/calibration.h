// Times a fixed workload on the host, which follows the speed of the host's processors. It uses neither
// devices nor drivers. Builds by other compilers or with other CFLAGS may take a different time.
#pragma once

#include "host/measure/series.h"

// Rounds of eight chains of a product and a sum in double, shared by all processors.
enum { CALIBRATION_ROUNDS = 1 << 20 };

// Seconds of each calibration. All zeros means none.
typedef struct {
    Series wall;
    Series processor; // summed over all processors
} Calibration;

// Runs the workload, which takes about 3 ms of processor time, and adds to each series.
void calibration_run(Calibration *calibration);
// Frees the series and sets them to zeros.
void calibration_free(Calibration *calibration);
