// Every OpenCL call of a render and a trace fails once: glint reports that call, releases everything, and the
// next render on the same device is right. The linker puts the functions __wrap_cl… below in the place of
// those that host/ calls (ld --wrap, see the Makefile); a call without one does not link.
// run_tests: first
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/cli/commands.h"
#include "host/render/renderer.h"
#include "tests/child.h"
#include "tests/scene_reading.h"
#include <errno.h>
#include <pthread.h>
#include <semaphore.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>
#include <cmocka.h>

static struct {
    const char *call;  // the function that fails; NULL: none
    size_t index;      // at which of its calls, from 0, or EVERY_CALL
    bool returns_null; // with CL_SUCCESS
    int crash;         // or the signal that ends the driver; 0: none
    bool in_threads;   // only calls of other threads than the first are counted and fail
} injected;

static pthread_t first_thread;
static pthread_mutex_t counts_mutex = PTHREAD_MUTEX_INITIALIZER;

static const size_t EVERY_CALL = SIZE_MAX;

typedef struct {
    const char *call;
    size_t count;
} CallCount;

static CallCount counts[64];
static atomic_long live_count; // objects created and mapped, less those released

static CallCount *counted(const char *call)
{
    CallCount *count = counts;
    while (count->call && strcmp(count->call, call) != 0)
        count++;
    count->call = call;
    return count;
}

static bool call_fails(const char *call)
{
    if (injected.in_threads && pthread_equal(pthread_self(), first_thread)) return false;
    pthread_mutex_lock(&counts_mutex);
    size_t index = counted(call)->count++;
    pthread_mutex_unlock(&counts_mutex);
    bool fails = injected.call && strcmp(injected.call, call) == 0 &&
                 (injected.index == index || injected.index == EVERY_CALL);
    if (fails && injected.crash == SIGABRT) abort();
    while (fails && injected.crash) // as a wrong access would again; LLVM's handler only resets the signal's
        raise(injected.crash);
    return fails;
}

