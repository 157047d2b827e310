// Implements arithmetic with known error bounds: correctly rounded division and square root, products
// without cancellation, pairs of reals with twice the precision, and the functions that shading needs.
//
// Nothing here may be contracted or reassociated; real_fma is explicit.
#ifndef NUMERICS_H
#define NUMERICS_H

#include "numerics/perturb.h"

// Selects the compensated forms of intersections, in pairs.
#define IS_COMPENSATED (IS_STRICT || IS_DOUBLE)

// Rounds quotients and roots correctly on devices whose division and square root are inexact
// (REPAIRS_DIVIDE, at `strict`, in floats). They are computed from the operands' mantissas alone, so that
// nothing overflows or underflows, brought within an ulp by a Newton step, then chosen among three neighbors
// by exact comparisons. A Newton step alone does not suffice, because the root of 1 - 2^-24 lies 2^-27 ulp
// from the midpoint of two floats.
static inline mask float_is_normal(real a)
{
    return (fabs(a) >= 0x1p-126f) & (fabs(a) <= LARGEST);
}

static inline real real_power_of_two(integer exponent)
{
    return real_from_bits((integer)(BITS_OF_ONE) + (exponent << EXPONENT_SHIFT));
}

// Returns the number that is `steps` representable numbers above a > 0.
static inline real real_neighbor(real a, scalar_integer steps)
{
    return real_from_bits(bits_from_real(a) + (integer)(steps));
}

// Returns the correctly rounded quotient. The remainder of a quotient within an ulp is exact, and so is its
// comparison with half the gap to a neighbor.
static inline real repaired_quotient(real a, real b)
{
    const integer a_bits = bits_from_real(a), b_bits = bits_from_real(b), one = (integer)(BITS_OF_ONE),
                  exponent_bits = (integer)(INFINITY_BITS), sign_bit = (integer)(~INTEGER_MAX);
    a = real_from_bits((a_bits & MANTISSA) | one);
    b = real_from_bits((b_bits & MANTISSA) | one);
    real quotient = device_divide(a, b);
    quotient = real_fma(real_fma(-quotient, b, a), device_divide((real)(1), b), quotient);
    real residual = real_fma(-quotient, b, a), half_b = 0.5f * b;
    real up = real_neighbor(quotient, 1), down = real_neighbor(quotient, -1);
    mask rises = residual > (up - quotient) * half_b, falls = residual < (down - quotient) * half_b;
    quotient = lanes_select(rises, up, lanes_select(falls, down, quotient));
    quotient = real_from_bits(bits_from_real(quotient) | ((a_bits ^ b_bits) & sign_bit));
    // in two factors, because one alone may overflow where the product does not
    integer exponent =
        ((a_bits & exponent_bits) >> EXPONENT_SHIFT) - ((b_bits & exponent_bits) >> EXPONENT_SHIFT);
    integer half_exponent = exponent >> 1;
    return quotient * real_power_of_two(half_exponent) * real_power_of_two(exponent - half_exponent);
}

// Returns the correctly rounded root by Tuckerman's test, root (root - ulp) < a <= root (root + ulp)
// (Agarwal, Cooley, Gustavson, Shearer, Slishman, Tuckerman, New scalar and vector elementary functions for
// the IBM System/370, IBM Journal of Research and Development 30(2), 1986).
static inline real repaired_root(real a)
{
    // rounded down, so that a lies in [1, 4)
    integer half_exponent = (bits_from_real(a) - (integer)(BITS_OF_ONE)) >> (EXPONENT_SHIFT + 1);
    a = real_from_bits(bits_from_real(a) - (half_exponent << (EXPONENT_SHIFT + 1)));
    real root = device_sqrt(a);
    root = real_fma(real_fma(-root, root, a), device_divide((real)(0.5f), root), root);
    real up = real_neighbor(root, 1), down = real_neighbor(root, -1);
    mask rises = real_fma(-root, up, a) > 0, falls = real_fma(-root, down, a) <= 0;
    return lanes_select(rises, up, lanes_select(falls, down, root)) * real_power_of_two(half_exponent);
}

// Returns a / b, correctly rounded at `strict` on every device, except for subnormal numbers. The repaired
// quotient decides whether a / b overflows, since an inexact device's may be infinite an ulp too early.
static inline real real_divide(real a, real b)
{
    real quotient = device_divide(a, b);
    if (!REPAIRS_DIVIDE) return quotient;
    real repaired = repaired_quotient(a, b);
    mask ordinary = float_is_normal(a) & float_is_normal(b) & (fabs(repaired) >= 0x1p-126f);
    return lanes_select(ordinary, repaired, quotient);
}

