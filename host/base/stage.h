// Records the stage and the progress of a long operation for another thread to show. A NULL Stage records
// nothing.
#pragma once

#include "host/base/text.h"
#include <stddef.h>

typedef struct Stage Stage;

// A period of the host's work, by clock_seconds.
typedef struct {
    const char *name;
    double start_seconds, end_seconds;
} HostSpan;

// Opens a stage. If `keeps_spans` is set, it keeps each ended stage until stage_close, and ignores stages
// that other threads begin and end.
Stage *stage_open(bool keeps_spans);
void stage_close(Stage *stage);
// Returns the `*count` stages that have ended, in the order in which they began. No other thread may use the
// stage while the result is read.
const HostSpan *stage_spans(const Stage *stage, size_t *count);

// Sets the stage to `what`, such as "reading", of the file at `path`, which may be NULL, with none of `total`
// done. A `total` of 0 means that progress is not counted. The first stage starts the operation.
void stage_begin(Stage *stage, const char *what, const char *path, size_t total);
// Ends the operation.
void stage_end(Stage *stage);

// Sets how much of the stage's total is done.
void stage_set(Stage *stage, size_t done);
// Adds to the amount that is done. Any number of threads may call this.
void stage_add(Stage *stage, size_t count);

// Appends the stage, such as "reading bunny.obj 41%", and sets for how many seconds the operation has lasted.
// Returns false if no operation is in progress.
bool stage_write(Stage *stage, Text *text, double *seconds);
