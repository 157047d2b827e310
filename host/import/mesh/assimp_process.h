// Reads formats of assimp in a separate process: this program, started again, with limits on memory and time.
// What it read comes back through a pipe and is checked, so that no file can crash, hang or bloat glint.
#pragma once

#include "host/import/mesh/draft.h"
#include <stdio.h>

// Runs such a process if the arguments are those of one, and returns its exit status, otherwise -1. main
// calls it first.
int assimp_process_main(int argument_count, char **arguments);

enum { ASSIMP_MEBIBYTES_MAX = 4096, ASSIMP_PROCESSOR_SECONDS_MAX = 60, ASSIMP_SECONDS_MAX = 120 };

// Limits this process as such a process; lower limits stay.
void assimp_process_limit(void);

// Returns whether assimp reads files whose names end so.
bool assimp_knows(const char *path);

// Reads the file by assimp, in such a process.
bool assimp_read(MeshDraft *draft);

// Reads what such a process wrote. Returns false if it is not whole or not sound. `read` is what assimp_read
// returned.
bool assimp_reply_read(MeshDraft *draft, FILE *reply, bool *read);
