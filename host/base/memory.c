#include "host/base/memory.h"

#include "host/base/fault.h"
#include <stdlib.h>
#include <string.h>

static void *memory_must(void *memory, size_t count, size_t size)
{
    if (!memory) fault("out of memory: %zu x %zu bytes", count, size);
    return memory;
}

// An empty allocation is one byte, so that NULL always means failure.
static size_t memory_size(size_t count, size_t size)
{
    size_t total;
    if (__builtin_mul_overflow(count, size, &total)) fault("out of memory: %zu x %zu bytes", count, size);
    return total ? total : 1;
}

void *memory_allocate(size_t count, size_t size)
{
    return memory_must(malloc(memory_size(count, size)), count, size);
}

void *memory_allocate_zeroed(size_t count, size_t size)
{
    return memory_must(calloc(1, memory_size(count, size)), count, size);
}

void *memory_resize(void *memory, size_t count, size_t size)
{
    return memory_must(realloc(memory, memory_size(count, size)), count, size);
}

char *memory_copy_text(const char *text)
{
    size_t size = strlen(text) + 1;
    return memcpy(memory_allocate(size, 1), text, size);
}