// A call that returns a status: not made where it fails.
#define STATUS(name, parameters, arguments)                                                                  \
    cl_int __real_##name parameters;                                                                         \
    cl_int __wrap_##name parameters;                                                                         \
    cl_int __wrap_##name parameters                                                                          \
    {                                                                                                        \
        return call_fails(#name) ? CL_OUT_OF_RESOURCES : __real_##name arguments;                            \
    }

// One that releases: made all the same, so that nothing is left in the driver.
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

static bool first_is_tiny; // the first device has room for no scene

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

enum { SIDE = 8, BAND_ROWS = 4, RAY_COUNT = 3, LARGE_BYTES = 4 << 20 };

typedef struct {
    float colors[SIDE * SIDE * 3];
    uint64_t ray_counts[5];
    size_t band_count;
    TraceHit hits[RAY_COUNT];
} Answer;

static DeviceList devices;
static const Device *device;
static Scene scene;
static Answer right;

static bool band_take(void *context, const Film *band, double fraction_done)
{
    (void)fraction_done;
    Answer *answer = context;
    memcpy(answer->colors + (size_t)band->first_row * SIDE * 3, band->layers[LAYER_COLOR],
           (size_t)band->height * SIDE * 3 * sizeof *answer->colors);
    answer->band_count++;
    return true;
}

static RenderSettings settings = {.width = SIDE,
                                  .height = SIDE,
                                  .region_width = SIDE,
                                  .region_height = SIDE,
                                  .sample_count = 1,
                                  .precision = PRECISION_SINGLE,
                                  .lanes = 1,
                                  .counting = true,
                                  .shift_to_eye = true,
                                  .band_rows = BAND_ROWS};

// A render with counted rays and all AOVs, a trace, and a large buffer. Returns whether all was done.
static bool work(Compute *compute, Answer *answer)
{
    static const TraceRay rays[RAY_COUNT] = {{{0, 0, 5}, {0, 0, -1}, 0, 100},
                                             {{0, 3, 5}, {0, 0, -1}, 0, 100},
                                             {{1, 1, 5}, {0, -0.25, -1}, 0, 100}};
    MessageList messages = {0};
    memset(answer, 0, sizeof *answer);
    compute_open(compute, device);
    cl_mem large = buffer_take(compute, LARGE_BYTES, buffer_bytes_allocate(LARGE_BYTES));
    Renderer *renderer = renderer_open(compute, &scene, &settings, &messages);
    bool done = renderer && renderer_render(renderer, AOVS_ALL, band_take, answer) &&
                renderer_trace(renderer, rays, RAY_COUNT, answer->hits);
    if (renderer) memcpy(answer->ray_counts, renderer_report(renderer)->rays, sizeof answer->ray_counts);
    renderer_close(renderer);
    buffer_release(large);
    assert_int_equal(messages.count, 0); // the user made no mistake
    message_list_free(&messages);
    assert_int_equal(done, compute_ok(compute));
    return done;
}

static void compute_close_checked(Compute *compute)
{
    compute_close(compute);
    if (live_count != 0) fail_msg("%ld objects were not released", live_count);
}

static void assert_work_is_right(void)
{
    injected.call = NULL;
    memset(counts, 0, sizeof counts);
    Compute compute;
    Answer answer;
    assert_true(work(&compute, &answer));
    compute_close_checked(&compute);
    assert_memory_equal(&answer, &right, sizeof answer);
}

// Fails a call. It must be reported where `is_needed`; else the work is done without it.
static void call_fail(const char *call, size_t index, bool returns_null, bool is_needed)
{
    injected.call = call;
    injected.index = index;
    injected.returns_null = returns_null;
    memset(counts, 0, sizeof counts);
    Compute compute;
    Answer answer;
    bool done = work(&compute, &answer);
    if (done == is_needed) fail_msg("%s, call %zu: %s", call, index, done ? "not reported" : "reported");
    if (done) {
        assert_memory_equal(&answer, &right, sizeof answer);
    } else {
        assert_string_equal(compute.failure.call, call);
        char *text = compute_failure_text(&compute);
        assert_ptr_equal(strstr(text, call), text);
        assert_non_null(strstr(text, returns_null ? "NULL with CL_SUCCESS" : "CL_OUT_OF_RESOURCES (-5)"));
        assert_non_null(strstr(text, device->name));
        free(text);
    }
    compute_close_checked(&compute);
}

// Fails each call of a function in turn.
static void calls_fail(const char *call, bool returns_null, bool is_needed)
{
    assert_work_is_right();
    size_t count = counted(call)->count;
    if (count == 0) fail_msg("%s is never called", call);
    for (size_t i = 0; i < count; i++)
        call_fail(call, i, returns_null, is_needed);
}

static void test_needed_calls(void **state)
{
    (void)state;
    static const char *const needed[] = {
        "clCreateContext",     "clCreateCommandQueue", "clCreateBuffer", "clSetMemObjectDestructorCallback",
        "clCreateKernel",      "clSetKernelArg",       "clFinish",       "clEnqueueWriteBuffer",
        "clEnqueueReadBuffer", "clEnqueueMapBuffer",   "clGetEventInfo", "clEnqueueNDRangeKernel",
        "clWaitForEvents"};
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++)
        calls_fail(needed[i], false, true);
    assert_work_is_right();
}

// Needed where a launch follows; the last two, of the trace, come after all results.
static void test_unmaps(void **state)
{
    (void)state;
    static const char call[] = "clEnqueueUnmapMemObject";
    assert_work_is_right();
    size_t count = counted(call)->count;
    assert_true(count > 2);
    for (size_t i = 0; i < count; i++)
        call_fail(call, i, false, i + 2 < count);
    assert_work_is_right();
}

static void test_needed_objects(void **state)
{
    (void)state;
    static const char *const creating[] = {"clCreateContext", "clCreateCommandQueue", "clCreateBuffer",
                                           "clCreateKernel", "clEnqueueMapBuffer"};
    for (size_t i = 0; i < sizeof creating / sizeof *creating; i++)
        calls_fail(creating[i], true, true);
    assert_work_is_right();
}

