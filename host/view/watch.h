// Reports when one of some files changes: is written, or replaced by another of its name, as many editors do.
#pragma once

#include <stddef.h>

typedef struct Watch Watch;

// Calls `changed` on a thread of its own. NULL: the system cannot watch files.
Watch *watch_open(void (*changed)(void *context), void *context);
void watch_close(Watch *watch); // accepts NULL
// Watches these files instead of those before, whether they exist or not. Accepts NULL.
void watch_set(Watch *watch, const char *const *paths, size_t count);
