// Buffers on the device that one launch has finished with and another will use. A driver for a GPU takes
// milliseconds to create such a buffer, because it pins memory of the host, and often less than a tenth of
// that for the launch.
#pragma once

#include "host/opencl/compute.h"

typedef struct Renderer Renderer;

typedef struct {
    cl_mem *items;
    size_t count, capacity;
} SpareBuffers;

// Returns the smallest spare buffer of at least `size` bytes, with undefined contents. Creates one if there
// is none, in place of the largest spare, so that a renderer never has more buffers than it once used
// together. Returns NULL if the device failed. spare_buffer_release makes it a spare again; it accepts NULL.
cl_mem spare_buffer_acquire(Renderer *renderer, size_t size);
void spare_buffer_release(Renderer *renderer, cl_mem buffer);
