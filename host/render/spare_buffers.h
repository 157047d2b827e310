// Buffers on the device that one launch has finished with and another will use. A driver for a GPU takes
// milliseconds to create such a buffer, because it pins memory of the host, and often less than a tenth of
// that for the launch.
#pragma once

#include "host/base/array.h"
#include "host/opencl/compute.h"

typedef ARRAY_OF(cl_mem) SpareBuffers;

// Returns the smallest spare buffer of at least `size` bytes, with undefined contents. Creates one if there
// is none, in place of the largest spare, so that there are never more buffers than were once used together.
// Returns NULL if the device failed. spare_buffer_release makes it a spare again; it accepts NULL.
cl_mem spare_buffer_acquire(SpareBuffers *spares, Compute *compute, size_t size);
void spare_buffer_release(SpareBuffers *spares, cl_mem buffer);
// Releases all spares.
void spare_buffers_free(SpareBuffers *spares);
