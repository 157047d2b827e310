#include "host/render/buffer_pool.h"

#include <stdlib.h>

cl_mem buffer_pool_acquire(BufferPool *pool, Compute *compute, size_t size)
{
    size_t chosen = 0, chosen_size = 0; // the largest until one fits, then the smallest that fits
    for (size_t i = 0; i < pool->count; i++) {
        size_t pooled_size = 0;
        clGetMemObjectInfo(pool->items[i], CL_MEM_SIZE, sizeof pooled_size, &pooled_size, NULL);
        if (i > 0 && (chosen_size < size ? pooled_size <= chosen_size
                                         : pooled_size < size || pooled_size >= chosen_size))
            continue;
        chosen = i;
        chosen_size = pooled_size;
    }
    if (pool->count > 0) {
        cl_mem buffer = pool->items[chosen];
        pool->items[chosen] = pool->items[--pool->count];
        if (chosen_size >= size) return buffer;
        buffer_release(buffer);
    }
    return buffer_create(compute, size, NULL, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR);
}

void buffer_pool_release(BufferPool *pool, cl_mem buffer)
{
    if (buffer) array_push(*pool, buffer);
}

void buffer_pool_free(BufferPool *pool)
{
    while (pool->count > 0)
        buffer_release(pool->items[--pool->count]);
    free(pool->items);
    *pool = (BufferPool){0};
}
