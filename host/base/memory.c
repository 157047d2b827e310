#include "host/base/memory.h"

#include "host/base/fault.h"
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

static void *memory_must(void *memory, size_t count, size_t size)
{
    if (!memory) fault("out of memory: %zu x %zu bytes", count, size);
    return memory;
}

size_t memory_product(size_t count, size_t size)
{
    size_t total;
    if (__builtin_mul_overflow(count, size, &total)) fault("out of memory: %zu x %zu bytes", count, size);
    return total;
}

// Returns the bytes to allocate, at least one, so that NULL always means failure.
static size_t memory_size(size_t count, size_t size)
{
    const size_t total = memory_product(count, size);
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

void *memory_copy(const void *items, size_t count, size_t size)
{
    void *copy = memory_allocate(count, size);
    if (count > 0) memcpy(copy, items, count * size);
    return copy;
}

char *memory_copy_text(const char *text)
{
    return memory_copy_part(text, strlen(text));
}

char *memory_copy_part(const char *text, size_t length)
{
    char *copy = memory_allocate(length + 1, 1);
    memcpy(copy, text, length);
    copy[length] = '\0';
    return copy;
}

// The largest type of OpenCL C has 128 bytes, and no device requires more alignment than that.
enum { DEVICE_ALIGNMENT = 128, LARGE_PAGE = 1 << 21 };

void *memory_allocate_large(size_t count, size_t size)
{
    const size_t total = memory_size(count, size),
                 alignment = total >= MEMORY_LARGE_MIN ? LARGE_PAGE : DEVICE_ALIGNMENT;
    if (total > SIZE_MAX - alignment) fault("out of memory: %zu x %zu bytes", count, size);
    const size_t rounded = (total + alignment - 1) / alignment * alignment;
    void *memory = memory_must(aligned_alloc(alignment, rounded), count, size);
#ifdef MADV_HUGEPAGE
    if (alignment == LARGE_PAGE) madvise(memory, rounded, MADV_HUGEPAGE); // a hint: no harm if ignored
#endif
    return memory;
}
