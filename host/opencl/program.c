// Composes programs and loads them from the cache or builds them.
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/opencl/cache.h"
#include "host/opencl/compose.h"
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

static const char *or_empty(const char *text)
{
    return text ? text : "";
}

void program_options_append(Text *text, const Device *device, const char *options)
{
    text_appendf(text, "%s", or_empty(options));
    if (device->build_options) text_appendf(text, " %s", device->build_options);
}

char *program_request_text(const ProgramRequest *request, bool is_out_of_line)
{
    return kernel_compose(kernel_files, request->root,
                          or_empty(is_out_of_line ? request->out_of_line_prelude : request->prelude));
}

// Returns a key of everything that the compiled program depends on. The native width distinguishes
// processors of the same name. The caller frees it.
static char *request_key(const Device *device, const ProgramRequest *request, const char *text)
{
    Text key = {0};
    text_appendf(&key, "options ");
    program_options_append(&key, device, request->options);
    text_appendf(&key, "\nlaunch %s\n", or_empty(request->launch));
    if (!request->launch && device->work_group[0] > 0)
        text_appendf(&key, "work-group %zux%zu\n", device->work_group[0], device->work_group[1]);
    text_appendf(&key, "device %s\nboard %s, %s, native width %u\n", device->name, device->board,
                 device->version, device->native_float_width);
    text_appendf(&key, "driver %s, %s\n", device->vendor, device->driver);
    text_appendf(&key, "platform %s, %s\n", device->platform_name, device->platform_version);
    text_append(&key, text, strlen(text));
    return key.items;
}

char *program_key(const Device *device, const ProgramRequest *request)
{
    char *text = program_request_text(request, false), *key = request_key(device, request, text);
    free(text);
    return key;
}

static char *build_log(const Compute *compute, cl_program program)
{
    size_t size = 0;
    cl_device_id id = compute->device->id;
    if (clGetProgramBuildInfo(program, id, CL_PROGRAM_BUILD_LOG, 0, NULL, &size) != CL_SUCCESS) size = 0;
    char *log = memory_allocate_zeroed(size + 1, 1);
    if (size > 0) clGetProgramBuildInfo(program, id, CL_PROGRAM_BUILD_LOG, size, log, NULL);
    return log;
}

// Saves the text for readers of the build log. Returns its path, or a replacement for messages. The caller
// frees it.
static char *text_save(const char *text)
{
    char path[4096];
    const char *folder = getenv("TMPDIR");
    snprintf(path, sizeof path, "%s/glint-kernel-XXXXXX.cl", folder && folder[0] != '\0' ? folder : "/tmp");
    int descriptor = mkstemps(path, 3);
    FILE *file = descriptor < 0 ? NULL : fdopen(descriptor, "w");
    bool written = file && fputs(text, file) >= 0;
    if (file && fclose(file) != 0) written = false;
    if (!file && descriptor >= 0) close(descriptor);
    if (!written && descriptor >= 0) unlink(path);
    return memory_copy_text(written ? path : "could not be saved");
}

// Describes the disk of the drivers' caches, found by PoCL's variable, then by the XDG Base Directory
// Specification.
static void cache_disk_describe(Text *text)
{
    const char *pocl = getenv("POCL_CACHE_DIR"), *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    const char *folder = pocl ? pocl : cache ? cache : or_empty(home);
    const uint64_t kibi = 1024, needed_kibi = 1024; // PoCL writes less than this per program
    struct statvfs disk;
    if (statvfs(folder, &disk) != 0 || disk.f_blocks == 0) return;
    uint64_t free_kibi = (uint64_t)disk.f_bavail * disk.f_frsize / kibi;
    if (free_kibi < needed_kibi)
        text_appendf(text, "\nthe disk of the driver's cache, %s, is full (%" PRIu64 " KiB free)", folder,
                     free_kibi);
}

// A build and its kernel if one is requested.
typedef struct {
    cl_program program;
    cl_kernel kernel;
    const char *failed_call; // or NULL
    cl_int status;
} Build;

static void build_release(Build *build)
{
    if (build->kernel) clReleaseKernel(build->kernel);
    if (build->program) clReleaseProgram(build->program);
    *build = (Build){0};
}

static bool build_check(Build *build, const char *call, cl_int status, bool is_there)
{
    fault_record_call(NULL);
    if (status == CL_SUCCESS && is_there) return true;
    build->failed_call = call;
    build->status = status;
    return false;
}

