// Makes calls of each OpenCL function fail once in a render and a trace, in a long test every call. glint
// must report that call and release everything, and the next render on the same device must be right.
// run_tests: first
// run_tests: sanitized
#include "tests/check.h"
#include "tests/failing/calls.h"
#include "tests/failing/faults.h"
#include "tests/failing/work.h"
#include "tests/files.h"
#include "tests/film.h"
#include <signal.h>
#include <sys/resource.h>

// Fails a call. It must be reported if `is_needed`, else the work is done without it.
static void call_fail(const char *call, size_t index, bool returns_null, bool is_needed)
{
    injected = (Fault){.call = call, .index = index, .act = returns_null ? FAULT_NULL : FAULT_FAIL};
    Compute compute;
    WorkResult result;
    bool done = work(&compute, &result);
    if (done == is_needed) fail_msg("%s, call %zu: %s", call, index, done ? "not reported" : "reported");
    if (done) {
        assert_memory_equal(&result, &right, sizeof result);
    } else {
        assert_string_equal(compute.failure.call, call);
        OWNED char *text = compute_failure_text(&compute);
        assert_ptr_equal(strstr(text, call), text);
        assert_non_null(strstr(text, returns_null ? "NULL with CL_SUCCESS" : "CL_OUT_OF_RESOURCES (-5)"));
        assert_non_null(strstr(text, work_device->name));
    }
    compute_close_checked(&compute);
}

// Fails calls of a function in turn: each, or about `most` of them in a short test, and the last.
static void some_calls_fail(const char *call, size_t most, bool returns_null, bool is_needed)
{
    const size_t count = assert_work_is_right(call);
    if (count == 0) fail_msg("%s is never called", call);
    const size_t step = tests_are_long() || count <= most ? 1 : count / most;
    for (size_t i = 0; i + 1 < count; i += step)
        call_fail(call, i, returns_null, is_needed);
    call_fail(call, count - 1, returns_null, is_needed);
}

static void calls_fail(const char *call, bool returns_null, bool is_needed)
{
    some_calls_fail(call, 12, returns_null, is_needed);
}

TEST(needed_calls)
{
    static const char *const needed[] = {
        "clCreateContext", "clCreateCommandQueue",   "clCreateBuffer",      "clSetKernelArg",
        "clFinish",        "clEnqueueWriteBuffer",   "clEnqueueReadBuffer", "clEnqueueMapBuffer",
        "clGetEventInfo",  "clEnqueueNDRangeKernel", "clWaitForEvents"};
    for (size_t i = 0; i < COUNT_OF(needed); i++)
        calls_fail(needed[i], false, true);
    // only buffers in the host's memory need it
    if (work_device->type & CL_DEVICE_TYPE_CPU) calls_fail("clSetMemObjectDestructorCallback", false, true);
    assert_work_is_right(NULL);
}

// Unmaps are needed where a launch follows. The last two, those of the trace, come after all results.
TEST(unmaps)
{
    static const char call[] = "clEnqueueUnmapMemObject";
    const size_t count = assert_work_is_right(call);
    assert_true(count > 2);
    for (size_t i = 0; i < count; i++)
        call_fail(call, i, false, i + 2 < count);
    assert_work_is_right(NULL);
}

TEST(needed_objects)
{
    static const char *const creating[] = {"clCreateContext", "clCreateCommandQueue", "clCreateBuffer",
                                           "clEnqueueMapBuffer"};
    for (size_t i = 0; i < COUNT_OF(creating); i++)
        calls_fail(creating[i], true, true);
    assert_work_is_right(NULL);
}

// Times, a kernel's limit of work-items, a binary for the cache, and releases.
TEST(dispensable_calls)
{
    static const char *const dispensable[] = {
        "clGetEventProfilingInfo", "clGetKernelWorkGroupInfo", "clGetProgramInfo",      "clReleaseEvent",
        "clReleaseMemObject",      "clReleaseKernel",          "clReleaseProgram",      "clReleaseContext",
        "clReleaseCommandQueue",   "clGetKernelInfo",          "clGetProgramBuildInfo", "clGetMemObjectInfo"};
    for (size_t i = 0; i < COUNT_OF(dispensable); i++)
        call_fail(dispensable[i], EVERY_CALL, false, false);
    assert_work_is_right(NULL);
}

// A message about a build without a log states so, and names the disk if it is full.
TEST(empty_build_log)
{
    for (int full = 0; full < 2; full++) {
        disk_is_full = full == 1;
        injected = (Fault){.call = "clBuildProgram", .index = EVERY_CALL, .act = FAULT_FAIL};
        Compute compute;
        WorkResult result;
        assert_false(work(&compute, &result));
        OWNED char *text = compute_failure_text(&compute);
        assert_non_null(strstr(text, "the driver gives no build log"));
        assert_int_equal(strstr(text, "is full (12 KiB free)") != NULL, full);
        compute_close_checked(&compute);
    }
    disk_is_full = false;
    assert_work_is_right(NULL);
}

