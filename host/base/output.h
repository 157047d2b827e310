// A file written beside its target and renamed when whole, so that a failure leaves the old file untouched.
#pragma once

#include "host/base/message.h"
#include <stdbool.h>
#include <stdio.h>

typedef struct {
    FILE *file;
    char *target, *temporary;
} OutputFile;

// Opens a file beside `target`. On failure adds a message and returns false. `-` is standard output, of which
// main tells whether it could be written.
// The temporary is removed by output_abandon, also from an atexit handler if the process faults.
bool output_open(OutputFile *output, const char *target, MessageList *messages);
// On failure adds a message and returns false; the file stays open, to be abandoned.
bool output_write(OutputFile *output, const void *bytes, size_t size, MessageList *messages);
// Flushes, checks for write errors (disk full), closes: only the renaming is left to output_commit. On
// failure adds a message, removes the temporary.
bool output_settle(OutputFile *output, MessageList *messages);
// Settles the file unless it is, and renames it. On failure adds a message, removes the temporary.
bool output_commit(OutputFile *output, MessageList *messages);
void output_abandon(OutputFile *output);
