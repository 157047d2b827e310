#include "tests/check.h"

#include "host/base/fault.h"

enum { TESTS_MAX = 64 };

static struct CMUnitTest tests[TESTS_MAX]; // the rest have no function, and cmocka omits them
static size_t test_count;

void test_register(const struct CMUnitTest *test)
{
    if (test_count == TESTS_MAX) fault("a test program has more than %d tests", TESTS_MAX);
    tests[test_count++] = *test;
}

int tests_run(int argument_count, char **arguments, CMFixtureFunction setup, CMFixtureFunction teardown)
{
    if (argument_count > 1) cmocka_set_test_filter(arguments[1]);
    return cmocka_run_group_tests(tests, setup, teardown);
}
