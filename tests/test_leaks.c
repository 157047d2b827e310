// Checks that LeakSanitizer, in a sanitized build, finds what glint forgets to release, including OpenCL
// objects, which the driver allocates. It must not blame glint for what the driver keeps.
#include "host/opencl/compute.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/files.h"

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
enum { SANITIZED = 1 };
#else
static int __lsan_do_recoverable_leak_check(void)
{
    return 0;
}
enum { SANITIZED = 0 };
#endif

typedef enum { NOTHING, MEMORY, BUFFER, KERNEL, PROGRAM } Forgotten;
enum { LEAKED = 23 };

static void cl_must(cl_int status)
{
    if (status != CL_SUCCESS) abort();
}

// Launches a kernel, so that the driver has compiled it and started its threads, and releases all but one
// thing. That is never the context or queue, since idle worker threads of PoCL may keep pointers to both.
static __attribute__((noinline)) void launch_and_forget(Forgotten forgotten)
{
    DeviceList list;
    MessageList messages = {0};
    device_list_open(&list, NULL);
    const Device *device = device_choose(&list, device_selector(NULL), &messages);
    if (!device) _exit(NO_DEVICE);
    message_list_free(&messages);
    Compute compute;
    compute_open(&compute, device);

    const char *text =
        "kernel void index(global uint *values) { values[get_global_id(0)] = get_global_id(0); }\n";
    cl_program program = clCreateProgramWithSource(compute.context, 1, &text, NULL, NULL);
    cl_must(clBuildProgram(program, 1, &device->id, "", NULL, NULL));
    cl_kernel kernel = clCreateKernel(program, "index", NULL);
    cl_mem buffers[2]; // worker threads of PoCL keep pointers to the one that they used last
    for (size_t i = 0; i < 2; i++) {
        buffers[i] = clCreateBuffer(compute.context, CL_MEM_READ_WRITE, 64, NULL, NULL);
        cl_must(clSetKernelArg(kernel, 0, sizeof *buffers, &buffers[i]));
        cl_must(clEnqueueNDRangeKernel(compute.queue, kernel, 1, NULL, &(size_t){16}, NULL, 0, NULL, NULL));
        cl_must(clFinish(compute.queue));
    }
    cl_must(clReleaseKernel(kernel)); // PoCL's worker threads keep a pointer to what they ran
    kernel = clCreateKernel(program, "index", NULL);

    void *memory = memory_allocate(64, 1);
    if (forgotten != MEMORY) free(memory);
    if (forgotten != BUFFER) cl_must(clReleaseMemObject(buffers[0]));
    cl_must(clReleaseMemObject(buffers[1]));
    if (forgotten != KERNEL) cl_must(clReleaseKernel(kernel));
    if (forgotten != PROGRAM) cl_must(clReleaseProgram(program));
    compute_close(&compute);
    device_list_close(&list);
}

// Overwrites the pointers that returned functions leave in the stack, where LeakSanitizer would find them.
static __attribute__((noinline)) void stack_clear(void)
{
    volatile char bytes[1 << 16];
    for (size_t i = 0; i < sizeof bytes; i++)
        bytes[i] = 0;
}

static void launch_and_check(void *forgotten)
{
    launch_and_forget(*(Forgotten *)forgotten);
    stack_clear();
    if (__lsan_do_recoverable_leak_check() != 0) _exit(LEAKED);
}

static void test_forgotten(void **state)
{
    if (!SANITIZED) {
        print_message("needs a build with LeakSanitizer (BUILD=build-sanitize)\n");
        skip();
    }
    Forgotten forgotten = *(Forgotten *)*state;
    char *folder = scratch_open();
    const int expected = forgotten == NOTHING ? 0 : LEAKED;
    ChildEnd end = child_run(launch_and_check, &forgotten, sizeof forgotten);
    // a pointer that a worker thread's stack still holds hides a leak
    for (int i = 0; i < 4 && end.status == 0 && expected != 0; i++)
        end = child_run(launch_and_check, &forgotten, sizeof forgotten);
    scratch_close(folder);
    if (end.status == NO_DEVICE) skip();
    if (end.status != expected) print_error("%s\n", end.errors);
    assert_int_equal(end.status, expected);
}

TEST_CASE(no_leak, test_forgotten, &(Forgotten){NOTHING})
TEST_CASE(leaked_memory, test_forgotten, &(Forgotten){MEMORY})
TEST_CASE(leaked_buffer, test_forgotten, &(Forgotten){BUFFER})
TEST_CASE(leaked_kernel, test_forgotten, &(Forgotten){KERNEL})
TEST_CASE(leaked_program, test_forgotten, &(Forgotten){PROGRAM})

TEST_MAIN(NULL, NULL)
