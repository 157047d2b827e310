// A file that replaces its target only when complete, so that a failure leaves the old file untouched: an
// unnamed file in the target's folder where the file system has those (O_TMPFILE), otherwise a temporary next
// to the target.
#pragma once

#include "host/base/message.h"
#include <stdbool.h>
#include <stdio.h>
#include <sys/types.h>

// An open OutputFile must not be moved in memory, because the list of those with a temporary refers to it.
typedef struct OutputFile {
    FILE *file;
    char *target;
    int folder; // the target's, if has_folder; a device or a pipe is written directly
    bool has_folder, is_private, is_finished;
    const char *name;                // of the target in its folder
    char *temporary;                 // the name in the folder until the rename, or NULL
    pid_t process;                   // that created the temporary, which a forked process keeps at its exit
    struct OutputFile *next_pending; // another file with a temporary
} OutputFile;

// Opens a file for `target` or, for `-`, standard output, which main flushes. On failure adds a message and
// returns false. output_abandon or an atexit handler removes the temporary. Temporaries of killed processes
// are removed when the next one is needed.
bool output_open(OutputFile *output, const char *target, MessageList *messages);
// Opens a file of mode 0600 for `name` in an open folder, which replaces any file of that name. It is not
// synced, so its contents may be lost in a crash.
bool output_open_private(OutputFile *output, int folder, const char *name, MessageList *messages);
// Writes bytes. On failure adds a message and returns false; the file stays open until it is abandoned.
bool output_write(OutputFile *output, const void *bytes, size_t size, MessageList *messages);
// Flushes, syncs and checks for write errors (disk full), which leaves only the renaming to output_commit.
// On failure adds a message and removes the temporary. output_commit must not follow.
bool output_finish(OutputFile *output, MessageList *messages);
// Finishes the file if it is not finished, renames it and syncs its folder. On failure adds a message and
// removes the temporary. An earlier file is untouched unless syncing the folder or closing fails, which
// follow the rename.
bool output_commit(OutputFile *output, MessageList *messages);
void output_abandon(OutputFile *output);
// Writes a whole file. On failure adds a message and returns false, with an earlier file as after
// output_commit.
bool output_write_file(const char *target, const void *bytes, size_t size, MessageList *messages);

// Returns whether `file_name` is a temporary for the target `name`.
bool output_is_temporary(const char *file_name, const char *name);
// Removes a temporary unless its process lives.
void output_remove_stale(int folder, const char *file_name);
