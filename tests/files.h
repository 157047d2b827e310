// Creates the files of a test in a separate, empty folder.
#pragma once

#include "host/base/text.h"
#include <stddef.h>
#include <sys/types.h>

// Creates an empty folder below /tmp, which folder_remove removes with its contents.
char *folder_make(void);
void folder_remove(char *folder);

// cmocka's group setup and teardown. The working folder is a new one, which is removed with its contents. The
// teardown fails if glint has left a temporary file.
int folder_open(void **state);
int folder_close(void **state);

// Returns the number of files in the working folder that have `part` in their names.
unsigned folder_count(const char *part);

// Creates an empty folder for XDG_CACHE_HOME, POCL_CACHE_DIR and TMPDIR, which scratch_close removes.
char *scratch_open(void);
void scratch_close(char *folder);

// The folder that cmocka's setup and teardown below open and close.
extern char *scratch;
int scratch_set_up(void **state);
int scratch_tear_down(void **state);

void file_write(const char *path, const char *text);
void file_write_bytes(const char *path, const void *bytes, size_t size);
Text file_text(const char *path); // of a readable file
void check_content(const char *path, const char *expected);
mode_t mode_of(const char *path); // the permissions alone
