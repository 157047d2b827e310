#include "tests/check.h"

#include "host/base/fault.h"

enum { TESTS_MAX = 64 };

static struct CMUnitTest tests[TESTS_MAX];
static size_t test_count;

void test_register(const struct CMUnitTest *test)
{
    if (test_count == TESTS_MAX) fault("a test program has more than %d tests", TESTS_MAX);
    tests[test_count++] = *test;
}

int tests_run(int argument_count, char **arguments, CMFixtureFunction setup, CMFixtureFunction teardown)
{
    if (argument_count > 1) cmocka_set_test_filter(arguments[1]);
    return _cmocka_run_group_tests("tests", tests, test_count, setup, teardown);
}

double error_max(double a, double b)
{
    return a > b || isnan(a) ? a : b;
}

void check_only_message(MessageList *messages, const char *expected)
{
    assert_int_equal(messages->count, 1);
    assert_string_equal(messages->items[0].text, expected);
    message_list_free(messages);
}

const char *formatted(const char *format, ...)
{
    static char *texts[4];
    static size_t next;
    char **text = &texts[next++ % COUNT_OF(texts)];
    free(*text);
    va_list arguments;
    va_start(arguments, format);
    if (vasprintf(text, format, arguments) < 0) fault("out of memory");
    va_end(arguments);
    return *text;
}
