// The context, its queue, and what goes in and out of it.
#include "host/opencl/compute.h"

#include "host/base/fault.h"
#include <stdlib.h>
#include <sys/mman.h>

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

static cl_mem buffer_make(Compute *compute, size_t size, const void *bytes, cl_mem_flags flags)
{
    cl_int status;
    // OpenCL 1.2 takes the bytes as a pointer to non-const, and only reads them here (section 5.2.1).
    cl_mem buffer =
        clCreateBuffer(compute->context, flags, size ? size : 1, (void *)(uintptr_t)bytes, &status);
    if (status != CL_SUCCESS) {
        const Device *device = compute->device;
        const double mebi = 1024.0 * 1024.0;
        fault("clCreateBuffer: %s: %.1f MiB asked for; %s has %.1f MiB, at most %.1f MiB in one buffer",
              cl_status_name(status), (double)size / mebi, device->name, (double)device->memory_bytes / mebi,
              (double)device->largest_buffer_bytes / mebi);
    }
    return buffer;
}

cl_mem buffer_create(Compute *compute, size_t size, const void *bytes, cl_mem_flags flags)
{
    static const char nothing[1];
    if (!bytes) return buffer_make(compute, size, NULL, flags);
    return buffer_make(compute, size, size > 0 ? bytes : nothing, flags | CL_MEM_COPY_HOST_PTR);
}

// The largest type of OpenCL C has 128 bytes, and no device asks for buffers to begin at more than that.
enum { BUFFER_ALIGNMENT = 128, LARGE_PAGE = 1 << 21 };

static bool is_large(size_t size)
{
    return size >= 2 * (size_t)LARGE_PAGE;
}

void *buffer_bytes_allocate(size_t size)
{
    size_t alignment = is_large(size) ? LARGE_PAGE : BUFFER_ALIGNMENT;
    size_t rounded = (size / alignment + 1) * alignment;
    void *bytes = aligned_alloc(alignment, rounded);
    if (!bytes) fault("out of memory for a buffer of %zu bytes", size);
#ifdef MADV_HUGEPAGE
    if (is_large(size)) madvise(bytes, rounded, MADV_HUGEPAGE); // a wish: no harm if not granted
#endif
    return bytes;
}

static void CL_CALLBACK bytes_free(cl_mem buffer, void *bytes)
{
    (void)buffer;
    free(bytes);
}

cl_mem buffer_take(Compute *compute, size_t size, void *bytes)
{
    // what is small is copied: Oclgrind takes memory that it did not copy for uninitialised
    bool in_place = (compute->device->type & CL_DEVICE_TYPE_CPU) && is_large(size);
    cl_mem buffer = buffer_make(compute, size, bytes,
                                CL_MEM_READ_ONLY | (in_place ? CL_MEM_USE_HOST_PTR : CL_MEM_COPY_HOST_PTR));
    if (in_place)
        cl_must(clSetMemObjectDestructorCallback(buffer, bytes_free, bytes));
    else
        free(bytes);
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
