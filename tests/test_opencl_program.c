// Builds, launches and caches programs on the device of this machine. Each step is a separate process, as
// users run them, and the next step finds what the first one left.
//
// run_tests: first
// run_tests: sanitize-long-only
#include "host/base/fault.h"
#include "host/opencl/cache.h"
#include "host/opencl/compose.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/files.h"
#include <ftw.h>
#include <sys/wait.h>

// features.h has nothing for the device: the prelude is the kernel.
static const char triple[] =
    "kernel void triple(global uint *values) { values[get_global_id(0)] = 3 * get_global_id(0); }\n";

typedef struct {
    DeviceList list;
    Compute compute;
} Opened;

static void opened_open(Opened *opened, WarningReceiver *warnings)
{
    MessageList messages = {0};
    device_list_open(&opened->list, warnings);
    const Device *device = device_choose(&opened->list, device_selector(NULL), &messages);
    message_list_print(&messages, stderr);
    if (!device) _exit(NO_DEVICE);
    compute_open(&opened->compute, device);
}

// Ends the process with status 2 where the device failed, as glint does.
static void opened_close(Opened *opened)
{
    char *failure = compute_ok(&opened->compute) ? NULL : compute_failure_text(&opened->compute);
    compute_close(&opened->compute);
    compute_close(&opened->compute); // a second close does nothing
    device_list_close(&opened->list);
    if (failure) fault("%s", failure);
}

// Shared objects in the folder: PoCL's finished machine code. Other runtimes have none.
static size_t shared_object_count;

static int count_one(const char *path, const struct stat *status, int type, struct FTW *place)
{
    (void)status, (void)type, (void)place;
    size_t length = strlen(path);
    shared_object_count += length > 3 && strcmp(path + length - 3, ".so") == 0;
    return 0;
}

static size_t count_shared_objects(void)
{
    shared_object_count = 0;
    const char *drivers_cache = getenv("POCL_CACHE_DIR");
    if (drivers_cache) nftw(drivers_cache, count_one, 16, FTW_PHYS);
    return shared_object_count;
}

typedef struct {
    ProgramRequest request;
    bool from_cache, is_pocl, times_sound;
    uint64_t text_hash;
    cl_uint values[16];
    size_t compiled_before_launch, compiled_after_launch;
} TripleRun;

static void run_triple(void *result)
{
    TripleRun *run = result;
    Opened opened;
    opened_open(&opened, NULL);
    Compute *compute = &opened.compute;
    Program program;
    program_build(compute, &run->request, &program);
    run->from_cache = program.from_cache;
    run->text_hash = program.text_hash;
    run->is_pocl = strstr(compute->device->platform_name, "Portable Computing Language") != NULL;
    run->compiled_before_launch = count_shared_objects();

    cl_mem buffer = buffer_create(compute, sizeof run->values, NULL, CL_MEM_READ_WRITE);
    kernel_argument(compute, program.kernel, 0, sizeof buffer, &buffer);
    LaunchTime time =
        kernel_launch(compute, program.kernel, 1, NULL, (const size_t[]){16}, (const size_t[]){8});
    run->times_sound = time.host_seconds > 0 && (time.fault || time.event_seconds > 0);
    run->compiled_after_launch = count_shared_objects();
    buffer_read(compute, buffer, sizeof run->values, run->values);

    program_store(compute, &run->request, &program);
    buffer_release(buffer);
    program_close(&program);
    program_close(&program); // a second close does nothing
    opened_close(&opened);
}

static TripleRun run_in_child(ProgramRequest request)
{
    TripleRun run = {.request = request};
    ChildEnd end = child_run_with_device(run_triple, &run, sizeof run);
    if (end.status != 0) print_error("%s\n", end.errors);
    assert_int_equal(end.status, 0);
    assert_true(run.times_sound);
    for (cl_uint i = 0; i < 16; i++)
        assert_int_equal(run.values[i], 3 * i);
    return run;
}