// Returns 1 / a within 2.5 ulp, as devices may divide, for tests with slack. a must be finite, and a and the
// result normal. On AVX-512 it is an estimate of 14 bits and a Newton step, which take a third of the time of
// a division.
static inline real reciprocal_estimate(real a)
{
#if defined(RECIPROCAL_14_BITS)
    if (!PERTURB) {
        real estimate = RECIPROCAL_14_BITS(a);
        return real_fma(real_fma(-a, estimate, (real)(1)), estimate, estimate);
    }
#endif
    return device_divide((real)(1), a);
}

// Returns 1 / sqrt(a) with a relative error of at most 2^-14 plus a few u. a and the result must be normal.
static inline real inverse_root_estimate(real a)
{
#if defined(INVERSE_ROOT_14_BITS)
    if (!PERTURB) return INVERSE_ROOT_14_BITS(a);
#endif
    return device_divide((real)(1), device_sqrt(a));
}

// A factor by which a bound is enlarged for the roundings in computing it.
#define BOUND_SLACK ((real)(1 + 16 * UNIT_ROUNDOFF))

// Returns an upper bound on the root of a^2 + b^2 for a, b >= 0. It is convex in the smaller number, so that
// the larger one plus sqrt(2) - 1 times the smaller one is not below it.
static inline real hypotenuse_above(real a, real b)
{
    return real_fma((real)(0.4143f), real_min(a, b), real_max(a, b));
}

// Returns whether |a / b| < 1 / SMALLEST_RATIO, without dividing. Scales b, because the product of
// SMALLEST_RATIO with the height of a shadow ray's start above the plane it leaves is subnormal, which costs
// x86 processors more than a hundred cycles.
static inline mask quotient_is_bounded(real a, real b)
{
    return fabs(a) < fabs(b) * (1 / SMALLEST_RATIO);
}

// Returns a / b, or `otherwise` if that is out of range.
static inline real divide_or(real a, real b, real otherwise)
{
    mask usable = quotient_is_bounded(a, b);
    return lanes_select(usable, real_divide(a, lanes_select(usable, b, (real)(1))), otherwise);
}

// Returns the square root of a >= 0, correctly rounded at `strict` on every device; 0 for 0.
static inline real real_sqrt(real a)
{
    real root = device_sqrt(a);
    if (!REPAIRS_DIVIDE) return root;
    return lanes_select(float_is_normal(a), repaired_root(a), root);
}

// Returns the reciprocal of the largest power of two <= a, for a > 0, and a huge number for 0.
static inline real real_inverse_power_of_two(real a)
{
    return real_from_bits((integer)(2 * BITS_OF_ONE) - (bits_from_real(a) & (integer)(INFINITY_BITS)));
}

// Returns a b - c d within 1.5 ulp, hence with the right sign (Jeannerod, Louvet, Muller, Further analysis of
// Kahan's algorithm for the accurate computation of 2x2 determinants, Math. Comp. 82, 2013).
static inline real difference_of_products(real a, real b, real c, real d)
{
    real cd = c * d;
    real rest = real_fma(-c, d, cd);
    return real_fma(a, b, -cd) + rest;
}

// Sums and products of pairs follow Joldes, Muller, Popescu, Tight and rigorous error bounds for basic
// building blocks of double-word arithmetic, ACM TOMS 44(2), 2017: the sum is algorithm 6, the product
// algorithm 11, with error bounds of 3 u^2 and 5 u^2.
static inline Pair pair_of(real value)
{
    return (Pair){value, (real)(0)};
}

// Returns a + b without error, for |larger| >= |smaller| or larger = 0.
static inline Pair fast_two_sum(real larger, real smaller)
{
    real sum = larger + smaller;
    return (Pair){sum, smaller - (sum - larger)};
}

static inline Pair pair_add(Pair a, Pair b)
{
    Pair high = two_sum(a.high, b.high);
    Pair low = two_sum(a.low, b.low);
    Pair sum = fast_two_sum(high.high, high.low + low.high);
    return fast_two_sum(sum.high, low.low + sum.low);
}

static inline Pair pair_subtract(Pair a, Pair b)
{
    return pair_add(a, (Pair){-b.high, -b.low});
}

static inline Pair pair_multiply(Pair a, Pair b)
{
    Pair product = two_product(a.high, b.high);
    return fast_two_sum(product.high, product.low + real_fma(a.high, b.low, a.low * b.high));
}

static inline Pair pair_scale(Pair a, real factor)
{
    Pair product = two_product(a.high, factor);
    return fast_two_sum(product.high, real_fma(a.low, factor, product.low));
}

