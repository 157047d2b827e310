// Runs work in a separate process, since OpenCL reads its environment once per process, and a fault ends one.
#pragma once

#include <stddef.h>

typedef struct {
    int status;        // the argument of exit(), or -1 if a signal ended the process
    int signal;        // that signal, or 0
    char errors[8192]; // the start of its standard error
} ChildEnd;

// The status with which the work exits if there is no device.
enum { NO_DEVICE = 77 };

// Runs `work` on a copy of `result` and copies back what it left there.
ChildEnd child_run(void (*work)(void *result), void *result, size_t size);
// Also skips the test if the work exits with NO_DEVICE.
ChildEnd child_run_with_device(void (*work)(void *result), void *result, size_t size);

// Runs work in children, in which the first allocation fails, then the second, and so on until all succeed,
// and checks that each failure is reported. Returns the number of failures. `left` is the number of
// allocations that succeed, from which the work subtracts its own.
unsigned failures_without_memory(void (*work)(void *left));