static ProgramRequest triple_request(void)
{
    return (ProgramRequest){
        .root = "features.h", .prelude = triple, .kernel = "triple", .launch = "triple 8"};
}

static void drivers_own_cache_empty(void)
{
    OWNED char *empty = NULL;
    assert_true(asprintf(&empty, "%s/driver-XXXXXX", scratch) > 0);
    assert_non_null(mkdtemp(empty));
    setenv("POCL_CACHE_DIR", empty, 1);
}

TEST_WITH(second_build_is_loaded_from_the_cache, scratch_set_up, scratch_tear_down)
{
    TripleRun cold = run_in_child(triple_request());
    assert_false(cold.from_cache);
    drivers_own_cache_empty();
    TripleRun warm = run_in_child(triple_request());
    assert_true(warm.from_cache);
    assert_true(warm.text_hash == cold.text_hash);
    // The cache returned machine code for this very launch.
    assert_int_equal(warm.compiled_before_launch, warm.compiled_after_launch);
    if (warm.is_pocl) assert_true(warm.compiled_before_launch > 0);
}

TEST_WITH(key_depends_on_every_input, scratch_set_up, scratch_tear_down)
{
    ProgramRequest request = triple_request();
    run_in_child(request);
    assert_true(run_in_child(request).from_cache);
    request.options = "-cl-fast-relaxed-math";
    assert_false(run_in_child(request).from_cache);
    assert_true(run_in_child(request).from_cache);
    request.launch = "triple 16";
    assert_false(run_in_child(request).from_cache);
    OWNED char *other = NULL;
    assert_true(asprintf(&other, "%s\n", triple) > 0);
    request = triple_request();
    request.prelude = other;
    assert_false(run_in_child(request).from_cache);
}

TEST_WITH(no_cache_builds_each_time, scratch_set_up, scratch_tear_down)
{
    ProgramRequest request = triple_request();
    run_in_child(request);
    request.no_cache = true;
    for (int i = 0; i < 2; i++) {
        TripleRun run = run_in_child(request);
        assert_false(run.from_cache);
        // PoCL did not find what it had built before.
        if (run.is_pocl) assert_true(run.compiled_after_launch > run.compiled_before_launch);
    }
}

static char *entry_path_found;

static int find_entry(const char *path, const struct stat *status, int type, struct FTW *place)
{
    (void)status, (void)type, (void)place;
    if (!strstr(path, "/glint/") || !strstr(path, ".bin")) return 0;
    entry_path_found = strdup(path);
    return 1;
}

// Returns the one entry of the cache. `key` receives its key, which lies behind a header of 64 bytes with
// the key's length at 16.
static Text the_entry(char **key)
{
    entry_path_found = NULL;
    nftw(scratch, find_entry, 16, FTW_PHYS);
    assert_non_null(entry_path_found);
    Text entry = file_text(entry_path_found);
    uint64_t key_length;
    memcpy(&key_length, entry.items + 16, sizeof key_length);
    *key = strndup(entry.items + 64, (size_t)key_length);
    return entry;
}

TEST_WITH(damaged_entry_is_replaced, scratch_set_up, scratch_tear_down)
{
    run_in_child(triple_request());
    char *key;
    OwnedText entry = the_entry(&key);
    FILE *file = fopen(entry_path_found, "r+b");
    assert_non_null(file);
    assert_int_equal(fseek(file, -1, SEEK_END), 0);
    assert_int_equal(fputc(entry.items[entry.count - 1] ^ 1, file),
                     (unsigned char)(entry.items[entry.count - 1] ^ 1));
    assert_int_equal(fclose(file), 0);
    assert_false(run_in_child(triple_request()).from_cache);
    assert_true(run_in_child(triple_request()).from_cache);
    free(entry_path_found);
    free(key);
}