// Times, a kernel's limit of work-items, a binary for the cache, and releases.
static void test_dispensable_calls(void **state)
{
    (void)state;
    static const char *const dispensable[] = {
        "clGetEventProfilingInfo", "clGetKernelWorkGroupInfo", "clGetProgramInfo",     "clReleaseEvent",
        "clReleaseMemObject",      "clReleaseKernel",          "clReleaseProgram",     "clReleaseContext",
        "clReleaseCommandQueue",   "clGetKernelInfo",          "clGetProgramBuildInfo"};
    for (size_t i = 0; i < sizeof dispensable / sizeof *dispensable; i++)
        call_fail(dispensable[i], EVERY_CALL, false, false);
    assert_work_is_right();
}

// Two renderers, as on two devices, of which the second renders in a thread. Each waits until the other has
// taken a band, or the second has failed.
static struct {
    sem_t first_goes_on, second_goes_on;
    bool first_has_waited, second_has_waited;
    size_t dropped_count, dropped;
} pair;

static bool pair_wait(void)
{
    bool is_first = pthread_equal(pthread_self(), first_thread);
    bool *has_waited = is_first ? &pair.first_has_waited : &pair.second_has_waited;
    if (*has_waited) return false;
    *has_waited = true;
    sem_post(is_first ? &pair.second_goes_on : &pair.first_goes_on);
    sem_wait(is_first ? &pair.first_goes_on : &pair.second_goes_on);
    return false;
}

static void pair_dropped(void *context, size_t index)
{
    (void)context;
    pair.dropped_count++;
    pair.dropped = index;
    sem_post(&pair.first_goes_on);
    sem_post(&pair.second_goes_on);
}

// Whether the image is whole; the computes are left open.
static bool pair_work(Compute computes[2], Answer *answer)
{
    memset(counts, 0, sizeof counts);
    memset(&pair, 0, sizeof pair);
    memset(answer, 0, sizeof *answer);
    sem_init(&pair.first_goes_on, 0, 0);
    sem_init(&pair.second_goes_on, 0, 0);
    Renderer *renderers[2];
    settings.stop = pair_wait;
    for (size_t i = 0; i < 2; i++) {
        compute_open(&computes[i], device);
        renderers[i] = renderer_open(&computes[i], &scene, &settings, NULL);
    }
    const RenderJob job = {.renderers = renderers,
                           .count = 2,
                           .aovs = AOVS_ALL,
                           .sink = band_take,
                           .dropped = pair_dropped,
                           .context = answer};
    bool whole = render_job_run(&job);
    settings.stop = NULL;
    for (size_t i = 0; i < 2; i++)
        renderer_close(renderers[i]);
    sem_destroy(&pair.first_goes_on);
    sem_destroy(&pair.second_goes_on);
    return whole;
}

static void pair_close(Compute computes[2])
{
    compute_close(&computes[0]);
    compute_close_checked(&computes[1]);
}

// Of two devices one fails, at each call of its first band in turn: the other renders the whole image.
static void test_one_of_two_devices(void **state)
{
    (void)state;
    static const char *const needed[] = {
        "clCreateBuffer",       "clCreateKernel",         "clSetKernelArg",
        "clEnqueueWriteBuffer", "clEnqueueReadBuffer",    "clEnqueueMapBuffer",
        "clGetEventInfo",       "clEnqueueNDRangeKernel", "clWaitForEvents"};
    Compute computes[2];
    Answer answer;
    injected.in_threads = true;
    injected.call = NULL;
    injected.returns_null = false;
    assert_true(pair_work(computes, &answer));
    assert_int_equal(pair.dropped_count, 0);
    assert_memory_equal(answer.colors, right.colors, sizeof right.colors);
    pair_close(computes);
    CallCount all[64];
    memcpy(all, counts, sizeof all);
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++) {
        size_t count = 0;
        for (size_t k = 0; all[k].call; k++)
            if (strcmp(all[k].call, needed[i]) == 0) count = all[k].count;
        assert_true(count > 0);
        for (injected.index = 0; injected.index < count; injected.index++) {
            injected.call = needed[i];
            bool whole = pair_work(computes, &answer);
            if (!whole) fail_msg("%s, call %zu: no image", needed[i], injected.index);
            assert_int_equal(pair.dropped_count, 1);
            assert_int_equal(pair.dropped, 1);
            assert_int_equal(answer.band_count, 2);
            assert_memory_equal(answer.colors, right.colors, sizeof right.colors);
            assert_true(compute_ok(&computes[0]));
            assert_string_equal(computes[1].failure.call, needed[i]);
            pair_close(computes);
        }
    }
    injected.in_threads = false;
    injected.call = NULL;
}

