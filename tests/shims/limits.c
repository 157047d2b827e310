// Makes OpenCL devices report the limits that GLINT_LIMITS lists, NAME or NAME=VALUE with commas between, and
// enforce them. tests/test_device_limits.py preloads it into glint. Where GLINT_LIMITED is set, only devices
// with that in their names report limits, and then only those of arithmetic are enforced.
//
//   embedded       the embedded profile
//   toward-zero    float arithmetic does not round to nearest
//   no-infinity    float arithmetic has no infinity and no NaN
//   no-double      no 64-bit floating point
//   units=N        the device has N compute units
//   group=N        work-groups have at most N work-items, a side included
//   constant=N     constant memory has N bytes
//   memory=N       global memory has N bytes, over all buffers
//   buffer=N       a buffer has at most N bytes
//   address=N      addresses have N bits, and of 32 no more than 4 GiB of memory are allocated
//   no-timer       the times of events are 0
//   buffers=N      a kernel's launch fails if more than N of its arguments are buffers, NULL or not
//   build=N        the compiler fails with status -N at kernels that have large functions inlined
//   kernel=N       and so does clCreateKernel
//   khr, nv, amd   the extensions of that vendor that tell devices of one name apart
//   first=N        the watchdog: a kernel's launch fails if it has more than N work-items, and more than four
//                  times those of its last launch
#define CL_TARGET_OPENCL_VERSION 120
#define _GNU_SOURCE
#include <CL/cl.h>
#include <CL/cl_ext.h>
#include <dlfcn.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// The OpenCL function that the shim stands in for.
#define NEXT(function) ((__typeof__(&function))dlsym(RTLD_NEXT, #function))

// Returns whether the limit is set. *value, where `value` may be NULL, receives its number.
static bool limit_get(const char *name, cl_ulong *value)
{
    const char *list = getenv("GLINT_LIMITS");
    const size_t length = strlen(name);
    for (const char *at = list; at; at = strchr(at, ',')) {
        at += *at == ',';
        if (strncmp(at, name, length) != 0 || !strchr("=,", at[length])) continue;
        if (value) *value = at[length] == '=' ? strtoull(at + length + 1, NULL, 10) : 0;
        return true;
    }
    return false;
}

static cl_int answer(const void *value, size_t value_size, size_t size, void *to, size_t *needed)
{
    if (needed) *needed = value_size;
    if (to && size < value_size) return CL_INVALID_VALUE;
    if (to) memcpy(to, value, value_size);
    return CL_SUCCESS;
}

#define ANSWER(Type, value) answer(&(Type){value}, sizeof(Type), size, to, needed)

// Returns the device's extensions without cl_khr_fp64 if that is hidden, and with those that identify it.
static cl_int extensions_answer(cl_device_id device, size_t size, void *to, size_t *needed)
{
    char text[8192] = "";
    cl_int status = NEXT(clGetDeviceInfo)(device, CL_DEVICE_EXTENSIONS, sizeof text / 2, text, NULL);
    char *fp64 = limit_get("no-double", NULL) ? strstr(text, "cl_khr_fp64") : NULL;
    if (fp64) memset(fp64, ' ', strlen("cl_khr_fp64"));
    if (limit_get("khr", NULL)) strcat(text, " cl_khr_pci_bus_info cl_khr_device_uuid");
    if (limit_get("nv", NULL)) strcat(text, " cl_nv_device_attribute_query");
    if (limit_get("amd", NULL)) strcat(text, " cl_amd_device_attribute_query");
    return status == CL_SUCCESS ? answer(text, strlen(text) + 1, size, to, needed) : status;
}

// Returns the bus of a device, 0x65 for the first that is asked for and then the next.
static unsigned char bus_of(cl_device_id device)
{
    static cl_device_id devices[16];
    unsigned char i = 0;
    while (devices[i] && devices[i] != device && i < 15)
        i++;
    devices[i] = device;
    return 0x65 + i;
}

