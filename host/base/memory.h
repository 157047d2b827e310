// Allocates memory and never fails, since lack of memory is a fault.
#pragma once

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

// Return memory, never NULL. memory_allocate_zeroed clears it. `count * size` is checked for overflow.
void *memory_allocate(size_t count, size_t size);
void *memory_allocate_zeroed(size_t count, size_t size);
void *memory_resize(void *memory, size_t count, size_t size);
void *memory_copy(const void *items, size_t count, size_t size); // `items` may be NULL if count is 0
char *memory_copy_text(const char *text);
char *memory_copy_part(const char *text, size_t length); // ends the copy with a NUL

// Returns count * size, or ends the program by a fault if that exceeds the address space.
size_t memory_product(size_t count, size_t size);

// memory_allocate_large requests large pages for at least this many bytes.
enum { MEMORY_LARGE_MIN = 1 << 22 };

// Allocates memory that an OpenCL device can use in place, aligned for OpenCL's largest type. From
// MEMORY_LARGE_MIN bytes on it has large pages if the system offers them, which saves a CPU most address
// translations of random reads. A page takes memory once it is written. free() releases it. Ends the program
// by a fault when memory runs out or the product overflows.
void *memory_allocate_large(size_t count, size_t size);

// Frees the memory to which a variable points. For OWNED.
static inline void memory_free_owned(void *variable)
{
    void *memory;
    memcpy(&memory, variable, sizeof memory);
    free(memory);
}

// Declares a pointer whose memory is freed where its scope ends, as in `OWNED char *path =
// text_format(...);`, or an ARRAY_OF, whose items are freed. It must be initialized. The headers of other
// types that own memory define OwnedText, OwnedImage and so on in the same way.
#define OWNED __attribute__((cleanup(memory_free_owned)))

// Returns the pointer of an OWNED variable, which is NULL afterwards, so that the caller owns the memory.
static inline void *memory_release(void *variable)
{
    void *memory;
    memcpy(&memory, variable, sizeof memory);
    memset(variable, 0, sizeof memory);
    return memory;
}