int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *argument);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *argument);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *argument)
{
    return call_fails("pthread_create") ? EAGAIN : __real_pthread_create(thread, attributes, run, argument);
}

// The second device gets no thread: the first renders the whole image.
static void test_a_device_without_a_thread(void **state)
{
    (void)state;
    Compute computes[2];
    Answer answer;
    injected.call = "pthread_create";
    injected.index = EVERY_CALL;
    assert_true(pair_work(computes, &answer));
    injected.call = NULL;
    assert_int_equal(pair.dropped_count, 1);
    assert_int_equal(pair.dropped, 1);
    assert_memory_equal(answer.colors, right.colors, sizeof right.colors);
    assert_true(compute_ok(&computes[0]));
    assert_string_equal(computes[1].failure.call, "pthread_create");
    pair_close(computes);
}

static void test_both_of_two_devices(void **state)
{
    (void)state;
    Compute computes[2];
    Answer answer;
    injected.call = "clEnqueueNDRangeKernel";
    injected.index = EVERY_CALL;
    assert_false(pair_work(computes, &answer));
    assert_int_equal(pair.dropped_count, 1); // the last one reports for all
    assert_false(compute_ok(&computes[0]) || compute_ok(&computes[1]));
    assert_int_equal(answer.band_count, 0);
    pair_close(computes);
    injected.call = NULL;
}

static bool disk_is_full;

int __real_statvfs(const char *path, struct statvfs *disk);
int __wrap_statvfs(const char *path, struct statvfs *disk);
int __wrap_statvfs(const char *path, struct statvfs *disk)
{
    if (!disk_is_full) return __real_statvfs(path, disk);
    *disk = (struct statvfs){.f_blocks = 25, .f_bavail = 3, .f_frsize = 4096};
    return 0;
}

// A build without a log says so, and names the disk where it is full.
static void test_empty_build_log(void **state)
{
    (void)state;
    for (int full = 0; full < 2; full++) {
        disk_is_full = full == 1;
        injected.call = "clBuildProgram";
        injected.index = EVERY_CALL;
        Compute compute;
        Answer answer;
        assert_false(work(&compute, &answer));
        char *text = compute_failure_text(&compute);
        assert_non_null(strstr(text, "the driver gives no build log"));
        assert_int_equal(strstr(text, "is full (12 KiB free)") != NULL, full);
        free(text);
        compute_close_checked(&compute);
    }
    disk_is_full = false;
    assert_work_is_right();
}

// A cached program that the driver refuses is built from source, without a cache every program is.
static void test_builds(void **state)
{
    (void)state;
    calls_fail("clCreateProgramWithBinary", false, false);
    calls_fail("clCreateProgramWithBinary", true, false);
    calls_fail("clBuildProgram", false, false);
    char *cache = memory_copy_text(getenv("XDG_CACHE_HOME") ? getenv("XDG_CACHE_HOME") : "");
    setenv("XDG_CACHE_HOME", "/dev/null", 1);
    calls_fail("clCreateProgramWithSource", false, true);
    call_fail("clBuildProgram", 0, false, false); // built once more, despite PoCL's cache
    call_fail("clBuildProgram", EVERY_CALL, false, true);
    assert_work_is_right();
    if (cache[0] != '\0')
        setenv("XDG_CACHE_HOME", cache, 1);
    else
        unsetenv("XDG_CACHE_HOME");
    free(cache);
}

