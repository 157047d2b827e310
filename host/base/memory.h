// Allocation that never fails: lack of memory is a fault.
#pragma once

#include <stddef.h>

// None returns NULL; `zeroed` clears it. `count * size` is checked for overflow.
void *memory_allocate(size_t count, size_t size);
void *memory_allocate_zeroed(size_t count, size_t size);
void *memory_resize(void *memory, size_t count, size_t size);
char *memory_copy_text(const char *text);
char *memory_copy_part(const char *text, size_t length); // with a NUL behind it

// count * size, or a fault if that exceeds the address space.
size_t memory_product(size_t count, size_t size);

// From this size on memory_allocate_large uses large pages.
enum { MEMORY_LARGE_MIN = 1 << 22 };

// Allocates memory that an OpenCL device can use in place: it is aligned for OpenCL's largest type. From
// MEMORY_LARGE_MIN bytes on it has large pages if the system offers them, which spares a CPU that reads it at
// random most address translations. A page takes memory once it is written. Released by free(). Ends the
// program by a fault when memory runs out or the product overflows.
void *memory_allocate_large(size_t count, size_t size);
