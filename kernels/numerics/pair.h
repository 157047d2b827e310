// Computes sums and products without error, and real_fma, which rounds a b + c once.
//
// A device that emulates fma does so with integers, in several times the operations. There real_fma adds the
// two parts of the product to c without error and rounds the sum once, after rounding the remainder to odd
// (Boldo, Melquiond, Emulation of a FMA and correctly rounded sums: proved algorithms using rounding to odd,
// IEEE Transactions on Computers 57(4), 2008; here operands are split between bits, which never overflows).
// Products of extreme size are computed 2^64 times larger or smaller, so its bits differ from fma's only
// where the product is below 2^-166 (on a device that flushes subnormals, 2^-144) or above 2^192.
#ifndef PAIR_H
#define PAIR_H

#include "numerics/lanes.h"

// A double-word (double-double) number: the unevaluated sum high + low, with |low| at most half an ulp of
// high, about 2 x 24 or 2 x 53 bits.
typedef struct {
    real high, low;
} Pair;

// Returns a + b without error (Knuth, The Art of Computer Programming 2, 4.2.2, theorem B).
static inline Pair two_sum(real a, real b)
{
    real sum = a + b;
    real of_b = sum - a;
    return (Pair){sum, (a - (sum - of_b)) + (b - of_b)};
}

#if HAS_FMA

#define real_fma fma

#else

// Returns a b without error unless tiny or huge, from parts of 12 bits, whose products are exact (Dekker, A
// floating-point technique for extending the available precision, Numerische Mathematik 18, 1971).
static inline Pair moderate_product(real a, real b)
{
    const integer high_bits = (integer)(~0xfff);
    real product = a * b;
    real a_high = real_from_bits(bits_from_real(a) & high_bits), a_low = a - a_high;
    real b_high = real_from_bits(bits_from_real(b) & high_bits), b_low = b - b_high;
    real missing = ((product - a_high * b_high) - a_low * b_high) - a_high * b_low;
    return (Pair){product, a_low * b_low - missing};
}

// Returns high + low rounded to odd. If low is not 0, this is that one of the two reals around the sum whose
// last bit is 1.
static inline real pair_round_to_odd(Pair sum)
{
    integer bits = bits_from_real(sum.high);
    integer step = ((bits ^ bits_from_real(sum.low)) >> 31) | (integer)(1); // away from 0, or towards it
    mask moves = (sum.low != 0) & ((bits & (integer)(1)) == (integer)(0));
    return real_from_bits(lanes_select(moves, bits + step, bits));
}

// Returns a b + c, rounded once. Inlining it in hundreds of places made a cold start with Intel's compiler
// take 26 s instead of 5.
__attribute__((noinline)) static real real_fma(real a, real b, real c)
{
    const real one = (real)(1), up = (real)(0x1p64f), down = (real)(0x1p-64f);
    real size = fabs(a * b), c_size = fabs(c);
    mask is_small = (size < 0x1p-80f) & (c_size < 0x1p20f); // a larger c is the sum
    mask is_large = fmax(size, c_size) > 0x1p100f;
    mask a_is_less = fabs(a) < fabs(b);
    real less = lanes_select(a_is_less, a, b) * lanes_select(is_small, up, one);
    real greater = lanes_select(a_is_less, b, a) * lanes_select(is_large, down, one);
    // where a c that would vanish next to a large product decides, the product is halfway between two reals,
    // and the sign of c is enough
    real large_c = lanes_select(c_size > 0, copysign(fmax(c_size * down, (real)(0x1p-60f)), c), c);
    real scaled_c = lanes_select(is_large, large_c, c * lanes_select(is_small, up, one));
    real back = lanes_select(is_small, down, lanes_select(is_large, up, one));

    Pair product = moderate_product(less, greater);
    Pair lower = two_sum(scaled_c, product.low), upper = two_sum(product.high, lower.high);
    real rest = pair_round_to_odd(two_sum(upper.low, lower.low));
    real rounded_once = upper.high + rest;
    // what is subnormal once it is scaled back is rounded next to a number of the same ulp
    real normal = copysign((real)(0x1p-62f), rounded_once);
    Pair shifted = two_sum(normal, upper.high);
    real rounded_steps = (shifted.high + pair_round_to_odd(two_sum(shifted.low, rest))) - normal;
    mask is_subnormal = is_small & (fabs(rounded_once) <= 0x1p-62f);
    rounded_once = lanes_select(is_subnormal, copysign(rounded_steps, rounded_once), rounded_once);
    // has the right sign if the sum is 0, and is right beyond the largest real
    real rounded_twice = product.high + scaled_c;
    mask finite = (fabs(rounded_twice) <= LARGEST) & (fabs(upper.high) <= LARGEST);
    return lanes_select(finite & (upper.high + rest != 0), rounded_once, rounded_twice) * back;
}

#endif

// Returns a b without error.
static inline Pair two_product(real a, real b)
{
    real product = a * b;
    return (Pair){product, real_fma(a, b, -product)};
}

#endif