// The list says which call failed first, and so does the message where no device is left.
static void test_discovery(void **state)
{
    (void)state;
    static const char *const queries[] = {"clGetPlatformIDs", "clGetPlatformInfo", "clGetDeviceIDs",
                                          "clGetDeviceInfo"};
    for (size_t i = 0; i < sizeof queries / sizeof *queries; i++) {
        injected.call = NULL;
        for (size_t index = 0, count = 1; index < count; index++) {
            memset(counts, 0, sizeof counts);
            DeviceList list;
            MessageList messages = {0};
            device_list_open(&list);
            const Device *chosen = device_choose(&list, NULL, &messages);
            assert_int_equal(messages.count, chosen == NULL);
            if (injected.call) assert_string_equal(list.failed_call, queries[i]);
            if (messages.count > 0) {
                char failure[64];
                snprintf(failure, sizeof failure, "(%s: CL_OUT_OF_RESOURCES (-5))", queries[i]);
                assert_non_null(strstr(messages.items[0].text, failure));
            }
            message_list_free(&messages);
            device_list_close(&list);
            if (!injected.call) {
                count = counted(queries[i])->count + 1;
                injected.call = queries[i];
            }
            injected.index = index;
        }
    }
    injected.call = NULL;
}

// A device whose memory is unknown has room until a buffer cannot be created.
static void test_unknown_memory(void **state)
{
    (void)state;
    const Device *known = device;
    Device unknown = *device;
    unknown.memory_bytes = unknown.largest_buffer_bytes = 0;
    device = &unknown;
    assert_work_is_right();
    injected.call = "clCreateBuffer";
    injected.index = 0;
    memset(counts, 0, sizeof counts);
    Compute compute;
    Answer answer;
    assert_false(work(&compute, &answer));
    char *text = compute_failure_text(&compute);
    assert_non_null(strstr(text, "the device does not report its memory"));
    assert_null(strstr(text, "0.0 MiB"));
    free(text);
    compute_close_checked(&compute);
    injected.call = NULL;
    device = known;
}

static int set_up(void **state)
{
    (void)state;
    setenv("TMPDIR", "/dev/null", 1); // no place for the text of programs that do not build
    MessageList messages = {0};
    device_list_open(&devices);
    device = device_choose(&devices, device_selector(NULL), &messages);
    message_list_print(&messages, stderr);
    message_list_free(&messages);
    if (!device) return -1;
    scene = scene_of_text("tiny.yaml", "camera: {position: [0, 1, 5], look_at: [0, 0, 0]}\n"
                                       "lights: [{point: {position: [3, 5, 4]}}]\n"
                                       "objects: [{sphere: {center: [0, 0, 0], radius: 1}}]\n");
    Compute compute;
    if (!work(&compute, &right)) return -1;
    compute_close(&compute);
    bool is_right = right.hits[0].object == 0 && right.colors[(SIDE + 1) * SIDE / 2 * 3] > 0 &&
                    right.ray_counts[RAYS_CAMERA] == SIDE * SIDE;
    return is_right ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    scene_free(&scene);
    device_list_close(&devices);
    return 0;
}

typedef struct {
    int (*run)(int argument_count, char **arguments);
    const char *arguments[9]; // ended by NULL
} Command;

static const char *failing_call;
static size_t failing_index;
static const char *driver_folder; // with PoCL alone, which then has two devices; NULL: as it is
static int crash;
static const char *crash_folder; // for caches

static void command_fail(void *result)
{
    const Command *command = result;
    char *arguments[9] = {NULL};
    int count = 0;
    for (; command->arguments[count]; count++)
        arguments[count] = memory_copy_text(command->arguments[count]);
    injected.call = failing_call;
    injected.index = failing_index;
    injected.crash = crash;
    first_thread = pthread_self();
    if (driver_folder) {
        setenv("OCL_ICD_VENDORS", driver_folder, 1);
        setenv("POCL_DEVICES", "pthread pthread", 1);
    }
    if (crash) {
        setenv("XDG_CACHE_HOME", crash_folder, 1);
        unsetenv("POCL_CACHE_DIR");
    }
    fault_catch_crashes();
    int status = command->run(count, arguments);
    while (count > 0)
        free(arguments[--count]);
    exit(status);
}

