#include "tests/failing/calls.h"
#include "host/opencl/device.h"
#include <assert.h>
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>

InjectedFailure injected;
pthread_t first_thread;
bool first_is_tiny, disk_is_full;
atomic_long live_count;
CallCount call_counts[CALL_COUNTS];

static pthread_mutex_t counts_mutex = PTHREAD_MUTEX_INITIALIZER;

void call_counts_clear(void)
{
    memset(call_counts, 0, sizeof call_counts);
}

CallCount *call_count(const char *call)
{
    CallCount *count = call_counts;
    while (count->call && strcmp(count->call, call) != 0)
        count++;
    count->call = call;
    return count;
}

static bool call_fails(const char *call)
{
    if (injected.in_threads && pthread_equal(pthread_self(), first_thread)) return false;
    pthread_mutex_lock(&counts_mutex);
    size_t index = call_count(call)->count++;
    pthread_mutex_unlock(&counts_mutex);
    bool fails = injected.call && strcmp(injected.call, call) == 0 &&
                 (injected.index == index || injected.index == EVERY_CALL);
    if (fails && injected.crash == SIGABRT) abort();
    if (fails && injected.crash == FAILED_ASSERTION) {
        signal(SIGABRT, SIG_DFL); // as LLVM leaves it
        __assert_fail("lib != NULL", "driver.cc", 1, "getKernelLibrary");
    }
    while (fails && injected.crash) // as a wrong access would again; LLVM's handler only resets the signal's
        raise(injected.crash);
    return fails;
}

