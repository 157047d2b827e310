// Provides what each test program of cmocka begins with: the includes that most of them need, and macros.
#pragma once

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/message.h"
#include "host/base/text.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

// Returns formatted text, valid until the fourth call after this one.
const char *formatted(const char *format, ...) __attribute__((format(printf, 1, 2)));

// Returns the larger of two errors, or NaN if one is NaN, so that every comparison with a bound then fails.
// fmax would drop NaN.
double error_max(double a, double b);

// Fails the test unless there is exactly one message, with this text. Frees the list.
void check_only_message(MessageList *messages, const char *expected);

// Registers a test. tests_run runs tests in the order of registration.
void test_register(const struct CMUnitTest *test);

// Runs the tests of the program, or those whose names match the pattern of its first argument, between the
// group's setup and teardown, which may be NULL. Returns the program's exit status.
int tests_run(int argument_count, char **arguments, CMFixtureFunction setup, CMFixtureFunction teardown);

// A constructor registers each test, so none can be left out. Its priority preserves source order.
#define TEST_REGISTER(name, ...)                                                                             \
    static const struct CMUnitTest name##_test = {#name, __VA_ARGS__};                                       \
    __attribute__((constructor(101 + __LINE__))) static void name##_register(void)                           \
    {                                                                                                        \
        test_register(&name##_test);                                                                         \
    }

// Defines a test that runs between a setup and a teardown.
#define TEST_WITH(name, setup, teardown)                                                                     \
    static void name(void **state);                                                                          \
    TEST_REGISTER(name, name, setup, teardown, NULL)                                                         \
    static void name(__attribute__((unused)) void **state)

// Defines a test.
#define TEST(name) TEST_WITH(name, NULL, NULL)

// Defines a test that calls a function with a pointer to its case as the state.
#define TEST_CASE(name, function, ...) TEST_REGISTER(name, function, NULL, NULL, __VA_ARGS__)

#define TEST_MAIN(setup, teardown)                                                                           \
    int main(int argument_count, char **arguments)                                                           \
    {                                                                                                        \
        return tests_run(argument_count, arguments, setup, teardown);                                        \
    }
