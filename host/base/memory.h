// Allocation that never fails: lack of memory is a fault.
#pragma once

#include <stddef.h>

// None returns NULL; `zeroed` clears it. `count * size` is checked for overflow.
void *memory_allocate(size_t count, size_t size);
void *memory_allocate_zeroed(size_t count, size_t size);
void *memory_resize(void *memory, size_t count, size_t size);
char *memory_copy_text(const char *text);
