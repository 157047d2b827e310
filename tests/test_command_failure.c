// Tests what a command prints, writes and exits with if an OpenCL call fails or its driver crashes.
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/cli/commands.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/failing/calls.h"
#include "tests/files.h"
#include <signal.h>
#include <sys/stat.h>

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

// Asserts that the process printed the text. Drivers may print warnings first, as PoCL 3.1 does on arm64.
static void assert_prints(const ChildEnd *end, const char *expected)
{
    if (!strstr(end->errors, expected)) print_error("%s\n", end->errors);
    assert_non_null(strstr(end->errors, expected));
}

TEST(commands)
{
    static const Command commands[] = {
        {command_render, {"render", "scenes/spheres16.yaml", "--size", "8x8", "-o", "/dev/null/none.png"}},
        {command_trace, {"trace", "scenes/spheres16.yaml", "--rays", "/dev/null"}},
        {command_bench, {"bench", "scenes/spheres16.yaml", "--size", "8x8"}},
        {command_accuracy, {"accuracy", "scenes/spheres16.yaml", "--size", "8x8"}},
        {command_verify, {"verify", "P1"}},
    };
    static const char *const calls[] = {"clCreateContext", "clCreateCommandQueue", "clCreateBuffer"};
    for (size_t i = 0; i < COUNT_OF(commands); i++)
        for (size_t k = 0; k < COUNT_OF(calls); k++) {
            Command command = commands[i];
            failing_call = calls[k];
            ChildEnd end = child_run(command_fail, &command, sizeof command);
            assert_prints(&end, formatted("glint: %s: CL_OUT_OF_RESOURCES (-5) on ", calls[k]));
            assert_int_equal(end.status, EXIT_MACHINE);
        }
}

static void assert_same_bytes(const char *one, const char *other)
{
    OwnedText first = file_text(one), second = file_text(other);
    assert_true(first.count > 0);
    assert_int_equal(first.count, second.count);
    assert_memory_equal(first.items, second.items, first.count);
}

// If one of two devices fails, or the scene does not fit it, there is a warning and the same image. If both
// fail, or the scene does not fit a device that was named, there is an error.
TEST(several_devices)
{
    static const char pocl[] = "/etc/OpenCL/vendors/pocl.icd";
    if (access(pocl, R_OK) != 0) skip();
    char one[] = "/tmp/glint-test-XXXXXX.npy", other[] = "/tmp/glint-test-XXXXXX.npy";
    assert_true(close(mkstemps(one, 4)) == 0 && close(mkstemps(other, 4)) == 0);
    static const char dropped[] = "glint: warning: ";
    const struct {
        const char *call;
        size_t index;
        const char *devices, *file, *expected, *reason;
        int status;
        bool first_is_tiny;
    } runs[] = {
        {NULL, 0, "all", one, "", "", EXIT_DONE, false},
        {"clEnqueueNDRangeKernel", 0, "all", other, dropped,
         "clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES (-5) on ", EXIT_DONE, false},
        {"clCreateContext", 0, "all", other, dropped, "clCreateContext: CL_OUT_OF_RESOURCES (-5) on ",
         EXIT_DONE, false},
        {NULL, 0, "all", other, dropped, "the scene needs ", EXIT_DONE, true},
        {"clEnqueueNDRangeKernel", EVERY_CALL, "all", "/dev/null/none.npy",
         "\nglint: ", "clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES (-5) on ", EXIT_MACHINE, false},
        {NULL, 0, "0,1", "/dev/null/none.npy", "glint: error: ", "the scene needs ", EXIT_USER, true}};
    driver_folder = pocl;
    for (size_t i = 0; i < COUNT_OF(runs); i++) {
        Command command = {command_render,
                           {"render", "scenes/spheres16.yaml", "--size", "64x48", "--device", runs[i].devices,
                            "-o", runs[i].file}};
        const char *expected = formatted("%s%s", runs[i].expected, runs[i].reason);
        failing_call = runs[i].call;
        failing_index = runs[i].index;
        first_is_tiny = runs[i].first_is_tiny;
        ChildEnd end = child_run(command_fail, &command, sizeof command);
        assert_prints(&end, expected);
        assert_int_equal(end.status, runs[i].status);
        if (runs[i].file != other) continue;
        assert_prints(&end, "; the other devices render its share\n");
        assert_same_bytes(one, other);
    }
    driver_folder = NULL;
    failing_index = 0;
    first_is_tiny = false;
    unlink(one);
    unlink(other);
}

// A complete image is written whatever a release returns.
TEST(release_after_the_output)
{
    char path[] = "/tmp/glint-test-XXXXXX.png";
    assert_true(close(mkstemps(path, 4)) == 0);
    Command command = {command_render,
                       {"render", "scenes/spheres16.yaml", "--size", "8x8", "--quiet", "-o", path}};
    failing_call = "clEnqueueUnmapMemObject";
    ChildEnd end = child_run(command_fail, &command, sizeof command);
    assert_prints(&end, "glint: warning: clEnqueueUnmapMemObject: CL_OUT_OF_RESOURCES (-5) on ");
    assert_int_equal(end.status, EXIT_DONE);
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    assert_true(status.st_size > 0);
    unlink(path);
}

// A driver that crashes is named with its call. If the output is complete, this is a warning.
TEST(crashes)
{
#ifdef __SANITIZE_ADDRESS__
    skip(); // sanitizers handle crashes
#else
    static const char *const calls[] = {"clGetPlatformIDs", "clBuildProgram", "clWaitForEvents",
                                        "clGetProgramInfo"};
    static const int crashes[] = {SIGSEGV, SIGABRT, FAILED_ASSERTION};
    char *folder = folder_make();
    crash_folder = folder; // an empty cache: no program comes from it
    for (size_t i = 0; i < COUNT_OF(calls); i++)
        for (size_t k = 0; k < COUNT_OF(crashes); k++) {
            bool is_complete = i == 3;
            char path[] = "/tmp/glint-test-XXXXXX.png", expected[80];
            assert_true(close(mkstemps(path, 4)) == 0);
            Command command = {command_render,
                               {"render", "scenes/spheres16.yaml", "--size", "8x8", "-o", path}};
            failing_call = calls[i];
            crash = crashes[k];
            ChildEnd end = child_run(command_fail, &command, sizeof command);
            snprintf(expected, sizeof expected, "glint: %s%s: the OpenCL driver %s",
                     is_complete ? "warning: " : "", calls[i], k ? "aborted" : "crashed");
            assert_prints(&end, expected);
            assert_int_equal(end.status, is_complete ? EXIT_DONE : EXIT_MACHINE);
            struct stat status;
            assert_int_equal(stat(path, &status), 0);
            assert_int_equal(status.st_size > 0, is_complete);
            unlink(path);
        }
    crash = 0;
    folder_remove(folder);
#endif
}

// Each command is a separate process, which forks before this one has opened a device.
TEST_MAIN(NULL, NULL)
