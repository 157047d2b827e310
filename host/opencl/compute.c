// The context, its queue, and what goes in and out of it.
#include "host/opencl/compute.h"

#include "host/base/fault.h"

void compute_open(Compute *compute, const Device *device)
{
    *compute = (Compute){.device = device};
    const cl_context_properties properties[] = {CL_CONTEXT_PLATFORM, (cl_context_properties)device->platform,
                                                0};
    cl_int status;
    compute->context = clCreateContext(properties, 1, &device->id, NULL, NULL, &status);
    cl_check(status, "clCreateContext");
    compute->queue = clCreateCommandQueue(compute->context, device->id, CL_QUEUE_PROFILING_ENABLE, &status);
    cl_check(status, "clCreateCommandQueue");
}

void compute_close(Compute *compute)
{
    if (compute->queue) clReleaseCommandQueue(compute->queue);
    if (compute->context) clReleaseContext(compute->context);
    *compute = (Compute){0};
}

cl_mem buffer_create(Compute *compute, size_t size, const void *bytes, cl_mem_flags flags)
{
    static const char nothing[1];
    if (bytes) flags |= CL_MEM_COPY_HOST_PTR;
    const void *source = size == 0 && bytes ? nothing : bytes;
    cl_int status;
    // OpenCL 1.2 takes the source as a pointer to non-const, and only reads it here (section 5.2.1).
    cl_mem buffer =
        clCreateBuffer(compute->context, flags, size ? size : 1, (void *)(uintptr_t)source, &status);
    if (status != CL_SUCCESS) {
        const Device *device = compute->device;
        const double mebi = 1024.0 * 1024.0;
        fault("clCreateBuffer: %s: %.1f MiB asked for; %s has %.1f MiB, at most %.1f MiB in one buffer",
              cl_status_name(status), (double)size / mebi, device->name, (double)device->memory_bytes / mebi,
              (double)device->largest_buffer_bytes / mebi);
    }
    return buffer;
}

void kernel_argument(cl_kernel kernel, cl_uint index, size_t size, const void *value)
{
    cl_int status = clSetKernelArg(kernel, index, size, value);
    if (status == CL_SUCCESS) return;
    char name[64] = "?";
    clGetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, sizeof name, name, NULL);
    fault("clSetKernelArg: argument %u of %s, %zu bytes: %s", index, name, size, cl_status_name(status));
}
