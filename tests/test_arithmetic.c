// Checks that the host's arithmetic gives the same bits on every processor, since doubles are rounded after
// each operation and functions whose values reach the flat arrays are rounded correctly. Also checks that a
// Quad has the bits it claims.
#include "host/image/srgb.h"
#include "host/scene/portable.h"
#include "host/verify/random_shape.h"
#include "tests/check.h"

#ifdef __x86_64__
#define WITH_FMA __attribute__((target("fma"), noinline))
#else
#define WITH_FMA __attribute__((noinline))
#endif

// This is compiled for processors with fma, as -march=native would.
WITH_FMA static double multiply_add(double a, double b, double c)
{
    return a * b + c;
}

TEST(rounds_each_operation)
{
    assert_int_equal(FLT_EVAL_METHOD, 0);
    const volatile double large = 0x1p53, one = 1, near_one = 1 + 0x1p-30;
    assert_true(large + one - large == 0);
#ifdef __x86_64__
    if (!__builtin_cpu_supports("fma")) skip();
#endif
    // exactly -2^-60, which the product's rounding to 1 loses
    assert_true(multiply_add(near_one, 2 - near_one, -1) == 0);
}

// Arguments at which glibc's function of doubles is off by one on x86-64, and the nearest doubles, by mpmath.
TEST(functions_are_rounded_correctly)
{
    static const struct {
        double (*function)(double);
        double argument, value;
    } rows[] = {
        {portable_sine, 1.1221, 0x1.cd51a085eed81p-1},
        {portable_sine, 0.2436, 0x1.edf9298076699p-3},
        {portable_cosine, 0.3714, 0x1.dd17888bfb2bfp-1},
        {portable_cosine, 1.0964, 0x1.d3c3c731b8dc3p-2},
        {portable_tangent, 1.0523, 0x1.c0ad3246168cap+0},
        {portable_tangent, 1.1082, 0x1.00ac9ae4c85c1p+1},
        {portable_log2, 0.9221, -0x1.df4081d58ec98p-4},
        {portable_log2, 0.9216, -0x1.e275048da0ba3p-4},
        {portable_log2, 0x1p-1074, -1074},
        {portable_log2, 1, 0},
    };
    for (size_t i = 0; i < COUNT_OF(rows); i++) {
        const volatile double argument = rows[i].argument; // calculated now, not by the compiler
        const double value = rows[i].function(argument);
        if (value != rows[i].value) fail_msg("row %zu: %a, not %a", i, value, rows[i].value);
    }
}

static void check_length(Vector3 v, double exact)
{
    if (!(fabs(vector_length(v) - exact) <= 2 * DBL_EPSILON * exact))
        fail_msg("length of %a %a %a: %a, not %a", v.x, v.y, v.z, vector_length(v), exact);
}

TEST(lengths_neither_overflow_nor_underflow)
{
    for (int exponent = -1070; exponent <= 1020; exponent++)
        check_length((Vector3){ldexp(2, exponent), ldexp(-3, exponent), ldexp(6, exponent)},
                     ldexp(7, exponent));
    assert_true(hypotenuse(0x1p-1074, 0) == 0x1p-1074 && hypotenuse(0, -DBL_MAX) == DBL_MAX);
    assert_true(vector_length((Vector3){0}) == 0);
}

TEST(quad_has_its_bits)
{
    Quad last = 1;
    for (int bit = 1; bit < QUAD_BITS; bit++)
        last /= 2;
    const volatile Quad next = 1 + last, same = 1 + last / 2;
    assert_true(next > 1 && same == 1);
#if defined(__GLIBC__) && (defined(__SIZEOF_FLOAT128__) || defined(__aarch64__))
    assert_int_equal(QUAD_BITS, 113);
#endif
}

// Squares of integers have exact roots, even far outside the range of a double.
TEST(quad_roots)
{
    Random random = {.state = 1};
    Quad scale = 1;
    for (int i = 0; i < 16000; i++) {
        const Quad integer = (Quad)(random_bits(&random) >> 40) * scale;
        assert_true(quad_root(integer * integer) == integer);
        const Quad a = integer * (Quad)random_between(&random, 1, 2), root = quad_root(a);
        const Quad by_library = QUAD_CALL(sqrt)(a);
        assert_true(quad_absolute(root - by_library) * 0x1p52 * 0x1p52 <= by_library);
        const int next = i + 1;
        scale = next % 2000 == 0 ? 1 : next / 2000 % 2 ? scale * 2 : scale / 2;
    }
    Quad least = 0x1p-1074;
    assert_true(quad_root(0) == 0 && quad_root(-1) == 0);
    while (least / 2 > 0)
        least /= 2;
    const Quad root = quad_root(least);
    assert_true(root > 0 && root * root >= least / 2 && root * root <= 2 * least);
}

// An image's texel is the same float whatever the last bits of the C library's pow.
TEST(decoded_texels_do_not_depend_on_pow)
{
    for (uint32_t maximum = 255; maximum <= 65535; maximum += 65280) {
        for (uint32_t k = 0; k <= maximum; k++) {
            const double linear = srgb_decode((double)((float)k / (float)maximum));
            if ((float)(linear * (1 - 8 * DBL_EPSILON)) != (float)(linear * (1 + 8 * DBL_EPSILON)))
                fail_msg("%u of %u", k, maximum);
        }
    }
}

TEST_MAIN(NULL, NULL)
