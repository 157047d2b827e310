// Tests that every text and number of written JSON reads back as it was, with its type.
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/base/json.h"
#include "tests/check.h"
#include "tests/child.h"

#include <inttypes.h>
#include <jansson.h>

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

static void check_text(const char *value, const char *expected)
{
    Json *json = json_open();
    json_text(json, "key", value);
    OWNED char *printed = json_printed(json), *whole;
    assert_true(asprintf(&whole, "{\n  \"key\": %s\n}\n", expected) > 0);
    assert_string_equal(printed, whole);
}

static void check_key(const char *key, const char *expected)
{
    Json *json = json_open();
    json_none(json, key);
    OWNED char *printed = json_printed(json), *whole;
    assert_true(asprintf(&whole, "{\n  %s: null\n}\n", expected) > 0);
    assert_string_equal(printed, whole);
}

TEST(text_that_looks_like_something_else)
{
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

TEST(keys)
{
    check_key("123", "\"123\"");
    check_key("true", "\"true\"");
    check_key("", "\"\"");
    check_key(" a \"b\" ", "\" a \\\"b\\\" \"");
    check_key("? a", "\"? a\"");
    check_key("\xC3\xA9", "\"\xC3\xA9\"");
}

TEST(spaces)
{
    check_text(" ", "\" \"");
    check_text("  a  b   ", "\"  a  b   \"");
    check_text(" 12 ", "\" 12 \"");
    check_text(" \"a", "\" \\\"a\"");
}

TEST(escapes)
{
    check_text("a\"b\\c/", "\"a\\\"b\\\\c/\"");
    check_text("\n\t\r", "\"\\n\\t\\r\"");
    check_text("a\nb\n\n c\n", "\"a\\nb\\n\\n c\\n\"");
    check_text("\b\f", "\"\\b\\f\"");
    check_text("\x01\x1f\x7f", "\"\\u0001\\u001F\x7f\"");
    check_text("\\n", "\"\\\\n\"");
}

#define REPLACED "\xEF\xBF\xBD" // U+FFFD

TEST(utf8)
{
    check_text("\xC3\xA9\xE2\x98\x83", "\"\xC3\xA9\xE2\x98\x83\"");
    check_text("\xF0\x9F\x98\x80", "\"\xF0\x9F\x98\x80\"");
    check_text("\xEF\xB7\x90\xEF\xBF\xBF", "\"\xEF\xB7\x90\xEF\xBF\xBF\""); // noncharacters
    check_text("a\xFF\xC3", "\"a" REPLACED REPLACED "\"");
    check_text("\xC0\x80", "\"" REPLACED REPLACED "\"");                    // an overlong NUL
    check_text("\xED\xA0\x80", "\"" REPLACED REPLACED REPLACED "\"");       // a surrogate
    check_text("\xF0\x9F\x98\"", "\"" REPLACED REPLACED REPLACED "\\\"\""); // cut short
    check_text(" \xFF ", "\" " REPLACED " \"");
}

TEST(long_text_stays_on_its_line)
{
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
    OWNED char *printed = json_printed(json);
    const char *start = strstr(printed, "\"n\": ");
    assert_non_null(start);
    char *end;
    double back = strtod(start + 5, &end);
    assert_string_equal(end, "\n}\n");
    return back;
}

TEST(numbers_read_back)
{
    const double values[] = {0,    1,       0.1,     1.0 / 3,      1e20, 1e300, 123456789012345678.0,
                             1e-7, DBL_MAX, DBL_MIN, DBL_TRUE_MIN, -2.5, 5e-5,  16777217};
    for (size_t i = 0; i < COUNT_OF(values); i++)
        assert_true(number_back(values[i]) == values[i]);
    assert_true(signbit(number_back(-0.0)));
}

TEST(number_words)
{
    Json *json = json_open();
    json_begin_array(json, "all");
    json_number(json, NULL, 0.1);
    json_number(json, NULL, 1e20);
    json_number(json, NULL, 1e308);
    json_number(json, NULL, -DBL_MAX);
    json_number(json, NULL, DBL_TRUE_MIN);
    json_number(json, NULL, -0.0);
    json_number(json, NULL, NAN);
    json_number(json, NULL, -INFINITY);
    json_count(json, NULL, 0);
    json_count(json, NULL, UINT64_MAX);
    json_bool(json, NULL, true);
    json_bool(json, NULL, false);
    json_text(json, NULL, NULL);
    json_end(json);
    OWNED char *printed = json_printed(json);
    assert_string_equal(printed, "{\n"
                                 "  \"all\": [\n"
                                 "    0.1,\n"
                                 "    1e+20,\n"
                                 "    1e+308,\n"
                                 "    -1.7976931348623157e+308,\n"
                                 "    5e-324,\n"
                                 "    -0,\n"
                                 "    null,\n"
                                 "    null,\n"
                                 "    0,\n"
                                 "    18446744073709551615,\n"
                                 "    true,\n"
                                 "    false,\n"
                                 "    null\n"
                                 "  ]\n"
                                 "}\n");
}

TEST(nesting)
{
    Json *json = json_open();
    json_begin_object(json, "empty");
    json_end(json);
    json_begin_array(json, "none");
    json_end(json);
    json_begin_array(json, "rows");
    json_begin_object(json, NULL);
    json_count(json, "a", 1);
    json_end(json);
    json_begin_array(json, NULL);
    json_count(json, NULL, 2);
    json_end(json);
    json_end(json);
    json_count(json, "last", 3);
    char *printed = json_printed(json);
    assert_string_equal(printed, "{\n"
                                 "  \"empty\": {},\n"
                                 "  \"none\": [],\n"
                                 "  \"rows\": [\n"
                                 "    {\n"
                                 "      \"a\": 1\n"
                                 "    },\n"
                                 "    [\n"
                                 "      2\n"
                                 "    ]\n"
                                 "  ],\n"
                                 "  \"last\": 3\n"
                                 "}\n");
    free(printed);

    printed = json_printed(json_open());
    assert_string_equal(printed, "{}\n");
    free(printed);
}

TEST(template)
{
    Json *json = json_open();
    json_addf(json, "text %s number %g infinite %g holds %d fails %d", "a", 0.25, INFINITY, true, false);
    json_addf(json, "small %u size %zu large %" PRIu64 " hash %016" PRIx64, 1U, (size_t)2,
              (uint64_t)INT64_MAX, (uint64_t)255);
    json_addf(json, "object {a [%u %u] b {c %g}} empty {} rows [", 3U, 4U, 0.5);
    json_addf(json, "{d %s} {}]", "e");
    char *printed = json_printed(json);
    json_t *read = json_loads(printed, 0, NULL);
    char *line = json_dumps(read, JSON_COMPACT);
    assert_string_equal(
        line, "{\"text\":\"a\",\"number\":0.25,\"infinite\":null,\"holds\":true,"
              "\"fails\":false,\"small\":1,\"size\":2,\"large\":9223372036854775807,"
              "\"hash\":\"00000000000000ff\",\"object\":{\"a\":[3,4],\"b\":{\"c\":0.5}},\"empty\":{},"
              "\"rows\":[{\"d\":\"e\"},{}]}");
    free(line);
    json_decref(read);
    free(printed);
}

static void wrong_template_write(void *number)
{
    switch (*(int *)number) {
    case 0:
        json_addf(json_open(), "a %i b %s", 1, "text");
        break;
    case 1:
        json_addf(json_open(), "a %x", 1U);
        break;
    default:
        json_addf(json_open(), "a_key_of_64_characters_that_is_one_more_than_a_template_may_have %d", true);
    }
}

TEST(wrong_templates)
{
    static const char *const messages[] = {"glint: JSON: the template has an unknown conversion: %i b %s\n",
                                           "glint: JSON: the template has an unknown conversion: %x\n",
                                           "glint: JSON: a key of the template is too long: a_key_of_64"};
    for (int i = 0; i < (int)COUNT_OF(messages); i++) {
        int number = i;
        const ChildEnd end = child_run(wrong_template_write, &number, sizeof number);
        assert_int_equal(end.status, EXIT_MACHINE);
        assert_non_null(strstr(end.errors, messages[i]));
    }
}

TEST(deep_nesting)
{
    enum { DEPTH = 1000 };
    Json *json = json_open();
    json_begin_array(json, "deep");
    for (int i = 0; i < DEPTH; i++)
        json_begin_array(json, NULL);
    OWNED char *printed = json_printed(json);
    json_error_t error;
    json_t *root = json_loads(printed, 0, &error);
    const json_t *innermost = json_object_get(root, "deep");
    int depth = 0;
    for (; json_array_size(innermost) == 1; depth++)
        innermost = json_array_get(innermost, 0);
    assert_int_equal(depth, DEPTH);
    json_decref(root);
}

static long allocations_left; // before one of jansson's fails

static void *allocate(size_t size)
{
    return allocations_left-- == 0 ? NULL : malloc(size);
}

static void text_write(void *left)
{
    json_set_alloc_funcs(allocate, free);
    allocations_left = *(long *)left;
    Json *json = json_open();
    json_text(json, "key", "value");
    free(json_printed(json));
    *(long *)left = allocations_left;
}

TEST(without_memory)
{
    assert_true(failures_without_memory(text_write) >= 2); // the key and the value
}

TEST_MAIN(NULL, NULL)