static void test_commands(void **state)
{
    (void)state;
    static const Command commands[] = {
        {command_render, {"render", "scenes/spheres16.yaml", "--size", "8x8", "-o", "/dev/null/none.png"}},
        {command_trace, {"trace", "scenes/spheres16.yaml", "--rays", "/dev/null"}},
        {command_bench, {"bench", "scenes/spheres16.yaml", "--size", "8x8"}},
        {command_accuracy, {"accuracy", "scenes/spheres16.yaml", "--size", "8x8"}},
        {command_verify, {"verify", "P1"}},
    };
    static const char *const calls[] = {"clCreateContext", "clCreateCommandQueue", "clCreateBuffer"};
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        for (size_t k = 0; k < sizeof calls / sizeof *calls; k++) {
            Command command = commands[i];
            failing_call = calls[k];
            ChildEnd end = child_run(command_fail, &command, sizeof command);
            char expected[64];
            snprintf(expected, sizeof expected, "glint: %s: CL_OUT_OF_RESOURCES (-5) on ", calls[k]);
            if (strncmp(end.errors, expected, strlen(expected)) != 0) print_error("%s\n", end.errors);
            assert_memory_equal(end.errors, expected, strlen(expected));
            assert_int_equal(end.status, EXIT_MACHINE);
        }
}

static void assert_same_bytes(const char *one, const char *other)
{
    Text first = {0}, second = {0};
    MessageList messages = {0};
    assert_true(text_read_file(&first, one, &messages) && text_read_file(&second, other, &messages));
    assert_true(first.count > 0);
    assert_int_equal(first.count, second.count);
    assert_memory_equal(first.items, second.items, first.count);
    text_free(&first);
    text_free(&second);
}

// One of two devices fails, or has no room for the scene: a warning, and the same image. Both fail, or the
// one without room is named: an error.
static void test_several_devices(void **state)
{
    (void)state;
    static const char pocl[] = "/etc/OpenCL/vendors/pocl.icd";
    if (access(pocl, R_OK) != 0) skip();
    char one[] = "/tmp/glint-test-XXXXXX.npy", other[] = "/tmp/glint-test-XXXXXX.npy";
    assert_true(close(mkstemps(one, 4)) == 0 && close(mkstemps(other, 4)) == 0);
    static const char dropped[] = "glint: warning: the other devices go on without one: ";
    const struct {
        const char *call;
        size_t index;
        bool first_is_tiny;
        const char *devices, *file, *expected, *reason;
        int status;
    } runs[] = {
        {NULL, 0, false, "all", one, "", "", EXIT_DONE},
        {"clEnqueueNDRangeKernel", 0, false, "all", other, dropped,
         "clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES (-5) on ", EXIT_DONE},
        {"clCreateContext", 0, false, "all", other, dropped, "clCreateContext: CL_OUT_OF_RESOURCES (-5) on ",
         EXIT_DONE},
        {NULL, 0, true, "all", other, dropped, "the scene needs ", EXIT_DONE},
        {"clEnqueueNDRangeKernel", EVERY_CALL, false, "all", "/dev/null/none.npy",
         "\nglint: ", "clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES (-5) on ", EXIT_MACHINE},
        {NULL, 0, true, "0,1", "/dev/null/none.npy", "glint: error: ", "the scene needs ", EXIT_USER}};
    driver_folder = pocl;
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        Command command = {command_render,
                           {"render", "scenes/spheres16.yaml", "--size", "64x48", "--device", runs[i].devices,
                            "-o", runs[i].file}};
        char expected[160];
        snprintf(expected, sizeof expected, "%s%s", runs[i].expected, runs[i].reason);
        failing_call = runs[i].call;
        failing_index = runs[i].index;
        first_is_tiny = runs[i].first_is_tiny;
        ChildEnd end = child_run(command_fail, &command, sizeof command);
        if (!strstr(end.errors, expected)) print_error("%s\n", end.errors);
        assert_non_null(strstr(end.errors, expected));
        assert_int_equal(end.status, runs[i].status);
        if (runs[i].file == other) assert_same_bytes(one, other);
    }
    driver_folder = NULL;
    failing_index = 0;
    first_is_tiny = false;
    unlink(one);
    unlink(other);
}