// Defines a call that returns a status. It is not made where it fails.
#define STATUS(name, parameters, arguments)                                                                  \
    cl_int __real_##name parameters;                                                                         \
    cl_int __wrap_##name parameters;                                                                         \
    cl_int __wrap_##name parameters                                                                          \
    {                                                                                                        \
        return call_fails(#name) ? CL_OUT_OF_RESOURCES : __real_##name arguments;                            \
    }

// Defines a call that releases. It is made even where it fails, so that nothing is left in the driver.
#define RELEASE(name, parameters, arguments)                                                                 \
    cl_int __real_##name parameters;                                                                         \
    cl_int __wrap_##name parameters;                                                                         \
    cl_int __wrap_##name parameters                                                                          \
    {                                                                                                        \
        live_count--;                                                                                        \
        cl_int released = __real_##name arguments;                                                           \
        return call_fails(#name) ? CL_OUT_OF_RESOURCES : released;                                           \
    }

#define CREATE(type, name, parameters, arguments)                                                            \
    type __real_##name parameters;                                                                           \
    type __wrap_##name parameters;                                                                           \
    type __wrap_##name parameters                                                                            \
    {                                                                                                        \
        if (call_fails(#name)) {                                                                             \
            *status = injected.returns_null ? CL_SUCCESS : CL_OUT_OF_RESOURCES;                              \
            return NULL;                                                                                     \
        }                                                                                                    \
        type object = __real_##name arguments;                                                               \
        live_count += object != NULL;                                                                        \
        return object;                                                                                       \
    }

cl_int __real_clGetDeviceInfo(cl_device_id, cl_device_info, size_t, void *, size_t *);
cl_int __wrap_clGetDeviceInfo(cl_device_id, cl_device_info, size_t, void *, size_t *);
cl_int __wrap_clGetDeviceInfo(cl_device_id id, cl_device_info what, size_t size, void *value, size_t *needed)
{
    static cl_device_id first;
    if (call_fails("clGetDeviceInfo")) return CL_OUT_OF_RESOURCES;
    const cl_int status = __real_clGetDeviceInfo(id, what, size, value, needed);
    if (!first) first = id;
    if (first_is_tiny && id == first && what == CL_DEVICE_MAX_MEM_ALLOC_SIZE) *(cl_ulong *)value = 1;
    return status;
}

// A command whose event is requested creates one.
#define EVENT(event) ((void)live_count++, (event))

typedef void(CL_CALLBACK *ContextNotify)(const char *, const void *, size_t, void *);
typedef void(CL_CALLBACK *ProgramNotify)(cl_program, void *);
typedef void(CL_CALLBACK *MemoryNotify)(cl_mem, void *);

// clang-format off
STATUS(clGetPlatformIDs, (cl_uint n, cl_platform_id *ids, cl_uint *count), (n, ids, count))
STATUS(clGetPlatformInfo, (cl_platform_id id, cl_platform_info what, size_t size, void *value, size_t *needed),
       (id, what, size, value, needed))
STATUS(clGetDeviceIDs, (cl_platform_id id, cl_device_type type, cl_uint n, cl_device_id *ids, cl_uint *count),
       (id, type, n, ids, count))
CREATE(cl_context, clCreateContext, (const cl_context_properties *properties, cl_uint n, const cl_device_id *ids,
       ContextNotify notify, void *data, cl_int *status), (properties, n, ids, notify, data, status))
CREATE(cl_command_queue, clCreateCommandQueue, (cl_context context, cl_device_id id,
       cl_command_queue_properties properties, cl_int *status), (context, id, properties, status))
CREATE(cl_mem, clCreateBuffer, (cl_context context, cl_mem_flags flags, size_t size, void *bytes, cl_int *status),
       (context, flags, size, bytes, status))
CREATE(cl_program, clCreateProgramWithSource, (cl_context context, cl_uint n, const char **texts,
       const size_t *lengths, cl_int *status), (context, n, texts, lengths, status))
CREATE(cl_program, clCreateProgramWithBinary, (cl_context context, cl_uint n, const cl_device_id *ids,
       const size_t *lengths, const unsigned char **binaries, cl_int *statuses, cl_int *status),
       (context, n, ids, lengths, binaries, statuses, status))
CREATE(cl_kernel, clCreateKernel, (cl_program program, const char *name, cl_int *status), (program, name, status))
RELEASE(clReleaseContext, (cl_context context), (context))
RELEASE(clReleaseCommandQueue, (cl_command_queue queue), (queue))
RELEASE(clReleaseMemObject, (cl_mem buffer), (buffer))
RELEASE(clReleaseProgram, (cl_program program), (program))
RELEASE(clReleaseKernel, (cl_kernel kernel), (kernel))
RELEASE(clReleaseEvent, (cl_event event), (event))

STATUS(clSetMemObjectDestructorCallback, (cl_mem buffer, MemoryNotify notify, void *data), (buffer, notify, data))
STATUS(clGetMemObjectInfo, (cl_mem buffer, cl_mem_info what, size_t size, void *value, size_t *needed),
       (buffer, what, size, value, needed))
STATUS(clBuildProgram, (cl_program program, cl_uint n, const cl_device_id *ids, const char *options,
       ProgramNotify notify, void *data), (program, n, ids, options, notify, data))
STATUS(clGetProgramBuildInfo, (cl_program program, cl_device_id id, cl_program_build_info what, size_t size,
       void *value, size_t *needed), (program, id, what, size, value, needed))
STATUS(clGetProgramInfo, (cl_program program, cl_program_info what, size_t size, void *value, size_t *needed),
       (program, what, size, value, needed))
STATUS(clGetKernelInfo, (cl_kernel kernel, cl_kernel_info what, size_t size, void *value, size_t *needed),
       (kernel, what, size, value, needed))
STATUS(clGetKernelWorkGroupInfo, (cl_kernel kernel, cl_device_id id, cl_kernel_work_group_info what, size_t size,
       void *value, size_t *needed), (kernel, id, what, size, value, needed))
STATUS(clSetKernelArg, (cl_kernel kernel, cl_uint index, size_t size, const void *value),
       (kernel, index, size, value))
STATUS(clEnqueueReadBuffer, (cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size,
       void *bytes, cl_uint n, const cl_event *list, cl_event *event),
       (queue, buffer, blocking, offset, size, bytes, n, list, event))
STATUS(clEnqueueWriteBuffer, (cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size,
       const void *bytes, cl_uint n, const cl_event *list, cl_event *event),
       (queue, buffer, blocking, offset, size, bytes, n, list, event))
STATUS(clFinish, (cl_command_queue queue), (queue))
STATUS(clWaitForEvents, (cl_uint n, const cl_event *list), (n, list))
STATUS(clGetEventInfo, (cl_event event, cl_event_info what, size_t size, void *value, size_t *needed),
       (event, what, size, value, needed))
STATUS(clGetEventProfilingInfo, (cl_event event, cl_profiling_info what, size_t size, void *value, size_t *needed),
       (event, what, size, value, needed))

RELEASE(clEnqueueUnmapMemObject, (cl_command_queue queue, cl_mem buffer, void *mapped, cl_uint n,
        const cl_event *list, cl_event *event), (queue, buffer, mapped, n, list, event))
CREATE(void *, clEnqueueMapBuffer, (cl_command_queue queue, cl_mem buffer, cl_bool blocking, cl_map_flags flags,
       size_t offset, size_t size, cl_uint n, const cl_event *list, cl_event *event, cl_int *status),
       (queue, buffer, blocking, flags, offset, size, n, list, EVENT(event), status))
STATUS(clEnqueueNDRangeKernel, (cl_command_queue queue, cl_kernel kernel, cl_uint dimensions, const size_t *offset,
       const size_t *global, const size_t *local, cl_uint n, const cl_event *list, cl_event *event),
       (queue, kernel, dimensions, offset, global, local, n, list, EVENT(event)))
// clang-format on

int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *argument);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *argument);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *argument)
{
    return call_fails("pthread_create") ? EAGAIN : __real_pthread_create(thread, attributes, run, argument);
}

// Where _FILE_OFFSET_BITS is 64, on i386 or by OpenEXR's flags, the call is named statvfs64.
int __real_statvfs(const char *path, struct statvfs *disk);
int __real_statvfs64(const char *path, struct statvfs *disk);
int __wrap_statvfs(const char *path, struct statvfs *disk);
int __wrap_statvfs64(const char *path, struct statvfs *disk);

static bool full_disk_report(struct statvfs *disk)
{
    if (disk_is_full) *disk = (struct statvfs){.f_blocks = 25, .f_bavail = 3, .f_frsize = 4096};
    return disk_is_full;
}

int __wrap_statvfs(const char *path, struct statvfs *disk)
{
    return full_disk_report(disk) ? 0 : __real_statvfs(path, disk);
}

int __wrap_statvfs64(const char *path, struct statvfs *disk)
{
    return full_disk_report(disk) ? 0 : __real_statvfs64(path, disk);
}
