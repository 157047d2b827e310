// JSON out: every text and number must read back as it was, with its type.
#include "host/base/json.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static char *json_printed(Json *json)
{
    char *bytes = NULL;
    size_t length = 0;
    FILE *stream = open_memstream(&bytes, &length);
    assert_non_null(stream);
    json_print(json, stream);
    assert_int_equal(fclose(stream), 0);
    return bytes;
}

// Where a layout is libfyaml's own affair.
static void spaces_remove(char *text)
{
    char *to = text;
    for (const char *from = text; *from; from++) {
        if (*from != ' ' && *from != '\n') *to++ = *from;
    }
    *to = '\0';
}

static void check_text(const char *value, const char *expected)
{
    Json *json = json_open();
    json_text(json, "key", value);
    char *printed = json_printed(json), *whole;
    assert_true(asprintf(&whole, "{\n  \"key\": %s\n}\n", expected) > 0);
    assert_string_equal(printed, whole);
    free(whole);
    free(printed);
}

static void check_key(const char *key, const char *expected)
{
    Json *json = json_open();
    json_none(json, key);
    char *printed = json_printed(json), *whole;
    assert_true(asprintf(&whole, "{\n  %s: null\n}\n", expected) > 0);
    assert_string_equal(printed, whole);
    free(whole);
    free(printed);
}

static void test_text_that_looks_like_something_else(void **state)
{
    (void)state;
    check_text("yes", "\"yes\"");
    check_text("123", "\"123\"");
    check_text("-1.5e7", "\"-1.5e7\"");
    check_text("null", "\"null\"");
    check_text("true", "\"true\"");
    check_text("~", "\"~\"");
    check_text("", "\"\"");
    check_text("- a", "\"- a\"");
    check_text("a: b", "\"a: b\"");
    check_text("# a", "\"# a\"");
    check_text("{[", "\"{[\"");
    check_text("*a", "\"*a\"");
    check_text("&a", "\"&a\"");
    check_text("!a", "\"!a\"");
    check_text("'a'", "\"'a'\"");
}

static void test_keys(void **state)
{
    (void)state;
    check_key("123", "\"123\"");
    check_key("true", "\"true\"");
    check_key("", "\"\"");
    check_key(" a \"b\" ", "\" a \\\"b\\\" \"");
    check_key("? a", "\"? a\"");
    check_key("\xC3\xA9", "\"\xC3\xA9\"");
}

static void test_spaces(void **state)
{
    (void)state;
    check_text(" ", "\" \"");
    check_text("  a  b   ", "\"  a  b   \"");
    check_text(" 12 ", "\" 12 \"");
    check_text(" \"a", "\" \\\"a\"");
}

static void test_escapes(void **state)
{
    (void)state;
    check_text("a\"b\\c/", "\"a\\\"b\\\\c/\"");
    check_text("\n\t\r", "\"\\n\\t\\r\"");
    check_text("a\nb\n\n c\n", "\"a\\nb\\n\\n c\\n\"");
    check_text("\x01\x1f", "\"\\u0001\\u001F\"");
    check_text("\\n", "\"\\\\n\"");
}

static void test_utf8(void **state)
{
    (void)state;
    check_text("\xC3\xA9\xE2\x98\x83", "\"\xC3\xA9\xE2\x98\x83\"");
    check_text("\xF0\x9F\x98\x80", "\"\\uD83D\\uDE00\"");
    check_text("a\xFF\xC3", "\"a\xEF\xBF\xBD\xEF\xBF\xBD\"");
    check_text("\xEF\xB7\x90", "\"\xEF\xBF\xBD\"");
}

static void test_long_text_stays_on_its_line(void **state)
{
    (void)state;
    char value[4001], expected[4003];
    for (size_t i = 0; i < 4000; i++)
        value[i] = i % 7 == 3 ? ' ' : 'a';
    value[4000] = '\0';
    snprintf(expected, sizeof expected, "\"%s\"", value);
    check_text(value, expected);
}

static double number_back(double value)
{
    Json *json = json_open();
    json_number(json, "n", value);
    char *printed = json_printed(json);
    const char *start = strstr(printed, "\"n\": ");
    assert_non_null(start);
    char *end;
    double back = strtod(start + 5, &end);
    assert_string_equal(end, "\n}\n");
    free(printed);
    return back;
}

static void test_numbers_read_back(void **state)
{
    (void)state;
    const double values[] = {0,    1,       0.1,     1.0 / 3,      1e20, 1e300, 123456789012345678.0,
                             1e-7, DBL_MAX, DBL_MIN, DBL_TRUE_MIN, -2.5, 5e-5,  16777217};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++)
        assert_true(number_back(values[i]) == values[i]);
    assert_true(signbit(number_back(-0.0)));
}

static void test_number_words(void **state)
{
    (void)state;
    Json *json = json_open();
    json_begin_array(json, "all");
    json_number(json, NULL, 0.1);
    json_number(json, NULL, 1e20);
    json_number(json, NULL, NAN);
    json_number(json, NULL, -INFINITY);
    json_int64(json, NULL, INT64_MIN);
    json_int64(json, NULL, INT64_MAX);
    json_bool(json, NULL, true);
    json_bool(json, NULL, false);
    json_text(json, NULL, NULL);
    json_end(json);
    char *printed = json_printed(json);
    spaces_remove(printed);
    assert_string_equal(printed, "{\"all\":[0.1,1e+20,null,null,-9223372036854775808,9223372036854775807,"
                                 "true,false,null]}");
    free(printed);
}

static void test_nesting(void **state)
{
    (void)state;
    Json *json = json_open();
    json_begin_object(json, "empty");
    json_end(json);
    json_begin_array(json, "none");
    json_end(json);
    json_begin_array(json, "rows");
    json_begin_object(json, NULL);
    json_int64(json, "a", 1);
    json_end(json);
    json_begin_array(json, NULL);
    json_int64(json, NULL, 2);
    json_end(json);
    json_end(json);
    json_int64(json, "last", 3);
    char *printed = json_printed(json);
    spaces_remove(printed);
    assert_string_equal(printed, "{\"empty\":{},\"none\":[],\"rows\":[{\"a\":1},[2]],\"last\":3}");
    free(printed);

    printed = json_printed(json_open());
    assert_string_equal(printed, "{}\n");
    free(printed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_text_that_looks_like_something_else),
        cmocka_unit_test(test_keys),
        cmocka_unit_test(test_spaces),
        cmocka_unit_test(test_escapes),
        cmocka_unit_test(test_utf8),
        cmocka_unit_test(test_long_text_stays_on_its_line),
        cmocka_unit_test(test_numbers_read_back),
        cmocka_unit_test(test_number_words),
        cmocka_unit_test(test_nesting),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
