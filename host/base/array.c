#include "host/base/array.h"

#include "host/base/fault.h"
#include "host/base/memory.h"

void *array_grow(void *items, size_t *capacity, size_t needed, size_t size)
{
    size_t grown = *capacity ? *capacity : 8;
    while (grown < needed) {
        if (__builtin_mul_overflow(grown, (size_t)2, &grown))
            fault("out of memory: %zu x %zu bytes", needed, size);
    }
    *capacity = grown;
    return memory_resize(items, grown, size);
}