// An image that is complete is written whatever a release says.
static void test_release_after_the_output(void **state)
{
    (void)state;
    char path[] = "/tmp/glint-test-XXXXXX.png";
    assert_true(close(mkstemps(path, 4)) == 0);
    Command command = {command_render, {"render", "scenes/spheres16.yaml", "--size", "8x8", "-o", path}};
    failing_call = "clEnqueueUnmapMemObject";
    ChildEnd end = child_run(command_fail, &command, sizeof command);
    static const char expected[] = "glint: warning: clEnqueueUnmapMemObject: CL_OUT_OF_RESOURCES (-5) on ";
    assert_memory_equal(end.errors, expected, strlen(expected));
    assert_int_equal(end.status, EXIT_DONE);
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    assert_true(status.st_size > 0);
    unlink(path);
}

// A driver that crashes is named with its call; when the output is complete it is a warning.
static void test_crashes(void **state)
{
    (void)state;
#ifdef __SANITIZE_ADDRESS__
    skip(); // sanitizers handle crashes
#else
    static const char *const calls[] = {"clGetPlatformIDs", "clBuildProgram", "clWaitForEvents",
                                        "clGetProgramInfo"};
    static const int signals[] = {SIGSEGV, SIGABRT};
    char folder[] = "/tmp/glint-test-XXXXXX";
    assert_non_null(mkdtemp(folder));
    crash_folder = folder; // an empty cache: no program comes from it
    for (size_t i = 0; i < sizeof calls / sizeof *calls; i++)
        for (size_t k = 0; k < 2; k++) {
            bool is_complete = i == 3;
            char path[] = "/tmp/glint-test-XXXXXX.png", expected[80];
            assert_true(close(mkstemps(path, 4)) == 0);
            Command command = {command_render,
                               {"render", "scenes/spheres16.yaml", "--size", "8x8", "-o", path}};
            failing_call = calls[i];
            crash = signals[k];
            ChildEnd end = child_run(command_fail, &command, sizeof command);
            snprintf(expected, sizeof expected, "glint: %s%s: the OpenCL driver %s",
                     is_complete ? "warning: " : "", calls[i], k ? "aborted" : "crashed");
            if (!strstr(end.errors, expected)) print_error("%s\n", end.errors);
            assert_non_null(strstr(end.errors, expected));
            assert_int_equal(end.status, is_complete ? EXIT_DONE : EXIT_MACHINE);
            struct stat status;
            assert_int_equal(stat(path, &status), 0);
            assert_int_equal(status.st_size > 0, is_complete);
            unlink(path);
        }
    crash = 0;
    scratch_close(memory_copy_text(folder));
#endif
}

int main(void)
{
    first_thread = pthread_self();
    // each command is a process of its own, and forks before this one has opened a device
    const struct CMUnitTest command_tests[] = {
        cmocka_unit_test(test_commands), cmocka_unit_test(test_several_devices),
        cmocka_unit_test(test_release_after_the_output), cmocka_unit_test(test_crashes)};
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_needed_calls),
                                       cmocka_unit_test(test_unmaps),
                                       cmocka_unit_test(test_needed_objects),
                                       cmocka_unit_test(test_dispensable_calls),
                                       cmocka_unit_test(test_builds),
                                       cmocka_unit_test(test_empty_build_log),
                                       cmocka_unit_test(test_discovery),
                                       cmocka_unit_test(test_unknown_memory),
                                       cmocka_unit_test(test_one_of_two_devices),
                                       cmocka_unit_test(test_a_device_without_a_thread),
                                       cmocka_unit_test(test_both_of_two_devices)};
    int failed = cmocka_run_group_tests(command_tests, NULL, NULL);
    return cmocka_run_group_tests(tests, set_up, tear_down) + failed;
}
