// What a long operation is doing and how much of that is done, for another thread to show. With a NULL Stage
// nothing is noted.
#pragma once

#include "host/base/text.h"
#include <stddef.h>

typedef struct Stage Stage;

Stage *stage_open(void);
void stage_close(Stage *stage);

// The operation is now at `what`, such as "reading", of the file at `path`, which may be NULL; nothing of
// `total` is done, 0: it is not counted. The first stage starts the operation.
void stage_begin(Stage *stage, const char *what, const char *path, size_t total);
// The operation is over.
void stage_end(Stage *stage);

// How much of the stage's total is done.
void stage_set(Stage *stage, size_t done);
// By any number of threads.
void stage_add(Stage *stage, size_t count);

// Appends the stage, such as "reading bunny.obj 41%", and sets for how many seconds the operation has lasted.
// False: none is under way.
bool stage_write(Stage *stage, Text *text, double *seconds);
