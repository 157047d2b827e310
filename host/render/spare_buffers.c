#include "host/render/spare_buffers.h"

#include "host/base/array.h"
#include "host/render/renderer_state.h"

static size_t buffer_size(cl_mem buffer)
{
    size_t size = 0;
    return clGetMemObjectInfo(buffer, CL_MEM_SIZE, sizeof size, &size, NULL) == CL_SUCCESS ? size : 0;
}

cl_mem spare_buffer_acquire(Renderer *renderer, size_t size)
{
    SpareBuffers *spares = &renderer->spares;
    size_t best = spares->count, best_size = SIZE_MAX, largest = 0, largest_size = 0;
    for (size_t i = 0; i < spares->count && best_size > size; i++) {
        const size_t spare = buffer_size(spares->items[i]);
        if (spare >= size && spare < best_size) {
            best = i;
            best_size = spare;
        }
        if (spare > largest_size) {
            largest = i;
            largest_size = spare;
        }
    }
    const size_t chosen = best < spares->count ? best : largest;
    if (chosen < spares->count) {
        cl_mem buffer = spares->items[chosen];
        spares->items[chosen] = spares->items[--spares->count];
        if (chosen == best) return buffer;
        buffer_release(buffer);
    }
    return buffer_create(renderer->compute, size, NULL, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR);
}

void spare_buffer_release(Renderer *renderer, cl_mem buffer)
{
    if (buffer) array_push(renderer->spares, buffer);
}
