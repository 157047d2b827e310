// Opens the context and its queue, records its first failure, and handles buffers.
#include "host/opencl/compute.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/opencl/capture.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool compute_open(Compute *compute, const Device *device)
{
    *compute = (Compute){.device = device};
    const cl_context_properties properties[] = {CL_CONTEXT_PLATFORM, (cl_context_properties)device->platform,
                                                0};
    cl_int status;
    fault_record_call("clCreateContext");
    compute->context = clCreateContext(properties, 1, &device->id, NULL, NULL, &status);
    if (!compute_check_object(compute, compute->context, status, "clCreateContext")) return false;
    fault_record_call("clCreateCommandQueue");
    compute->queue = clCreateCommandQueue(compute->context, device->id, CL_QUEUE_PROFILING_ENABLE, &status);
    return compute_check_object(compute, compute->queue, status, "clCreateCommandQueue");
}

void compute_close(Compute *compute)
{
    if (compute->queue) clReleaseCommandQueue(compute->queue);
    if (compute->context) clReleaseContext(compute->context);
    if (compute->reference) compute_close(compute->reference);
    free(compute->reference);
    free(compute->failure.detail);
    capture_close(compute);
    *compute = (Compute){0};
}

// Records the failure and takes ownership of the detail.
static void failure_keep(Compute *compute, const char *call, cl_int status, char *detail)
{
    if (!compute_ok(compute)) {
        free(detail);
        return;
    }
    compute->failure.status = status;
    compute->failure.detail = detail;
    snprintf(compute->failure.call, sizeof compute->failure.call, "%.*s", (int)strcspn(call, "("), call);
}

void compute_fail(Compute *compute, const char *call, cl_int status, const char *detail, ...)
{
    char *text;
    ARGUMENTS_FORMAT(text, detail);
    failure_keep(compute, call, status, text);
}

bool compute_open_reference(Compute *compute, const Device *device)
{
    compute->reference = memory_allocate_zeroed(1, sizeof *compute->reference);
    compute_open(compute->reference, device);
    return compute_check_reference(compute);
}

bool compute_check_reference(Compute *compute)
{
    const Compute *reference = compute->reference;
    if (!reference || compute_ok(reference) || !compute_ok(compute)) return compute_ok(compute);
    OWNED char *text = compute_failure_text(reference);
    compute_fail(compute, reference->failure.call, reference->failure.status, "by its reference device: %s",
                 text);
    return false;
}

bool compute_check(Compute *compute, cl_int status, const char *call)
{
    fault_record_call(NULL);
    if (status != CL_SUCCESS) failure_keep(compute, call, status, NULL);
    return compute_ok(compute);
}

bool compute_check_object(Compute *compute, const void *object, cl_int status, const char *call)
{
    fault_record_call(NULL);
    if (status != CL_SUCCESS || !object) failure_keep(compute, call, status, NULL);
    return compute_ok(compute);
}

void compute_unmap(Compute *compute, cl_mem buffer, const void *mapped)
{
    if (!mapped) return;
    fault_record_call("clEnqueueUnmapMemObject");
    cl_int status = clEnqueueUnmapMemObject(compute->queue, buffer, (void *)(uintptr_t)mapped, 0, NULL, NULL);
    fault_record_call(NULL);
    if (status != CL_SUCCESS && compute->unmap_failure.status == CL_SUCCESS)
        compute->unmap_failure = (ComputeFailure){.call = "clEnqueueUnmapMemObject", .status = status};
}

static char *failure_text(const Compute *compute, const ComputeFailure *failure)
{
    Text text = {0};
    text_appendf(&text, "%s", failure->call);
    if (failure->status != CL_SUCCESS)
        text_appendf(&text, ": %s (%d)", cl_status_name(failure->status), failure->status);
    else if (!failure->is_of_host)
        text_appendf(&text, ": NULL with CL_SUCCESS");
    const Device *device = compute->device;
    text_appendf(&text, " on %s%s%s%s", device->name, device->pci[0] ? " at " : "", device->pci,
                 fault_limits());
    const char *meaning = cl_status_meaning(failure->call, failure->status);
    if (meaning) text_appendf(&text, ": %s", meaning);
    if (failure->detail) text_appendf(&text, ": %s", failure->detail);
    return text.items;
}

char *compute_failure_text(const Compute *compute)
{
    return failure_text(compute, &compute->failure);
}

char *compute_unmap_failure_text(const Compute *compute)
{
    return compute->unmap_failure.status ? failure_text(compute, &compute->unmap_failure) : NULL;
}

