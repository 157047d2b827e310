// Files of a test, in an empty folder of its own.
#pragma once

#include <stddef.h>
#include <sys/types.h>

// For cmocka's group setup and teardown: the working folder is a new one, which is removed with all that is
// in it. The latter fails if glint has left a temporary file.
int folder_open(void **state);
int folder_close(void **state);

// Of files in the working folder, those with `part` in their names.
unsigned folder_count(const char *part);

// An empty folder, also given out as XDG_CACHE_HOME, POCL_CACHE_DIR and TMPDIR; and its removal.
char *scratch_open(void);
void scratch_close(char *folder);

// The same for cmocka's setup and teardown.
extern char *scratch;
int scratch_set_up(void **state);
int scratch_tear_down(void **state);

void file_write(const char *path, const char *text);
void file_write_bytes(const char *path, const void *bytes, size_t size);
void check_content(const char *path, const char *expected);
mode_t mode_of(const char *path); // its permissions alone