// Returns a b - c d in pairs.
static inline Pair pair_difference_of_products(Pair a, Pair b, Pair c, Pair d)
{
    return pair_subtract(pair_multiply(a, b), pair_multiply(c, d));
}

// LN_2 + LN_2_REST is ln(2), and LOG2_E is its reciprocal. ROOT_HALF_BITS is the bit pattern of sqrt(1/2).
#if IS_DOUBLE
#define LN_2           0x1.62e42fefa39efp-1
#define LN_2_REST      0x1.abc9e3b39803fp-56
#define LOG2_E         0x1.71547652b82fep0
#define ROOT_HALF_BITS 0x3fe6a09e667f3bcdL
#define EXP_LOWEST     (-708.0)
#else
#define LN_2           0x1.62e43p-1f
#define LN_2_REST      (-0x1.05c61p-29f)
#define LOG2_E         0x1.715476p0f
#define ROOT_HALF_BITS 0x3f3504f3
#define EXP_LOWEST     (-87.0f)
#endif

// Returns 1/3 + x/5 + x^2/7 + ..., the common tail of the series of the logarithm and the arctangent
// (Abramowitz, Stegun, Handbook of Mathematical Functions, 4.1.27 and 4.4.42). Ends at 1/9 or, in double, at
// 1/`last`. In float the quotients are literals, because a device's division may be inexact.
static inline real series_of_odd_reciprocals(real x, scalar last)
{
#if IS_DOUBLE
    real series = (real)(0);
    for (scalar n = last; n >= 3; n -= 2)
        series = real_fma(series, x, (real)(1.0 / n));
#else
    real series = real_fma(x, (real)(1.0f / 9), (real)(1.0f / 7));
    series = real_fma(series, x, (real)(1.0f / 5));
    series = real_fma(series, x, (real)(1.0f / 3));
#endif
    return series;
}

// Returns ln(1 - s) for 0 <= s < 1 as -2 artanh(s / (2 - s)), after extracting the power of two. Small s keep
// all bits, which 1 - s would lose.
static inline real real_log_complement(real s)
{
    real rest = 1 - s;
    // rest = 2^exponent m with m in [0.7, 1.4]; s <= 0.29 keeps exponent 0 and s itself
    integer exponent = (bits_from_real(rest) - (integer)(ROOT_HALF_BITS)) >> EXPONENT_SHIFT;
    real m = real_from_bits(bits_from_real(rest) - (exponent << EXPONENT_SHIFT));
    real f = lanes_select(exponent == (integer)(0), -s, m - 1);
    real z = real_divide(f, 2 + f);
    real zz = z * z, two_z = z + z;
    real log_m = real_fma(two_z * zz, series_of_odd_reciprocals(zz, 23), two_z);
    real k = real_from_integer(exponent);
    return real_fma(k, (real)(LN_2), real_fma(k, (real)(LN_2_REST), log_m));
}

// Returns e^x for x <= 0: 2^k times the Taylor series of the remainder, at most ln(2)/2 (Abramowitz, Stegun,
// 4.2.1). Returns 0 below EXP_LOWEST, where the result would be subnormal.
static inline real real_exp_negative(real x)
{
    const real lowest = (real)(EXP_LOWEST);
    real within = real_max(x, lowest);
    real k = real_floor(real_fma(within, (real)(LOG2_E), (real)(0.5f)));
    real r = real_fma(-k, (real)(LN_2_REST), real_fma(-k, (real)(LN_2), within));
    real series;
#if IS_DOUBLE
    series = (real)(1);
    for (scalar n = 13; n >= 1; n -= 1)
        series = real_fma(series, r * (real)(1 / n), (real)(1));
#else
    series = real_fma(r, (real)(1.0f / 5040), (real)(1.0f / 720));
    series = real_fma(series, r, (real)(1.0f / 120));
    series = real_fma(series, r, (real)(1.0f / 24));
    series = real_fma(series, r, (real)(1.0f / 6));
    series = real_fma(series, r, (real)(0.5f));
    series = real_fma(series, r, (real)(1));
    series = real_fma(series, r, (real)(1));
#endif
    return lanes_select(x < lowest, (real)(0), series * real_power_of_two(integer_from_real(k)));
}

// Returns (1 - s)^n for 0 <= s < 1 and n >= 0; at most 1.
static inline real real_complement_power(real s, real n)
{
    real power = perturbed_power(real_exp_negative(n * real_log_complement(s)), s, n);
    return real_min(power, (real)(1));
}

// Returns the lanes where (1 - s)^n, at most e^(-n s), may be above 0.
static inline mask real_complement_power_is_nonzero(real s, real n)
{
    return (s < 1) & (n * s < 1 - EXP_LOWEST);
}

#endif