// Creates a buffer. OpenCL 1.2's pointer to the bytes is non-const, but with these flags the bytes are only
// read (section 5.2.1).
static cl_mem buffer_make(Compute *compute, size_t size, const void *bytes, cl_mem_flags flags)
{
    if (!compute_ok(compute)) return NULL;
    const Device *device = compute->device;
    cl_int status = CL_MEM_OBJECT_ALLOCATION_FAILURE;
    cl_mem buffer = NULL;
    // NVIDIA's driver allocates at the first use and would fail only then
    if (device->memory_bytes == 0 || size <= device->memory_bytes) {
        fault_record_call("clCreateBuffer");
        buffer = clCreateBuffer(compute->context, flags, size ? size : 1, (void *)(uintptr_t)bytes, &status);
        fault_record_call(NULL);
    }
    if (status != CL_SUCCESS || !buffer) {
        if (device->memory_bytes > 0 && device->largest_buffer_bytes > 0)
            compute_fail(compute, "clCreateBuffer", status,
                         "%s requested; the device has %s, at most %s in one buffer",
                         text_size((double)size).text, text_size((double)device->memory_bytes).text,
                         text_size((double)device->largest_buffer_bytes).text);
        else
            compute_fail(compute, "clCreateBuffer", status,
                         "%s requested; the device does not report its memory", text_size((double)size).text);
        return NULL;
    }
    return buffer;
}

cl_mem buffer_create(Compute *compute, size_t size, const void *bytes, cl_mem_flags flags)
{
    static const char nothing[1];
    if (!bytes) return buffer_make(compute, size, NULL, flags);
    return buffer_make(compute, size, size > 0 ? bytes : nothing, flags | CL_MEM_COPY_HOST_PTR);
}

void buffer_release(cl_mem buffer)
{
    if (buffer) clReleaseMemObject(buffer);
}

bool buffer_read(Compute *compute, cl_mem buffer, size_t size, void *bytes)
{
    return compute_try(compute,
                       clEnqueueReadBuffer(compute->queue, buffer, CL_TRUE, 0, size, bytes, 0, NULL, NULL));
}

bool buffer_write(Compute *compute, cl_mem buffer, size_t size, const void *bytes)
{
    return compute_try(compute,
                       clEnqueueWriteBuffer(compute->queue, buffer, CL_TRUE, 0, size, bytes, 0, NULL, NULL));
}

void *buffer_map(Compute *compute, cl_mem buffer, size_t begin, size_t size)
{
    if (!compute_ok(compute)) return NULL;
    cl_int status;
    fault_record_call("clEnqueueMapBuffer");
    void *mapped = clEnqueueMapBuffer(compute->queue, buffer, CL_TRUE, CL_MAP_WRITE_INVALIDATE_REGION, begin,
                                      size, 0, NULL, NULL, &status);
    return compute_check_object(compute, mapped, status, "clEnqueueMapBuffer") ? mapped : NULL;
}

static void CL_CALLBACK bytes_free(cl_mem buffer, void *bytes)
{
    (void)buffer;
    free(bytes);
}

cl_mem buffer_adopt(Compute *compute, size_t size, void *bytes)
{
    // small contents are copied: Oclgrind reports memory that it did not copy as uninitialized
    bool in_place = (compute->device->type & CL_DEVICE_TYPE_CPU) && size >= MEMORY_LARGE_MIN;
    cl_mem buffer = buffer_make(compute, size, bytes,
                                CL_MEM_READ_ONLY | (in_place ? CL_MEM_USE_HOST_PTR : CL_MEM_COPY_HOST_PTR));
    if (in_place && compute_try(compute, clSetMemObjectDestructorCallback(buffer, bytes_free, bytes)))
        return buffer;
    if (!compute_ok(compute)) {
        buffer_release(buffer);
        buffer = NULL;
    }
    free(bytes);
    return buffer;
}

static void argument_set(Compute *compute, cl_kernel kernel, cl_uint index, bool is_buffer, size_t size,
                         const void *value)
{
    if (!compute_ok(compute)) return;
    if (compute->device->capture_folder) capture_argument(compute, kernel, index, is_buffer, size, value);
    cl_int status = clSetKernelArg(kernel, index, size, value);
    if (status == CL_SUCCESS) return;
    char name[64] = "?";
    clGetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, sizeof name, name, NULL);
    compute_fail(compute, "clSetKernelArg", status, "argument %u of %s, %zu bytes", index, name, size);
}

void kernel_argument(Compute *compute, cl_kernel kernel, cl_uint index, size_t size, const void *value)
{
    argument_set(compute, kernel, index, false, size, value);
}

void kernel_buffer(Compute *compute, cl_kernel kernel, cl_uint index, cl_mem buffer)
{
    argument_set(compute, kernel, index, true, sizeof buffer, &buffer);
}
