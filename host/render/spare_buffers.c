#include "host/render/spare_buffers.h"

#include "host/base/array.h"
#include <stdlib.h>

cl_mem spare_buffer_acquire(SpareBuffers *spares, Compute *compute, size_t size)
{
    size_t chosen = 0, chosen_size = 0; // the largest until one fits, then the smallest that fits
    for (size_t i = 0; i < spares->count; i++) {
        size_t spare = 0;
        clGetMemObjectInfo(spares->items[i], CL_MEM_SIZE, sizeof spare, &spare, NULL);
        if (i > 0 && (chosen_size < size ? spare <= chosen_size : spare < size || spare >= chosen_size))
            continue;
        chosen = i;
        chosen_size = spare;
    }
    if (spares->count > 0) {
        cl_mem buffer = spares->items[chosen];
        spares->items[chosen] = spares->items[--spares->count];
        if (chosen_size >= size) return buffer;
        buffer_release(buffer);
    }
    return buffer_create(compute, size, NULL, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR);
}

void spare_buffer_release(SpareBuffers *spares, cl_mem buffer)
{
    if (buffer) array_push(*spares, buffer);
}

void spare_buffers_free(SpareBuffers *spares)
{
    while (spares->count > 0)
        buffer_release(spares->items[--spares->count]);
    free(spares->items);
    *spares = (SpareBuffers){0};
}