// A program's text that cannot be saved whole is not left behind.
TEST(unsaved_text)
{
    struct rlimit usual;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &usual), 0);
    OWNED char *folder = folder_make();
    setenv("TMPDIR", folder, 1);
    signal(SIGXFSZ, SIG_IGN);
    injected = (Fault){.call = "clBuildProgram", .index = EVERY_CALL, .act = FAULT_FAIL};
    Compute compute;
    WorkResult result;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &(struct rlimit){1000, usual.rlim_max}), 0);
    const bool is_done = work(&compute, &result);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &usual), 0);
    setenv("TMPDIR", "/dev/null", 1);
    assert_false(is_done);
    OWNED char *text = compute_failure_text(&compute);
    assert_non_null(strstr(text, "the composed text: could not be saved"));
    assert_int_equal(rmdir(folder), 0);
    compute_close_checked(&compute);
}

static char *cache_disable(void)
{
    char *cache = memory_copy_text(getenv("XDG_CACHE_HOME") ? getenv("XDG_CACHE_HOME") : "");
    setenv("XDG_CACHE_HOME", "/dev/null", 1);
    return cache;
}

static void cache_restore(const char *cache)
{
    if (cache[0] != '\0')
        setenv("XDG_CACHE_HOME", cache, 1);
    else
        unsetenv("XDG_CACHE_HOME");
}

static BandRows acquire_nothing(void *context, uint32_t rows_max, uint32_t step)
{
    (void)context, (void)rows_max, (void)step;
    return (BandRows){0};
}

// Builds a kernel that is not launched, and returns the number of calls of a function.
static size_t unlaunched_calls(const char *counted)
{
    const BandQueue queue = {.acquire = acquire_nothing};
    injected = (Fault){.call = counted, .act = FAULT_COUNT};
    Compute compute;
    compute_open(&compute, work_device);
    Renderer *renderer = renderer_open(&compute, &work_scene, &work_settings, NULL);
    assert_true(renderer_work(renderer, 0, &queue));
    renderer_close(renderer);
    compute_close_checked(&compute);
    return injected.count;
}

// The binary of a kernel that was never launched is not asked for, since it may lack the machine code.
TEST(unlaunched_kernel)
{
    OWNED char *cache = cache_disable();
    assert_int_equal(unlaunched_calls("clBuildProgram"), 1);
    assert_int_equal(unlaunched_calls("clGetProgramInfo"), 0);
    cache_restore(cache);
}

// A cached program that the driver refuses, or from which it creates no kernel, is built from source, and
// without a cache every program is. After a failed build, functions are built out of line.
TEST(builds)
{
    calls_fail("clCreateProgramWithBinary", false, false);
    calls_fail("clCreateProgramWithBinary", true, false);
    calls_fail("clBuildProgram", false, false);
    calls_fail("clCreateKernel", false, false);
    calls_fail("clCreateKernel", true, false);
    OWNED char *cache = cache_disable();
    some_calls_fail("clCreateProgramWithSource", 1, false, false);
    call_fail("clCreateProgramWithSource", EVERY_CALL, false, true);
    some_calls_fail("clCreateKernel", 1, false, false);
    call_fail("clCreateKernel", EVERY_CALL, false, true);
    call_fail("clCreateKernel", EVERY_CALL, true, true);
    call_fail("clBuildProgram", 0, false, false); // built once more, despite PoCL's cache
    call_fail("clBuildProgram", EVERY_CALL, false, true);
    assert_work_is_right(NULL);
    cache_restore(cache);
}

// Lists the devices and chooses one. The list names the call that failed first, and so does the message if no
// device is left.
static void devices_discover(const char *failed_call)
{
    DeviceList list;
    OwnedMessageList messages = {0};
    device_list_open(&list, NULL);
    const Device *chosen = device_choose(&list, NULL, &messages);
    assert_int_equal(messages.count, chosen == NULL);
    if (failed_call) assert_string_equal(list.failed_call, failed_call);
    if (messages.count > 0)
        assert_non_null(
            strstr(messages.items[0].text, formatted("(%s: CL_OUT_OF_RESOURCES (-5))", failed_call)));
    device_list_close(&list);
}

TEST(discovery)
{
    static const char *const queries[] = {"clGetPlatformIDs", "clGetPlatformInfo", "clGetDeviceIDs",
                                          "clGetDeviceInfo"};
    for (size_t i = 0; i < COUNT_OF(queries); i++) {
        injected = (Fault){.call = queries[i], .act = FAULT_COUNT};
        devices_discover(NULL);
        const size_t count = injected.count;
        for (size_t k = 0; k < count; k++) {
            injected = (Fault){.call = queries[i], .index = k, .act = FAULT_FAIL};
            devices_discover(queries[i]);
        }
    }
    injected.call = NULL;
}

// A device whose memory is unknown is used until a buffer cannot be created.
TEST(unknown_memory)
{
    const Device *known = work_device;
    Device unknown = *work_device;
    unknown.memory_bytes = unknown.largest_buffer_bytes = 0;
    work_device = &unknown;
    assert_work_is_right(NULL);
    injected = (Fault){.call = "clCreateBuffer", .act = FAULT_FAIL};
    Compute compute;
    WorkResult result;
    assert_false(work(&compute, &result));
    OWNED char *text = compute_failure_text(&compute);
    assert_non_null(strstr(text, "the device does not report its memory"));
    assert_null(strstr(text, "the device has 0"));
    compute_close_checked(&compute);
    injected.call = NULL;
    work_device = known;
}

TEST_MAIN(work_set_up, work_tear_down)
