// A file written beside its target and renamed when complete, so that a failure leaves the old file
// untouched.
#pragma once

#include "host/base/message.h"
#include <stdbool.h>
#include <stdio.h>

typedef struct {
    FILE *file;
    char *target, *temporary;
} OutputFile;

// Opens a file beside `target`, or, for `-`, standard output, whose errors main reports. On failure adds a
// message and returns false. output_abandon removes the temporary; so does an atexit handler.
bool output_open(OutputFile *output, const char *target, MessageList *messages);
// On failure adds a message and returns false; the file stays open until it is abandoned.
bool output_write(OutputFile *output, const void *bytes, size_t size, MessageList *messages);
// Flushes, checks for write errors (disk full) and closes, which leaves only the renaming to output_commit.
// On failure adds a message and removes the temporary.
bool output_finish(OutputFile *output, MessageList *messages);
// Finishes the file if it is not finished, and renames it. On failure adds a message and removes the
// temporary.
bool output_commit(OutputFile *output, MessageList *messages);
void output_abandon(OutputFile *output);