// A whole entry whose binary the driver cannot use.
TEST_WITH(refused_binary_is_replaced, scratch_set_up, scratch_tear_down)
{
    run_in_child(triple_request());
    char *key;
    OwnedText nonsense = {0};
    Text entry = the_entry(&key);
    text_free(&entry);
    assert_string_equal(key + strlen(key) - strlen("#endif\n"), "#endif\n");
    text_appendf(&nonsense, "no binary of any driver");
    cache_store(key, &nonsense, NULL);
    assert_false(run_in_child(triple_request()).from_cache);
    assert_true(run_in_child(triple_request()).from_cache);
    free(entry_path_found);
    free(key);
}

static void warning_keep(void *context, MessageList *warnings)
{
    snprintf(context, 256, "%s", warnings->items[0].text);
}

static void build_without_kernel_folder(void *result)
{
    WarningReceiver warnings = {.deliver = warning_keep, .context = result};
    Opened opened;
    opened_open(&opened, &warnings);
    for (size_t i = 0; i < opened.list.count; i++)
        opened.list.items[i].kernel_folder = "none";
    ProgramRequest request = triple_request();
    request.no_cache = true;
    Program program;
    program_build(&opened.compute, &request, &program);
    program_close(&program);
    opened_close(&opened);
}

// A warning reaches the receiver and not standard error.
TEST_WITH(missing_kernel_folder_causes_a_warning, scratch_set_up, scratch_tear_down)
{
    char warning[256] = "";
    const ChildEnd end = child_run_with_device(build_without_kernel_folder, warning, sizeof warning);
    assert_int_equal(end.status, 0);
    assert_string_equal(end.errors, "");
    static const char start[] = "cannot write 'none/", ending[] = ".log': No such file or directory";
    assert_memory_equal(warning, start, strlen(start));
    assert_string_equal(warning + strlen(warning) - strlen(ending), ending);
}

// Processes that find empty caches at the same time do so in silence.
TEST_WITH(four_processes_build_the_same_program, scratch_set_up, scratch_tear_down)
{
    enum { PROCESSES = 4 };
    pid_t children[PROCESSES];
    const char *errors = formatted("%s/errors", scratch);
    for (int i = 0; i < PROCESSES; i++) {
        children[i] = fork();
        if (children[i] == 0) {
            if (!freopen(errors, "a", stderr)) _exit(1);
            TripleRun run = {.request = triple_request()};
            run_triple(&run);
            _exit(run.values[5] == 15 ? 0 : 1);
        }
    }
    for (int i = 0; i < PROCESSES; i++) {
        int status;
        assert_int_equal(waitpid(children[i], &status, 0), children[i]);
        if (WIFEXITED(status) && WEXITSTATUS(status) == NO_DEVICE) skip();
        assert_int_equal(status, 0);
    }
    check_content(errors, "");
    assert_true(run_in_child(triple_request()).from_cache);
}

TEST_WITH(programs_build_without_a_cache, scratch_set_up, scratch_tear_down)
{
    setenv("XDG_CACHE_HOME", "/dev/null", 1);
    assert_false(run_in_child(triple_request()).from_cache);
    assert_false(run_in_child(triple_request()).from_cache);
}

// Returns whether the log names the place. NVIDIA's compiler ignores #line and counts the lines of the whole
// text, which glint saves.
static bool names_place(const char *log, const char *place)
{
    return strstr(log, place) || strstr(log, "<kernel>:");
}

TEST_WITH(compile_error_names_its_place_and_the_saved_text, scratch_set_up, scratch_tear_down)
{
    TripleRun run = {.request = {.root = "features.h",
                                 .prelude = "// one\nkernel void triple(global uint *v) { v[0] = x; }"}};
    ChildEnd end = child_run_with_device(run_triple, &run, sizeof run);
    assert_int_equal(end.status, 2);
    assert_non_null(strstr(end.errors, "CL_BUILD_PROGRAM_FAILURE"));
    assert_true(names_place(end.errors, "prelude:2"));
    char *saved = strstr(end.errors, scratch);
    assert_non_null(saved);
    saved[strcspn(saved, "\n")] = '\0';
    OwnedText text = file_text(saved);
    assert_non_null(strstr(text_c(&text), "#line 1 \"features.h\""));
}

