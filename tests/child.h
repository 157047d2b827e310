// Work in a process of its own: OpenCL reads its environment once a process, and a fault ends one.
#pragma once

#include <stddef.h>

typedef struct {
    int status;        // as exit() got it; -1: ended by a signal
    char errors[8192]; // the start of its standard error
} ChildEnd;

// Runs `work` on a copy of `result` and copies back what it left there.
ChildEnd child_run(void (*work)(void *result), void *result, size_t size);

// An empty folder for this test, also given out as XDG_CACHE_HOME, POCL_CACHE_DIR and TMPDIR; and its
// removal.
char *scratch_open(void);
void scratch_close(char *folder);
