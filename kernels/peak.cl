// The device's peak: arithmetic without memory, and memory without arithmetic.
#include "numerics/lanes.h"

// Eight independent chains of fma keep pipelines of 4 stages in 2 units busy. Variables, not an array, which
// a compiler that does not unroll would load and store.
kernel void arithmetic(uint round_count, scalar factor, scalar addend, global scalar *results)
{
    size_t item = get_global_id(0);
    const real m = (real)(factor), n = (real)(addend), one = (real)(1);
    real a = (real)((scalar)item), b = a + one, c = b + one, d = c + one;
    real e = d + one, f = e + one, g = f + one, h = g + one;
    for (uint round = 0; round < round_count; round++) {
        a = fma(a, m, n);
        b = fma(b, m, n);
        c = fma(c, m, n);
        d = fma(d, m, n);
        e = fma(e, m, n);
        f = fma(f, m, n);
        g = fma(g, m, n);
        h = fma(h, m, n);
    }
    RealLanes sum = {((a + b) + (c + d)) + ((e + f) + (g + h))};
    scalar total = 0;
    for (uint lane = 0; lane < LANES; lane++)
        total += sum.each[lane];
    results[item] = total;
}

kernel void copy(global const float4 *from, global float4 *to)
{
    size_t item = get_global_id(0);
    to[item] = from[item];
}
