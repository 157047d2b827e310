// Sums and products without error, and fma for devices that do it in software.
//
// Theirs goes through integers, at several times the operations; inlined in hundreds of places it is more
// than some compilers finish. Ours adds the product's two halves to c without error and rounds the sum once,
// what is left out being rounded to odd before (Boldo, Melquiond, Emulation of a FMA and correctly rounded
// sums: proved algorithms using rounding to odd, IEEE Transactions on Computers 57(4), 2008; the operands are
// split between bits here, which overflows nowhere). Bits differ from fma's only where the product or the sum
// is within a few ulp of the largest real or beyond it, or the product is so small, below 2^-102, that its
// lower half is no normal number; below some 2^-80 on a device that takes subnormal numbers for 0.
#ifndef PAIR_H
#define PAIR_H

#include "numerics/lanes.h"

// The unevaluated sum high + low, |low| at most half an ulp of high: about 2 x 24 or 2 x 53 bits.
typedef struct {
    real high, low;
} Pair;

// a + b without error (Knuth, The Art of Computer Programming 2, 4.2.2, theorem B).
static inline Pair pair_sum(real a, real b)
{
    real sum = a + b;
    real of_b = sum - a;
    return (Pair){sum, (a - (sum - of_b)) + (b - of_b)};
}

#if HAS_FMA

// a b without error.
static inline Pair pair_product(real a, real b)
{
    real product = a * b;
    return (Pair){product, fma(a, b, -product)};
}

#else

// By halves of 12 bits, whose products are exact (Dekker, A floating-point technique for extending the
// available precision, Numerische Mathematik 18, 1971).
static inline Pair pair_product(real a, real b)
{
    const integer upper_half = (integer)(~0xfff);
    real product = a * b;
    real a_high = real_from_bits(bits_from_real(a) & upper_half), a_low = a - a_high;
    real b_high = real_from_bits(bits_from_real(b) & upper_half), b_low = b - b_high;
    real missing = ((product - a_high * b_high) - a_low * b_high) - a_high * b_low;
    return (Pair){product, a_low * b_low - missing};
}

#if IS_FAST

// Of products only pair_product's are exact here: a product_difference is a plain difference.
#undef fma
#define fma mad

#else

// The sum's higher half; where the lower is not 0, of the two reals around the sum the one whose last bit is
// 1: a step away from 0, or to it, leads there.
static inline real pair_odd(Pair sum)
{
    integer bits = bits_from_real(sum.high);
    integer step = ((bits ^ bits_from_real(sum.low)) >> 31) | (integer)(1);
    mask moves = (sum.low != (real)(0)) & ((bits & (integer)(1)) == (integer)(0));
    return real_from_bits(lanes_select(moves, bits + step, bits));
}

static inline real fma_in_software(real a, real b, real c)
{
    Pair product = pair_product(a, b);
    Pair lower = pair_sum(c, product.low), upper = pair_sum(product.high, lower.high);
    real once = upper.high + pair_odd(pair_sum(upper.low, lower.low));
    // has the right sign where the sum is 0, and is a number or infinity beyond the largest real
    real twice = product.high + c;
    mask finite = (fabs(twice) <= (real)(LARGEST)) & (fabs(upper.high) <= (real)(LARGEST));
    return lanes_select(finite & (once != (real)(0)), once, twice);
}

// Of lanes; the device's own remains (fma)(a, b, c).
#undef fma
#define fma(a, b, c) fma_in_software(a, b, c)

#endif

#endif

#endif