// Answers the queries that identify a device. Sets *is_known to whether `what` is one.
static cl_int identity_answer(cl_device_id device, cl_device_info what, size_t size, void *to, size_t *needed,
                              bool *is_known)
{
    const unsigned char bus = bus_of(device);
    const cl_uint khr[] = {1, bus, 2, 3};
    unsigned char amd[24] = {1}, uuid[16] = {0xab, bus};
    static const char board[] = "Lodestar 7";
    amd[21] = bus;
    amd[22] = 4;
    *is_known = true;
    if (what == 0x410F && limit_get("khr", NULL)) return answer(khr, sizeof khr, size, to, needed);
    if (what == 0x106A && limit_get("khr", NULL)) return answer(uuid, sizeof uuid, size, to, needed);
    if (what == 0x4008 && limit_get("nv", NULL)) return ANSWER(cl_uint, bus);
    if (what == 0x4009 && limit_get("nv", NULL)) return ANSWER(cl_uint, 5 << 3 | 1);
    if (what == 0x4037 && limit_get("amd", NULL)) return answer(amd, sizeof amd, size, to, needed);
    if (what == 0x4038 && limit_get("amd", NULL)) return answer(board, sizeof board, size, to, needed);
    *is_known = false;
    return CL_SUCCESS;
}

static bool is_limited(cl_device_id device)
{
    const char *limited = getenv("GLINT_LIMITED");
    char name[256] = "";
    if (limited) NEXT(clGetDeviceInfo)(device, CL_DEVICE_NAME, sizeof name - 1, name, NULL);
    return !limited || strstr(name, limited);
}

cl_int clGetDeviceInfo(cl_device_id device, cl_device_info what, size_t size, void *to, size_t *needed)
{
    cl_ulong value;
    if (!is_limited(device)) return NEXT(clGetDeviceInfo)(device, what, size, to, needed);
    if (what == CL_DEVICE_PROFILE && limit_get("embedded", NULL))
        return answer("EMBEDDED_PROFILE", sizeof "EMBEDDED_PROFILE", size, to, needed);
    if (what == CL_DEVICE_MAX_COMPUTE_UNITS && limit_get("units", &value)) return ANSWER(cl_uint, (cl_uint)value);
    if (what == CL_DEVICE_MAX_WORK_GROUP_SIZE && limit_get("group", &value)) return ANSWER(size_t, value);
    if (what == CL_DEVICE_ADDRESS_BITS && limit_get("address", &value))
        return ANSWER(cl_uint, (cl_uint)value);
    if (what == CL_DEVICE_MAX_CONSTANT_BUFFER_SIZE && limit_get("constant", &value))
        return ANSWER(cl_ulong, value);
    if (what == CL_DEVICE_GLOBAL_MEM_SIZE && limit_get("memory", &value)) return ANSWER(cl_ulong, value);
    if (what == CL_DEVICE_MAX_MEM_ALLOC_SIZE && limit_get("buffer", &value)) return ANSWER(cl_ulong, value);
    if (what == CL_DEVICE_DOUBLE_FP_CONFIG && limit_get("no-double", NULL))
        return ANSWER(cl_device_fp_config, 0);
    if (what == CL_DEVICE_EXTENSIONS) return extensions_answer(device, size, to, needed);
    bool is_identity;
    const cl_int identity = identity_answer(device, what, size, to, needed, &is_identity);
    if (is_identity) return identity;
    const cl_int status = NEXT(clGetDeviceInfo)(device, what, size, to, needed);
    if (status != CL_SUCCESS || !to) return status;
    if (what == CL_DEVICE_MAX_WORK_ITEM_SIZES && limit_get("group", &value))
        for (size_t i = 0; i < 3; i++)
            ((size_t *)to)[i] = value;
    if (what == CL_DEVICE_SINGLE_FP_CONFIG && limit_get("toward-zero", NULL))
        *(cl_device_fp_config *)to =
            (*(cl_device_fp_config *)to & ~(cl_device_fp_config)CL_FP_ROUND_TO_NEAREST) | CL_FP_ROUND_TO_ZERO;
    if (what == CL_DEVICE_SINGLE_FP_CONFIG && limit_get("no-infinity", NULL))
        *(cl_device_fp_config *)to &= ~(cl_device_fp_config)CL_FP_INF_NAN;
    return status;
}

