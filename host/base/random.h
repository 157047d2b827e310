// SplitMix64, a pseudorandom generator whose state is a counter (Steele, Lea, Flood, "Fast splittable
// pseudorandom number generators", OOPSLA 2014).
#pragma once

#include <stdint.h>

// Returns the 64 random bits of a state.
static inline uint64_t random_mix(uint64_t state)
{
    state = (state ^ state >> 30) * 0xbf58476d1ce4e5b9u;
    state = (state ^ state >> 27) * 0x94d049bb133111ebu;
    return state ^ state >> 31;
}

#define RANDOM_STEP UINT64_C(0x9e3779b97f4a7c15)

// Advances the state and returns its 64 random bits.
static inline uint64_t random_next(uint64_t *state)
{
    return random_mix(*state += RANDOM_STEP);
}