// Records a failed build as the Compute's failure and releases it.
static void build_report(Compute *compute, Build *build, const char *text, const char *options)
{
    if (build->program && strcmp(build->failed_call, "clBuildProgram") == 0) {
        char *log = build_log(compute, build->program), *path = text_save(text);
        Text reason = {0};
        text_appendf(&reason, "options \"");
        program_options_append(&reason, compute->device, options);
        text_appendf(&reason, "\"\n%s", log[strspn(log, " \n")] ? log : "the driver gives no build log");
        cache_disk_describe(&reason);
        compute_fail(compute, build->failed_call, build->status, "%s\nthe composed text: %s", text_c(&reason),
                     path);
        text_free(&reason);
        free(path);
        free(log);
    } else {
        compute_check_object(compute, NULL, build->status, build->failed_call);
    }
    build_release(build);
}

static bool build_run(Build *build, const Device *device, const Text *options)
{
    fault_record_call("clBuildProgram");
    cl_int status = clBuildProgram(build->program, 1, &device->id, text_c(options), NULL, NULL);
    return build_check(build, "clBuildProgram", status, true);
}

// Adds a unique option, which makes PoCL build, because the key of its cache contains the options.
static void unused_option_append(Text *options)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    text_appendf(options, " -D GLINT_BUILD=%jd%09ld%d", (intmax_t)now.tv_sec, now.tv_nsec, (int)getpid());
}

static void kernel_create(Build *build, const char *name)
{
    if (!name) return;
    cl_int status;
    fault_record_call("clCreateKernel");
    build->kernel = clCreateKernel(build->program, name, &status);
    build_check(build, "clCreateKernel", status, build->kernel);
}

// Writes `contents` to a file of the device's kernel folder named by the hash of the kernel's text, unless
// the mode is "wx" and the file exists. Only warns on failure, since no result depends on it.
static void kernel_file_write(const Device *device, const char *text, const char *ending, const char *mode,
                              const char *contents)
{
    const uint64_t hash = hash_bytes(HASH_START, text, strlen(text));
    char *path = text_format("%s/%016" PRIx64 ".%s", device->kernel_folder, hash, ending);
    FILE *file = fopen(path, mode);
    bool written = file ? fputs(contents, file) >= 0 : errno == EEXIST;
    if (file && fclose(file) != 0) written = false;
    if (!written && device->warnings) {
        MessageList messages = {0};
        message_warning(&messages, "cannot write '%s': %s", path, strerror(errno));
        device->warnings->deliver(device->warnings->context, &messages);
        message_list_free(&messages);
    }
    free(path);
}

// Appends a build to the log of its kernel.
static void build_log_keep(const Compute *compute, const Build *build, const char *text, const char *options,
                           double seconds)
{
    const Device *device = compute->device;
    if (!device->kernel_folder) return;
    Text entry = {0};
    fault_record_call("clGetProgramBuildInfo");
    char *log = build_log(compute, build->program);
    fault_record_call(NULL);
    text_appendf(&entry, "device: %s, %s\noptions: %s\nbuild: %s, %.3f s\n%s\n", device->name, device->driver,
                 options, cl_status_name(build->status), seconds, log);
    kernel_file_write(device, text, "log", "a", text_c(&entry));
    free(log);
    text_free(&entry);
}

static Build build_from_source(Compute *compute, const char *text, const ProgramRequest *request,
                               bool bypasses_driver_cache)
{
    Build build = {0};
    cl_int status;
    fault_record_call("clCreateProgramWithSource");
    build.program = clCreateProgramWithSource(compute->context, 1, &text, NULL, &status);
    if (!build_check(&build, "clCreateProgramWithSource", status, build.program)) return build;
    Text options = {0};
    program_options_append(&options, compute->device, request->options);
    if (bypasses_driver_cache) unused_option_append(&options);
    // before the build, which may crash
    if (compute->device->kernel_folder) kernel_file_write(compute->device, text, "cl", "wx", text);
    const double start = clock_seconds();
    const bool is_built = build_run(&build, compute->device, &options);
    build_log_keep(compute, &build, text, text_c(&options), clock_seconds() - start);
    text_free(&options);
    if (is_built) kernel_create(&build, request->kernel);
    return build;
}

// Builds the program. Simultaneous builds of the same one can fail in PoCL's cache (3.1: one removes the
// file that another reads), so a build counts as failed only if it also fails outside that cache.
static Build build_with_retry(Compute *compute, const char *text, const ProgramRequest *request)
{
    Build build = {0};
    if (!request->no_cache) {
        build = build_from_source(compute, text, request, false);
        if (!build.failed_call || strcmp(build.failed_call, "clBuildProgram") != 0) return build;
        build_release(&build);
    }
    return build_from_source(compute, text, request, true);
}