cl_int clGetEventProfilingInfo(cl_event event, cl_profiling_info what, size_t size, void *to, size_t *needed)
{
    if (limit_get("no-timer", NULL)) return ANSWER(cl_ulong, 0);
    return NEXT(clGetEventProfilingInfo)(event, what, size, to, needed);
}

cl_int clGetKernelWorkGroupInfo(cl_kernel kernel, cl_device_id device, cl_kernel_work_group_info what,
                                size_t size, void *to, size_t *needed)
{
    cl_ulong value;
    if (what == CL_KERNEL_WORK_GROUP_SIZE && limit_get("group", &value)) return ANSWER(size_t, value);
    return NEXT(clGetKernelWorkGroupInfo)(kernel, device, what, size, to, needed);
}

cl_program clCreateProgramWithSource(cl_context context, cl_uint count, const char **texts,
                                     const size_t *lengths, cl_int *status)
{
    cl_device_id device;
    clGetContextInfo(context, CL_CONTEXT_DEVICES, sizeof device, &device, NULL);
    for (cl_uint i = 0; i < count; i++)
        if (is_limited(device) && limit_get("no-double", NULL) && strstr(texts[i], "#define IS_DOUBLE 1")) {
            *status = CL_INVALID_VALUE; // glint was told that there is no such type
            return NULL;
        }
    return NEXT(clCreateProgramWithSource)(context, count, texts, lengths, status);
}

enum { BUFFERS_MAX = 4096, KERNELS_MAX = 64, ARGUMENTS_MAX = 256 };

// Returns whether the limit makes the program's compiler or linker fail.
static bool build_is_refused(cl_program program, const char *limit, cl_ulong *status)
{
    size_t size = 0;
    if (!limit_get(limit, status)) return false;
    NEXT(clGetProgramInfo)(program, CL_PROGRAM_SOURCE, 0, NULL, &size);
    char *text = calloc(size + 1, 1);
    NEXT(clGetProgramInfo)(program, CL_PROGRAM_SOURCE, size, text, NULL);
    const bool is_inlined = strstr(text, "#define IS_OUT_OF_LINE 0") != NULL;
    free(text);
    return is_inlined;
}

cl_int clBuildProgram(cl_program program, cl_uint count, const cl_device_id *devices, const char *options,
                      void(CL_CALLBACK *notify)(cl_program, void *), void *data)
{
    cl_ulong status;
    if (build_is_refused(program, "build", &status)) return -(cl_int)status;
    return NEXT(clBuildProgram)(program, count, devices, options, notify, data);
}

cl_kernel clCreateKernel(cl_program program, const char *name, cl_int *status)
{
    cl_ulong failure;
    if (!build_is_refused(program, "kernel", &failure)) return NEXT(clCreateKernel)(program, name, status);
    *status = -(cl_int)failure;
    return NULL;
}

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static struct {
    cl_mem buffer;
    size_t size;
} buffers[BUFFERS_MAX];
static struct {
    cl_kernel kernel;
    size_t last_items;
    bool is_buffer[ARGUMENTS_MAX];
} kernels[KERNELS_MAX];

static size_t buffer_find(cl_mem buffer)
{
    for (size_t i = 0; i < BUFFERS_MAX; i++)
        if (buffers[i].buffer == buffer) return i;
    fputs("the shim has room for 4096 buffers\n", stderr);
    abort();
}

