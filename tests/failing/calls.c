// Makes OpenCL calls fail by the rules of faults.h. In C tests the linker puts these functions in the place
// of those that glint calls (ld --wrap, see the Makefile), and an OpenCL call without one does not link.
// Where PRELOADED is defined, they have OpenCL's names.
#define CL_TARGET_OPENCL_VERSION 120
#include "tests/failing/calls.h"
#include "tests/failing/faults.h"
#include <CL/cl.h>
#include <dlfcn.h>

atomic_long live_count;

#ifdef PRELOADED
#define DEFINED(name) name
#define REAL(name)    ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define DECLARE(name)
#else
#define DEFINED(name) __wrap_##name
#define REAL(name)    __real_##name
#define DECLARE(name) __typeof__(name) __wrap_##name, __real_##name;
#endif

// Defines a call that returns a status. It is not made where it fails.
#define STATUS(name, parameters, arguments) STATUS_OF(name, NULL, parameters, arguments)
#define STATUS_OF(name, kernel, parameters, arguments)                                                       \
    DECLARE(name)                                                                                            \
    cl_int DEFINED(name) parameters                                                                          \
    {                                                                                                        \
        return fault_at(#name, CALL_OPENCL, kernel) ? CL_OUT_OF_RESOURCES : REAL(name) arguments;            \
    }

// Defines a call that releases. It is made even where it fails, so that nothing is left in the driver.
#define RELEASE(name, parameters, arguments)                                                                 \
    DECLARE(name)                                                                                            \
    cl_int DEFINED(name) parameters                                                                          \
    {                                                                                                        \
        live_count--;                                                                                        \
        cl_int released = REAL(name) arguments;                                                              \
        return fault_at(#name, CALL_OPENCL, NULL) ? CL_OUT_OF_RESOURCES : released;                          \
    }

#define CREATE(type, name, parameters, arguments) CREATE_OF(type, name, NULL, parameters, arguments)
#define CREATE_OF(type, name, kernel, parameters, arguments)                                                 \
    DECLARE(name)                                                                                            \
    type DEFINED(name) parameters                                                                            \
    {                                                                                                        \
        const FaultAct act = fault_at(#name, CALL_OPENCL | CALL_CREATING, kernel);                           \
        if (act) {                                                                                           \
            *status = act == FAULT_NULL ? CL_SUCCESS : CL_OUT_OF_RESOURCES;                                  \
            return NULL;                                                                                     \
        }                                                                                                    \
        type object = REAL(name) arguments;                                                                  \
        live_count += object != NULL;                                                                        \
        return object;                                                                                       \
    }

DECLARE(clGetKernelInfo)

// Returns a kernel's name, valid until the thread's next call.
static const char *name_of(cl_kernel kernel)
{
    static _Thread_local char name[32];
    const cl_int status = REAL(clGetKernelInfo)(kernel, CL_KERNEL_FUNCTION_NAME, sizeof name, name, NULL);
    return status == CL_SUCCESS ? name : "";
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
STATUS(clGetDeviceInfo, (cl_device_id id, cl_device_info what, size_t size, void *value, size_t *needed),
       (id, what, size, value, needed))
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
CREATE_OF(cl_kernel, clCreateKernel, name, (cl_program program, const char *name, cl_int *status),
          (program, name, status))
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
STATUS_OF(clEnqueueNDRangeKernel, name_of(kernel), (cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
          const size_t *offset, const size_t *global, const size_t *local, cl_uint n, const cl_event *list,
          cl_event *event), (queue, kernel, dimensions, offset, global, local, n, list, EVENT(event)))
// clang-format on
