// Reports when a watched file, or the file to which a symbolic link leads, is written or replaced by another
// of its name, as many editors do.
#pragma once

#include <stddef.h>

typedef struct Watch Watch;

// Opens a watch that calls `changed` on a separate thread, with the path as passed to watch_add or
// watch_only. `changed` must not call these functions. The path is NULL if any file may have changed. Returns
// NULL and prints a warning if the system cannot watch files.
Watch *watch_open(void (*changed)(void *context, const char *path), void *context);
void watch_close(Watch *watch); // accepts NULL
// watch_only watches this file alone, watch_add in addition to others. The file need not exist. Both accept
// NULL, and print a warning if the system cannot watch it.
void watch_only(Watch *watch, const char *path);
void watch_add(Watch *watch, const char *path);
