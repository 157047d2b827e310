// Formats that assimp reads, in a process of their own: this program, started again, with limits on memory
// and time. What it read comes back through a pipe and is checked, so that no file can crash, hang or bloat
// glint.
#pragma once

#include "host/import/mesh/draft.h"
#include <stdio.h>

// The exit status if the arguments are those of such a process, which has done its work then; else -1. The
// first thing that main does.
int assimp_process_main(int argument_count, char **arguments);

enum { ASSIMP_MEBIBYTES_MAX = 4096, ASSIMP_PROCESSOR_SECONDS_MAX = 60, ASSIMP_SECONDS_MAX = 120 };

// Limits this process as such a one; limits that are lower stay.
void assimp_process_limit(void);

// Returns whether assimp reads files whose names end so.
bool assimp_knows(const char *path);

// Of assimp alone, in such a process.
bool assimp_read(MeshDraft *draft);

// What such a process wrote; false if it is not whole or not sound. `read` is what assimp_read returned.
bool assimp_reply_read(MeshDraft *draft, FILE *reply, bool *read);
