// Tests the device's arithmetic in the vectors and with the functions that rendering uses. The host
// evaluates the results (host/opencl/passport_measure.c). Operands come from memory, so that the compiler
// cannot know them, and as bits, so that no load or store changes them.
#include "numerics/numerics.h"
#include "probes.h"

#if IS_DOUBLE
#define MANTISSA_STRIDE MANTISSA_STRIDE_DOUBLE
#else
#define MANTISSA_STRIDE MANTISSA_STRIDE_FLOAT
#endif

typedef struct {
    integer first, second;
} Outcome;

static inline Outcome outcome_of(real first, real second)
{
    return (Outcome){bits_from_real(first), bits_from_real(second)};
}

static inline Outcome outcome_of_pair(Pair pair)
{
    return outcome_of(pair.high, pair.low);
}

static inline integer compared(mask condition, scalar_integer bit)
{
    return lanes_select(condition, (integer)(bit), (integer)(0));
}

static inline Outcome compare(real a, real b)
{
    integer order = compared(a < b, COMPARED_LESS) | compared(a == b, COMPARED_EQUAL) |
                    compared(a > b, COMPARED_GREATER) | compared(a != b, COMPARED_UNEQUAL) |
                    compared(a <= b, COMPARED_AT_MOST);
    return (Outcome){order, bits_from_real(real_max(a, b))};
}

static inline Outcome convert_floats(integer a, integer b)
{
#if IS_DOUBLE
    LANES_TYPE(float) to_float = LANES_CONVERT(float)(real_from_bits(a));
    LANES_TYPE(float) from_float = LANES_AS(float)(LANES_CONVERT(int)(b));
    return (Outcome){LANES_CONVERT(long)(LANES_AS(int)(to_float)),
                     bits_from_real(LANES_CONVERT(double)(from_float))};
#else
    return (Outcome){a, b};
#endif
}

// Runs four independent chains, which converge.
static inline Outcome chains_run(bool is_fused, uint round_count, real start, real factor, real addend)
{
    real x = start, y = x + addend, z = y + addend, w = z + addend;
    for (uint round = 0; round < round_count; round++) {
        x = is_fused ? real_fma(x, factor, addend) : x * factor + addend;
        y = is_fused ? real_fma(y, factor, addend) : y * factor + addend;
        z = is_fused ? real_fma(z, factor, addend) : z * factor + addend;
        w = is_fused ? real_fma(w, factor, addend) : w * factor + addend;
    }
    return outcome_of(x + y, z + w);
}

static inline integer mantissa_in_turn(uint first)
{
    IntegerLanes turns;
    for (uint lane = 0; lane < LANES; lane++)
        turns.each[lane] = (scalar_integer)(first + lane);
    return integer_from_unsigned(unsigned_from_integer(turns.all) * (unsigned_integer)(MANTISSA_STRIDE)) &
           MANTISSA;
}

static OUT_OF_LINE Outcome probe_run(uint probe, uint first, uint round_count, integer a_bits, integer b_bits,
                                     integer c_bits)
{
    // This code has no branches, because PoCL 6.0 requires InstCombine to reach a fixpoint in one iteration,
    // and aborts the process if the optimizer threads a branch from here into the switch.
    const bool sweeps_b = probe == PROBE_SWEEP_RECIPROCAL, sweeps_root = probe == PROBE_SWEEP_SQRT,
               sweeps_a = probe == PROBE_SWEEP_QUOTIENT || sweeps_root;
    const integer operand = a_bits, mantissa = mantissa_in_turn(first), one = bits_from_real((real)(1));
    a_bits = sweeps_a ? (sweeps_root ? operand : one) + mantissa : operand;
    b_bits = sweeps_b ? one | mantissa : sweeps_a ? operand : b_bits;
    probe = sweeps_root ? PROBE_SQRT : sweeps_a || sweeps_b ? PROBE_DIVIDE : probe;
    real a = real_from_bits(a_bits), b = real_from_bits(b_bits), c = real_from_bits(c_bits);
    switch (probe) {
    case PROBE_SUM_PRODUCT:
        return outcome_of(a + b, a * b);
    case PROBE_CONTRACTION:
        return outcome_of(a * b + c, -c - a * b);
    case PROBE_TWO_SUM:
        return outcome_of_pair(two_sum(a, b));
    case PROBE_TWO_PRODUCT:
        return outcome_of_pair(two_product(a, b));
    case PROBE_FMA:
        return outcome_of(real_fma(a, b, c), real_fma(b, a, c));
    case PROBE_DIVIDE:
        return outcome_of(device_divide(a, b), real_divide(a, b));
    case PROBE_SQRT:
        return outcome_of(device_sqrt(a), real_sqrt(a));
    case PROBE_COMPARE:
        return compare(a, b);
    case PROBE_INTEGERS:
        return (Outcome){bits_from_real(real_from_integer(a_bits)), integer_from_real(b)};
    case PROBE_FLOATS:
        return convert_floats(a_bits, b_bits);
    case PROBE_TIME_FMA:
        return chains_run(true, round_count, a, b, c);
    default:
        return chains_run(false, round_count, a, b, c);
    }
}

static inline integer operand_load(global const scalar_integer *from, bool is_uniform, size_t at)
{
    if (is_uniform) return (integer)(from[0]);
#if LANES == 1
    return from[at];
#else
    return JOIN(vload, LANES)(0, from + at);
#endif
}

static inline void result_store(integer value, global scalar_integer *to)
{
#if LANES == 1
    *to = value;
#else
    JOIN(vstore, LANES)(value, 0, to);
#endif
}

// Each work-item probes LANES of `count` operands: all a of operand_count, then all b, then all c. If there
// is only one operand, all work-items probe that. `results` has the first results, then the second ones.
// `first` is the number of the first mantissa.
kernel void passport(uint probe, uint first, uint round_count, uint operand_count,
                     global const scalar_integer *operands, uint count, global scalar_integer *results)
{
    size_t at = get_global_id(0) * LANES;
    if (at >= count) return;
    const bool is_uniform = operand_count == 1;
    integer a = operand_load(operands, is_uniform, at);
    integer b = operand_load(operands + operand_count, is_uniform, at);
    integer c = operand_load(operands + 2 * operand_count, is_uniform, at);
    Outcome outcome = probe_run(probe, first + (uint)at, round_count, a, b, c);
    result_store(outcome.first, results + at);
    result_store(outcome.second, results + count + at);
}
