// Reads assimp's formats in a separate process that runs this program with limits on memory and time. The
// result returns through a pipe and is checked, so that no file can crash, block or bloat glint.
#pragma once

#include "host/import/mesh/draft.h"
#include <stdio.h>

// Runs the reading process if the arguments ask for one and returns its exit status, otherwise -1. main
// calls it first.
int assimp_process_main(int argument_count, char **arguments);

enum { ASSIMP_MEBIBYTES_MAX = 4096, ASSIMP_PROCESSOR_SECONDS_MAX = 60, ASSIMP_SECONDS_MAX = 120 };

// Sets the reading process's limits for this process. Lower existing limits stay.
void assimp_process_limit(void);

// Returns whether assimp reads files with the name's ending.
bool assimp_knows(const char *path);

// Reads the file with assimp. Runs in the reading process.
bool assimp_read(MeshDraft *draft);

// assimp_reply.c

// Writes what assimp_read has added to the draft, to its scene and to its messages.
void assimp_reply_write(MeshDraft *draft, FILE *reply, bool is_read);
// Reads the reply of a reading process and sets *read to the result of assimp_read there. Returns false if
// the reply is incomplete or invalid.
bool assimp_reply_read(MeshDraft *draft, FILE *reply, bool *read);
