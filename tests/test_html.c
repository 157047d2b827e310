// Pieces of HTML, and bytes as base64.
#include "host/base/base64.h"
#include "host/cli/html.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define assert_written(call, expected)                                                                       \
    do {                                                                                                     \
        Text page = {0};                                                                                     \
        call;                                                                                                \
        assert_string_equal(text_c(&page), expected);                                                        \
        text_free(&page);                                                                                    \
    } while (0)

static void test_text(void **state)
{
    (void)state;
    assert_written(html_text(&page, "a<b> & \"c\" 'd'"), "a&lt;b&gt; &amp; &quot;c&quot; 'd'");
    assert_written(html_text(&page, "é \xFF\xC3"), "é \uFFFD\uFFFD");
}

static void test_number(void **state)
{
    (void)state;
    static const struct {
        double value;
        const char *written;
    } cases[] = {
        {0, "0"},
        {-0.0, "0"},
        {3.14159e-6, "3.1·10⁻⁶"},
        {-2e-10, "−2.0·10⁻¹⁰"},
        {9.96e-6, "1.0·10⁻⁵"},
        {0.00999, "1.0·10⁻²"},
        {0.01, "0.0100"},
        {0.09996, "0.100"},
        {0.5, "0.500"},
        {0.9996, "1.00"},
        {9.996, "10.0"},
        {20.64, "20.6"},
        {99.96, "100"},
        {9999.4, "9999"},
        {9999.6, "1.0·10⁴"},
        {INFINITY, "∞"},
        {-INFINITY, "−∞"},
        {NAN, "not finite"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        assert_written(html_number(&page, cases[i].value), cases[i].written);
}

static void test_count(void **state)
{
    (void)state;
    assert_written(html_count(&page, 0), "0");
    assert_written(html_count(&page, 9216), "9216");
    assert_written(html_count(&page, 92160), "92\u202F160");
    assert_written(html_count(&page, 2073600), "2\u202F073\u202F600");
}

// RFC 4648, section 10.
static void test_base64(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        {"", ""},
        {"f", "Zg=="},
        {"fo", "Zm8="},
        {"foo", "Zm9v"},
        {"foob", "Zm9vYg=="},
        {"fooba", "Zm9vYmE="},
        {"foobar", "Zm9vYmFy"},
        {"\xFB\xFF", "+/8="},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        assert_written(base64_append(&page, (const uint8_t *)cases[i][0], strlen(cases[i][0])), cases[i][1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_text),
        cmocka_unit_test(test_number),
        cmocka_unit_test(test_count),
        cmocka_unit_test(test_base64),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
