// Compares the display values with the formulas of IEC 61966-2-1:1999, computed in long double.
#include "host/image/image.h"
#include "host/image/transfer.h"
#include "tests/check.h"

static uint32_t expected_quantized(float value, Transfer transfer, unsigned bits)
{
    if (!(value > 0)) return 0;
    long double display = value < 1 ? value : 1;
    if (transfer == TRANSFER_SRGB)
        display = display <= 0.0031308L ? 12.92L * display : 1.055L * powl(display, 1 / 2.4L) - 0.055L;
    return (uint32_t)floorl(display * (bits == 8 ? 255 : 65535) + 0.5L);
}

// Checks that the single function and the row function both give what the formula does.
static void check_value(float value, Transfer transfer, unsigned bits)
{
    uint32_t expected = expected_quantized(value, transfer, bits);
    uint8_t bytes[2] = {0};
    transfer_quantize(bytes, &value, 1, transfer, bits);
    uint32_t row = bits == 8 ? bytes[0] : (uint32_t)bytes[0] << 8 | bytes[1];
    if (image_quantize(value, transfer, bits) != expected || row != expected)
        fail_msg("%a: %u and %u, expected %u", (double)value, image_quantize(value, transfer, bits), row,
                 expected);
}

static void check_all(float value)
{
    for (unsigned bits = 8; bits <= 16; bits += 8) {
        check_value(value, TRANSFER_SRGB, bits);
        check_value(value, TRANSFER_NONE, bits);
    }
}

TEST(special_values)
{
    const float values[] = {0,           -0.0F,   -1,       1,          0.5F,     1.0000001F,
                            0.99999994F, NAN,     INFINITY, -INFINITY,  1e-45F,   1.17549435e-38F,
                            3e38F,       -1e-45F, -NAN,     0.0031308F, 0.00313F, 0.00314F};
    for (size_t i = 0; i < COUNT_OF(values); i++)
        check_all(values[i]);
    assert_int_equal(image_quantize(INFINITY, TRANSFER_SRGB, 8), 255);
    assert_int_equal(image_quantize(NAN, TRANSFER_SRGB, 16), 0);
    assert_int_equal(image_quantize(0.5F, TRANSFER_SRGB, 8), 188);
    assert_int_equal(image_quantize(0.5F, TRANSFER_NONE, 8), 128);
}

// Checks the floats on both sides of each place where the formula passes from one display value to the next.
static void check_thresholds(Transfer transfer, unsigned bits)
{
    uint32_t maximum = bits == 8 ? 255 : 65535;
    for (uint32_t k = 1; k <= maximum; k++) {
        long double display = (k - 0.5L) / maximum;
        long double linear = transfer == TRANSFER_NONE ? display
                             : display <= 0.04045L     ? display / 12.92L
                                                       : powl((display + 0.055L) / 1.055L, 2.4L);
        float value = (float)linear;
        for (int step = 0; step < 3; step++)
            value = nextafterf(value, 0);
        for (int step = -3; step <= 3; step++) {
            check_value(value, transfer, bits);
            value = nextafterf(value, 2);
        }
    }
}

TEST(thresholds)
{
    check_thresholds(TRANSFER_SRGB, 8);
    check_thresholds(TRANSFER_NONE, 8);
    check_thresholds(TRANSFER_SRGB, 16);
    check_thresholds(TRANSFER_NONE, 16);
}

TEST(many_values)
{
    uint32_t random = 12345;
    for (int i = 0; i < 200000; i++) {
        random = random * 1664525U + 1013904223U;
        check_all((float)(random >> 8) * 0x1p-24F);
        check_all(ldexpf((float)(random >> 8) * 0x1p-24F, -(int)(random & 31)));
    }
}

TEST_MAIN(NULL, NULL)