// Loads a binary. The build has no program if the driver rejects the binary.
static Build build_from_binary(const Compute *compute, const Text *binary, const ProgramRequest *request)
{
    Build build = {0};
    const unsigned char *bytes = (const unsigned char *)text_c(binary);
    cl_int binary_status, status;
    fault_record_call("clCreateProgramWithBinary");
    build.program = clCreateProgramWithBinary(compute->context, 1, &compute->device->id, &binary->count,
                                              &bytes, &binary_status, &status);
    if (build_check(&build, "clCreateProgramWithBinary", status, build.program)) {
        Text options = {0};
        program_options_append(&options, compute->device, request->options);
        if (build_run(&build, compute->device, &options)) kernel_create(&build, request->kernel);
        text_free(&options);
    }
    if (build.failed_call) build_release(&build);
    return build;
}

static Build build_from_cache(const Compute *compute, const ProgramRequest *request, const char *text)
{
    Build build = {0};
    if (request->no_cache || !text) return build;
    char *key = request_key(compute->device, request, text);
    Text binary = {0};
    if (cache_load(key, &binary, compute->device->warnings))
        build = build_from_binary(compute, &binary, request);
    text_free(&binary);
    free(key);
    return build;
}

// Loads the program of the first text or, if that one could not be built, of the second, out-of-line one,
// which may be NULL. The build has no program if neither is in the cache.
static Build load_any(const Compute *compute, const ProgramRequest *request, char *const texts[2],
                      bool *is_out_of_line)
{
    Build build = build_from_cache(compute, request, texts[0]);
    *is_out_of_line = !build.program;
    return build.program ? build : build_from_cache(compute, request, texts[1]);
}

// Builds the program of the first text or, if that fails, of the second. If both fail, returns the first
// failure.
static Build build_any(Compute *compute, const ProgramRequest *request, char *const texts[2],
                       bool *is_out_of_line)
{
    Build build = build_with_retry(compute, texts[0], request);
    *is_out_of_line = false;
    if (!build.failed_call || !texts[1]) return build;
    Build out_of_line = build_with_retry(compute, texts[1], request);
    *is_out_of_line = !out_of_line.failed_call;
    build_release(*is_out_of_line ? &build : &out_of_line);
    return *is_out_of_line ? out_of_line : build;
}

bool program_build(Compute *compute, const ProgramRequest *request, Program *program)
{
    *program = (Program){0};
    if (!compute_ok(compute)) return false;
    const double start = clock_seconds();
    char *const texts[] = {program_request_text(request, false),
                           request->out_of_line_prelude ? program_request_text(request, true) : NULL};
    Build build = load_any(compute, request, texts, &program->is_out_of_line);
    program->from_cache = build.program != NULL;
    if (!program->from_cache) build = build_any(compute, request, texts, &program->is_out_of_line);
    const char *text = texts[program->is_out_of_line];
    program->text_hash = hash_bytes(HASH_START, text, strlen(text));
    if (build.failed_call) build_report(compute, &build, text, or_empty(request->options));
    program->program = build.program;
    program->kernel = build.kernel;
    free(texts[0]);
    free(texts[1]);
    program->build_seconds = clock_seconds() - start;
    return compute_ok(compute);
}

static bool program_query(const Program *program, cl_program_info what, size_t size, void *value)
{
    fault_record_call("clGetProgramInfo");
    cl_int status = clGetProgramInfo(program->program, what, size, value, NULL);
    fault_record_call(NULL);
    return status == CL_SUCCESS;
}

void program_store(Compute *compute, const ProgramRequest *request, const Program *program)
{
    if (request->no_cache || program->from_cache || !compute_ok(compute)) return;
    size_t size = 0;
    // a driver without a binary costs the next run a build; this one has its image
    if (!program_query(program, CL_PROGRAM_BINARY_SIZES, sizeof size, &size) || size == 0) return;
    char *bytes = memory_allocate(size, 1);
    if (!program_query(program, CL_PROGRAM_BINARIES, sizeof bytes, &bytes)) {
        free(bytes);
        return;
    }
    char *text = program_request_text(request, program->is_out_of_line),
         *key = request_key(compute->device, request, text);
    Text binary = {.items = bytes, .count = size, .capacity = size};
    cache_store(key, &binary, compute->device->warnings);
    text_free(&binary);
    free(key);
    free(text);
}

void program_close(Program *program)
{
    if (program->kernel) clReleaseKernel(program->kernel);
    if (program->program) clReleaseProgram(program->program);
    *program = (Program){0};
}
