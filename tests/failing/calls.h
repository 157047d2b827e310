// Makes calls fail on demand. The linker puts the functions __wrap_… of calls.c in the place of those that
// glint calls (ld --wrap, see the Makefile). An OpenCL call without one does not link.
#pragma once

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define EVERY_CALL SIZE_MAX

enum { FAILED_ASSERTION = -1 }; // of the driver, in place of a signal

typedef struct {
    const char *call;  // the function that fails; NULL: none
    size_t index;      // at which of its calls, from 0, or EVERY_CALL
    bool returns_null; // with CL_SUCCESS
    int crash;         // or the signal that ends the driver, or FAILED_ASSERTION; 0: none
    bool in_threads;   // only calls of other threads than the first are counted and fail
} InjectedFailure;

extern InjectedFailure injected;
extern pthread_t first_thread;
extern bool first_is_tiny; // the first device reports that its buffers have at most one byte
extern bool disk_is_full;
extern atomic_long live_count; // objects created and mapped, less those released

typedef struct {
    const char *call;
    size_t count;
} CallCount;

enum { CALL_COUNTS = 64 };
extern CallCount
    call_counts[CALL_COUNTS]; // of the calls since call_counts_clear, ended by one without a name

void call_counts_clear(void);
// Returns the count of a function, which need not have been called.
CallCount *call_count(const char *call);
