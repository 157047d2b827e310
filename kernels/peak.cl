// What the device can do at most: arithmetic without memory, and memory without arithmetic.
#include "lanes.h"

// Independent of one another, to keep pipelines of 4 steps in 2 units busy; each takes one fma a round.
#define CHAIN_COUNT 8

kernel void arithmetic(uint round_count, scalar factor, scalar addend, global scalar *results)
{
    size_t item = get_global_id(0);
    real chains[CHAIN_COUNT];
    for (uint i = 0; i < CHAIN_COUNT; i++)
        chains[i] = (real)((scalar)(item + i));
    for (uint round = 0; round < round_count; round++)
        for (uint i = 0; i < CHAIN_COUNT; i++)
            chains[i] = fma(chains[i], (real)(factor), (real)(addend));
    RealLanes sum = {chains[0]};
    for (uint i = 1; i < CHAIN_COUNT; i++)
        sum.all += chains[i];
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
