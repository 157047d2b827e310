// Runs work in a separate process, since OpenCL reads its environment once per process, and a fault ends one.
#pragma once

#include <stddef.h>

typedef struct {
    int status;        // the argument of exit(), or -1 if a signal ended the process
    int signal;        // that signal, or 0
    char errors[8192]; // the start of its standard error
} ChildEnd;

// Runs `work` on a copy of `result` and copies back what it left there.
ChildEnd child_run(void (*work)(void *result), void *result, size_t size);
