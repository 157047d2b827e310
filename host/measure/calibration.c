#include "host/measure/calibration.h"

#include "host/base/clock.h"
#include "host/base/parallel.h"

enum { CHAINS = 8, PARTS = 64 };

// Runs the chains of parts begin to end - 1. Each chain converges to 1, so it neither overflows nor becomes
// subnormal.
static void part_run(void *context, size_t begin, size_t end)
{
    volatile double *sums = context;
    for (size_t part = begin; part < end; part++) {
        double chains[CHAINS];
        for (int i = 0; i < CHAINS; i++)
            chains[i] = sums[part] + i;
        for (int round = 0; round < CALIBRATION_ROUNDS / PARTS; round++)
            for (int i = 0; i < CHAINS; i++)
                chains[i] = chains[i] * 0.5 + 0.5;
        for (int i = 0; i < CHAINS; i++)
            sums[part] += chains[i];
    }
}

void calibration_run(Calibration *calibration)
{
    volatile double sums[PARTS] = {0}; // the compiler must not remove the work
    const double processor_start = clock_processor_seconds(), start = clock_seconds();
    parallel_run(PARTS, 1, part_run, (void *)sums);
    series_add(&calibration->wall, clock_seconds() - start);
    series_add(&calibration->processor, clock_processor_seconds() - processor_start);
}

void calibration_free(Calibration *calibration)
{
    series_free(&calibration->wall);
    series_free(&calibration->processor);
}
