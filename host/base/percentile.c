#include "host/base/percentile.h"

#include "host/base/memory.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

// Returns the value at `rank` (from 0) of the sorted magnitudes by radix selection. The bits of non-negative
// floats are in their order, so histograms of the upper and then of the lower half of the bits find it.
static float rank_select(const float *magnitudes, size_t count, size_t rank)
{
    OWNED size_t *counts = memory_allocate(1u << 16, sizeof *counts);
    uint32_t found = 0;
    for (unsigned shift = 16;; shift = 0) {
        memset(counts, 0, (1u << 16) * sizeof *counts);
        for (size_t i = 0; i < count; i++) {
            uint32_t bits;
            memcpy(&bits, &magnitudes[i], sizeof bits);
            if (shift == 16 || bits >> 16 == found >> 16) counts[bits >> shift & 0xffff]++;
        }
        uint32_t half = 0;
        for (; rank >= counts[half]; half++)
            rank -= counts[half];
        found |= half << shift;
        if (shift == 0) break;
    }
    float value;
    memcpy(&value, &found, sizeof value);
    return value;
}

double percentile_999(const float *magnitudes, size_t count)
{
    if (count == 0) return 0;
    return (double)rank_select(magnitudes, count, (size_t)ceil(0.999 * (double)count) - 1);
}