TEST_WITH(missing_root_is_named, scratch_set_up, scratch_tear_down)
{
    TripleRun run = {.request = {.root = "absent.cl", .prelude = ""}};
    ChildEnd end = child_run_with_device(run_triple, &run, sizeof run);
    assert_int_equal(end.status, 2);
    assert_non_null(strstr(end.errors, "absent.cl"));
}

static const EmbeddedFile broken_files[] = {
    {"root.cl", "// one\n#include \"good.h\"\n#include \"broken.h\"\n"},
    {"good.h", "// a\n// b\n// c\n"},
    {"broken.h", "// one\n#include \"good.h\"\n#include \"inner.h\"\nint broken = missing_name;\n"},
    {"inner.h", "// one\n// two\n"},
    {NULL, NULL},
};

typedef struct {
    char log[4096];
} BuildLog;

static void build_broken(void *result)
{
    Opened opened;
    opened_open(&opened, NULL);
    OWNED char *text = kernel_compose(broken_files, "root.cl", "");
    cl_int status;
    cl_program program =
        clCreateProgramWithSource(opened.compute.context, 1, (const char *[]){text}, NULL, &status);
    if (status != CL_SUCCESS) _exit(1);
    cl_device_id id = opened.compute.device->id;
    if (clBuildProgram(program, 1, &id, "", NULL, NULL) == CL_SUCCESS) _exit(1);
    char log[4096] = "";
    clGetProgramBuildInfo(program, id, CL_PROGRAM_BUILD_LOG, sizeof log, log, NULL);
    memcpy(((BuildLog *)result)->log, log, sizeof log);
    clReleaseProgram(program);
    opened_close(&opened);
}

TEST_WITH(compile_error_in_an_included_file_names_its_place, scratch_set_up, scratch_tear_down)
{
    BuildLog log = {0};
    assert_int_equal(child_run_with_device(build_broken, &log, sizeof log).status, 0);
    if (!names_place(log.log, "broken.h:4")) print_error("%s\n", log.log);
    assert_true(names_place(log.log, "broken.h:4"));
}

static void ask_for_too_much(void *result)
{
    (void)result;
    Opened opened;
    opened_open(&opened, NULL);
    buffer_create(&opened.compute, SIZE_MAX / 2, NULL, CL_MEM_READ_WRITE);
    opened_close(&opened);
}

static void use_an_absent_argument(void *result)
{
    TripleRun *run = result;
    Opened opened;
    opened_open(&opened, NULL);
    Program program;
    program_build(&opened.compute, &run->request, &program);
    kernel_argument(&opened.compute, program.kernel, 7, sizeof(cl_int), &(cl_int){0});
    program_close(&program);
    opened_close(&opened);
}

static void make_empty_buffers(void *result)
{
    (void)result;
    Opened opened;
    opened_open(&opened, NULL);
    buffer_release(buffer_create(&opened.compute, 0, NULL, CL_MEM_READ_ONLY));
    buffer_release(buffer_create(&opened.compute, 0, "", CL_MEM_READ_ONLY));
    opened_close(&opened);
}

TEST_WITH(failed_calls_are_named, scratch_set_up, scratch_tear_down)
{
    TripleRun run = {.request = triple_request()};
    ChildEnd end = child_run_with_device(ask_for_too_much, &run, sizeof run);
    assert_int_equal(end.status, 2);
    assert_non_null(strstr(end.errors, " requested; the device has "));
    end = child_run_with_device(use_an_absent_argument, &run, sizeof run);
    assert_int_equal(end.status, 2);
    assert_non_null(strstr(end.errors, "argument 7 of triple"));
    assert_non_null(strstr(end.errors, "CL_INVALID_ARG_INDEX"));
    assert_int_equal(child_run_with_device(make_empty_buffers, &run, sizeof run).status, 0);
}

TEST_MAIN(NULL, NULL)