// Returns the kernel's entry, and adds one if it has none.
static size_t kernel_find(cl_kernel kernel)
{
    size_t place = KERNELS_MAX;
    for (size_t i = KERNELS_MAX; i-- > 0;) {
        if (kernels[i].kernel == kernel) return i;
        if (!kernels[i].kernel) place = i;
    }
    if (place == KERNELS_MAX) {
        fputs("the shim has room for 64 kernels\n", stderr);
        abort();
    }
    kernels[place].kernel = kernel;
    return place;
}

cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void *bytes, cl_int *status)
{
    cl_ulong most, sum = size;
    const bool is_free = getenv("GLINT_LIMITED");
    *status = CL_INVALID_BUFFER_SIZE;
    if (!is_free && limit_get("buffer", &most) && size > most) return NULL;
    pthread_mutex_lock(&mutex);
    for (size_t i = 0; i < BUFFERS_MAX; i++)
        sum += buffers[i].size;
    cl_mem buffer = NULL;
    *status = CL_MEM_OBJECT_ALLOCATION_FAILURE;
    const bool is_addressable = !limit_get("address", &most) || most != 32 || sum <= CL_UINT_MAX;
    if (is_free || (is_addressable && (!limit_get("memory", &most) || sum <= most)))
        buffer = NEXT(clCreateBuffer)(context, flags, size, bytes, status);
    if (buffer) {
        const size_t place = buffer_find(NULL);
        buffers[place].buffer = buffer;
        buffers[place].size = size;
    }
    pthread_mutex_unlock(&mutex);
    return buffer;
}

cl_int clReleaseMemObject(cl_mem buffer)
{
    pthread_mutex_lock(&mutex);
    const size_t place = buffer_find(buffer);
    buffers[place].buffer = NULL;
    buffers[place].size = 0;
    pthread_mutex_unlock(&mutex);
    return NEXT(clReleaseMemObject)(buffer);
}

cl_int clSetKernelArg(cl_kernel kernel, cl_uint index, size_t size, const void *value)
{
    cl_mem buffer = NULL;
    if (size == sizeof buffer && value) memcpy(&buffer, value, size);
    pthread_mutex_lock(&mutex);
    bool *is_buffer = &kernels[kernel_find(kernel)].is_buffer[index];
    *is_buffer = size == sizeof buffer && !buffer;
    for (size_t i = 0; i < BUFFERS_MAX && buffer; i++)
        if (buffers[i].buffer == buffer) *is_buffer = true;
    pthread_mutex_unlock(&mutex);
    return NEXT(clSetKernelArg)(kernel, index, size, value);
}

cl_int clReleaseKernel(cl_kernel kernel)
{
    pthread_mutex_lock(&mutex);
    memset(&kernels[kernel_find(kernel)], 0, sizeof *kernels);
    pthread_mutex_unlock(&mutex);
    return NEXT(clReleaseKernel)(kernel);
}

cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                              const size_t *first, const size_t *global, const size_t *local,
                              cl_uint wait_count, const cl_event *wait, cl_event *event)
{
    size_t items = 1, group = 1, buffer_count = 0;
    cl_ulong most;
    for (cl_uint i = 0; i < dimensions; i++) {
        items *= global[i];
        group *= local ? local[i] : 1;
    }
    if (limit_get("group", &most) && group > most) return CL_INVALID_WORK_GROUP_SIZE;
    pthread_mutex_lock(&mutex);
    const size_t place = kernel_find(kernel);
    size_t *last = &kernels[place].last_items;
    const bool is_too_long = limit_get("first", &most) && items > most && items > 4 * *last;
    *last = items;
    for (size_t i = 0; i < ARGUMENTS_MAX; i++)
        buffer_count += kernels[place].is_buffer[i];
    pthread_mutex_unlock(&mutex);
    if (limit_get("buffers", &most) && buffer_count > most) return CL_OUT_OF_RESOURCES;
    if (is_too_long) return CL_OUT_OF_RESOURCES;
    return NEXT(clEnqueueNDRangeKernel)(queue, kernel, dimensions, first, global, local, wait_count, wait,
                                        event);
}
