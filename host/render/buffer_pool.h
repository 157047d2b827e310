// Buffers on the device that one launch has finished with and another will use. A driver for a GPU takes
// milliseconds to create such a buffer, because it pins memory of the host, and often less than a tenth of
// that for the launch.
#pragma once

#include "host/base/array.h"
#include "host/opencl/compute.h"

typedef ARRAY_OF(cl_mem) BufferPool;

// Returns the smallest pooled buffer of at least `size` bytes, with undefined contents. If there is none,
// creates one in place of the largest pooled buffer, so that there are never more buffers than were once used
// together. Returns NULL if the device failed.
cl_mem buffer_pool_acquire(BufferPool *pool, Compute *compute, size_t size);
// Returns a buffer, or NULL, to the pool.
void buffer_pool_release(BufferPool *pool, cl_mem buffer);
// Releases all pooled buffers.
void buffer_pool_free(BufferPool *pool);
