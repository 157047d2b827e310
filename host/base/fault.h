// Faults of the program or the machine: told once, then the process ends with exit status 2.
#pragma once

#include <stddef.h>

enum { EXIT_DONE = 0, EXIT_USER = 1, EXIT_MACHINE = 2, EXIT_CHECK = 3, EXIT_INTERRUPTED = 130 };

// Prints `glint: format…` to stderr and exits with EXIT_MACHINE.
_Noreturn void fault(const char *format, ...) __attribute__((format(printf, 1, 2)));

// Allocation that never returns NULL (memory that is not there is a fault); `zeroed` clears it.
// `count * size` is checked for overflow.
void *memory_allocate(size_t count, size_t size);
void *memory_allocate_zeroed(size_t count, size_t size);
void *memory_resize(void *memory, size_t count, size_t size);
char *memory_copy_text(const char *text);
