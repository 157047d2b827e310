// Checks that numbers of scenes are read as the nearest doubles, those of the C library, however they are
// written.
#include "host/import/number.h"
#include "host/verify/random_shape.h"
#include "tests/check.h"

static void check(const char *text)
{
    double value = NAN;
    const double expected = strtod(text, NULL);
    const NumberStatus status = number_read(text, strlen(text), &value);
    if (fabs(expected) > NUMBER_MAX) {
        assert_int_equal(status, NUMBER_TOO_LARGE);
    } else {
        assert_int_equal(status, NUMBER_READ);
        if (value != (fabs(expected) < NUMBER_MIN ? 0 : expected))
            fail_msg("%s is %.17g, not %.17g", text, value, expected);
    }
}

TEST(random_numbers_are_nearest)
{
    Random random = {1};
    for (int i = 0; i < 200000; i++) {
        char text[64];
        const int digits = (int)(random_bits(&random) % 18);
        const double number =
            ldexp((double)(int64_t)random_bits(&random), (int)(random_bits(&random) % 60) - 90);
        snprintf(text, sizeof text, i % 3 == 0 ? "%.*e" : i % 3 == 1 ? "%.*f" : "%.*g", digits, number);
        check(text);
        snprintf(text, sizeof text, "%ju.%jue%d",
                 (uintmax_t)(random_bits(&random) >> random_bits(&random) % 64),
                 (uintmax_t)(random_bits(&random) >> random_bits(&random) % 64),
                 (int)(random_bits(&random) % 60) - 40);
        check(text);
    }
}

TEST(limits_of_the_short_way_are_right)
{
    static const char *const texts[] = {
        "9007199254740992",
        "9007199254740993",
        "9007199254740991e22",
        "9007199254740991e-22",
        "9007199254740993e-22",
        "1e22",
        "1e23",
        "123456789e14",
        "8.5e-23",
        "1234567890123456789",
        "12345678901234567890",
        "0.1000000000000000055",
        "18446744073709551615",
        "18446744073709551616",
        "99999999999999999999",
        "0000000000000000000000000000000000000001.5",
        "0.00000000000000000000000000000000000000000000001",
        "1e30",
        "1.0000000000000001e30",
        "1.0000000000000002e30",
        "1e-30",
        "9.9999e-31",
        "-0",
        "-0.0e99999999999",
        "1e99999999999",
        "-1e-99999999999",
        "+.5",
        "5.",
        "2.2250738585072011e-308",
    };
    for (size_t i = 0; i < COUNT_OF(texts); i++)
        check(texts[i]);
}

TEST(what_is_no_number_is_refused)
{
    static const char *const texts[] = {"",   "+",   "-",   ".",   "e5", ".e5", "1e",   "1e+",
                                        "1x", "0x1", "inf", "nan", "1 ", "--1", "1.2.3"};
    double value = 7;
    for (size_t i = 0; i < COUNT_OF(texts); i++)
        assert_int_equal(number_read(texts[i], strlen(texts[i]), &value), NUMBER_MALFORMED);
    assert_true(value == 7);
    char text[1000];
    memset(text, '1', sizeof text);
    assert_int_equal(number_read(text, 511, &value), NUMBER_TOO_LARGE);
    assert_int_equal(number_read(text, 512, &value), NUMBER_MALFORMED);
    text[0] = '.';
    assert_int_equal(number_read(text, 511, &value), NUMBER_READ);
    assert_true(value == 1.0 / 9);
}

TEST(scan_ends_behind_the_number)
{
    static const struct {
        const char *text;
        size_t length;
    } cases[] = {{"1e5x", 3}, {"1ex", 1}, {"1e+ 2", 1}, {"-2.5/3", 4}, {"1..2", 2}};
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        const char *at = cases[i].text;
        double value;
        assert_int_equal(number_scan(&at, at + strlen(at), &value), NUMBER_READ);
        assert_ptr_equal(at, cases[i].text + cases[i].length);
    }
}

TEST_MAIN(NULL, NULL)
