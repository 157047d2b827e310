// Writes launches of kernels to a folder, from which host/python/glint/locate.py re-runs them on any device.
#pragma once

#include "host/opencl/compute.h"

// A launch as the caller requests it, before it is fitted to the device.
typedef struct {
    cl_kernel kernel;
    const ProgramRequest *request; // of the kernel's program
    bool is_out_of_line;           // whether the program was built with the out-of-line prelude
    cl_uint dimensions;
    const size_t *first, *items, *group; // as for kernel_launch
} Launch;

// Writes a launch and the current contents of its buffers to the device's capture folder, if it has one. Each
// file is named by a hash of its contents, so that launches share texts and buffers. Sets the Compute's
// failure if a file cannot be written.
void capture_launch(Compute *compute, const Launch *launch);

// Records the value of an argument for the launches that follow.
void capture_argument(Compute *compute, cl_kernel kernel, cl_uint index, bool is_buffer, size_t size,
                      const void *value);
// Frees the recorded arguments.
void capture_close(Compute *compute);
