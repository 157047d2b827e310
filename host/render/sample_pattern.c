#include "host/render/sample_pattern.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

// Uses the R2 sequence, whose steps are powers of the inverse of the plastic number (Roberts, The
// unreasonable effectiveness of quasirandom sequences, 2018). The sequence is shifted so that its mean is the
// pixel's center and the number of samples does not shift the image. Samples that the shift moves out of the
// pixel are clamped to its edge.
void *sample_pattern(uint32_t count, bool is_double)
{
    const double steps[2] = {0.7548776662466927, 0.5698402909980532};
    OWNED double *offsets = memory_allocate(2 * (size_t)count, sizeof *offsets);
    for (int axis = 0; axis < 2; axis++) {
        double mean = 0;
        for (uint32_t i = 0; i < count; i++) {
            double place = 0.5 + steps[axis] * i;
            offsets[2 * i + (uint32_t)axis] = 2 * (place - floor(place)) - 1;
            mean += offsets[2 * i + (uint32_t)axis] / count;
        }
        for (uint32_t i = 0; i < count; i++) {
            double *offset = &offsets[2 * i + (uint32_t)axis];
            *offset = fmin(fmax(*offset - mean, -1), 1);
        }
    }
    if (is_double) return memory_release(&offsets);
    float *narrow = memory_allocate(2 * (size_t)count, sizeof *narrow);
    numbers_narrow(narrow, offsets, 2 * (size_t)count);
    return narrow;
}
