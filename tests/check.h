// Provides the includes and macros that each test program of cmocka begins with.
#pragma once

#include "host/base/array.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

// A test that keeps no state.
#define TEST(name) static void name(__attribute__((unused)) void **state)
