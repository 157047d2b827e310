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
    OWNED char *text = program_request_text(request, false);
    return request_key(device, request, text);
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

// A built program, and the call that failed.
typedef struct {
    Program built;
    const char *failed_call; // or NULL
    cl_int status;
} Build;

static void build_release(Build *build)
{
    program_close(&build->built);
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
    if (build->built.program && strcmp(build->failed_call, "clBuildProgram") == 0) {
        OWNED char *log = build_log(compute, build->built.program), *path = text_save(text);
        OwnedText reason = {0};
        text_appendf(&reason, "options \"");
        program_options_append(&reason, compute->device, options);
        text_appendf(&reason, "\"\n%s", log[strspn(log, " \n")] ? log : "the driver gives no build log");
        cache_disk_describe(&reason);
        compute_fail(compute, build->failed_call, build->status, "%s\nthe composed text: %s", text_c(&reason),
                     path);
    } else {
        compute_check_object(compute, NULL, build->status, build->failed_call);
    }
    build_release(build);
}

static bool build_run(Build *build, const Device *device, const Text *options)
{
    fault_record_call("clBuildProgram");
    cl_int status = clBuildProgram(build->built.program, 1, &device->id, text_c(options), NULL, NULL);
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
    build->built.kernel = clCreateKernel(build->built.program, name, &status);
    build_check(build, "clCreateKernel", status, build->built.kernel);
}

// Writes `contents` to a file of the device's kernel folder named by the hash of the kernel's text, unless
// the mode is "wx" and the file exists. Only warns on failure, since no result depends on it.
static void kernel_file_write(const Device *device, const char *text, const char *ending, const char *mode,
                              const char *contents)
{
    const uint64_t hash = hash_bytes(HASH_START, text, strlen(text));
    OWNED char *path = text_format("%s/%016" PRIx64 ".%s", device->kernel_folder, hash, ending);
    FILE *file = fopen(path, mode);
    bool written = file ? fputs(contents, file) >= 0 : errno == EEXIST;
    if (file && fclose(file) != 0) written = false;
    if (!written && device->warnings) {
        OwnedMessageList messages = {0};
        message_warning(&messages, "cannot write '%s': %s", path, strerror(errno));
        device->warnings->deliver(device->warnings->context, &messages);
    }
}

// Appends a build to the log of its kernel.
static void build_log_keep(const Compute *compute, const Build *build, const char *text, const char *options,
                           double seconds)
{
    const Device *device = compute->device;
    if (!device->kernel_folder) return;
    OwnedText entry = {0};
    fault_record_call("clGetProgramBuildInfo");
    OWNED char *log = build_log(compute, build->built.program);
    fault_record_call(NULL);
    text_appendf(&entry, "device: %s, %s\noptions: %s\nbuild: %s, %.3f s\n%s\n", device->name, device->driver,
                 options, cl_status_name(build->status), seconds, log);
    kernel_file_write(device, text, "log", "a", text_c(&entry));
}

static Build build_from_source(Compute *compute, const char *text, const ProgramRequest *request,
                               bool bypasses_driver_cache)
{
    Build build = {0};
    cl_int status;
    fault_record_call("clCreateProgramWithSource");
    build.built.program = clCreateProgramWithSource(compute->context, 1, &text, NULL, &status);
    if (!build_check(&build, "clCreateProgramWithSource", status, build.built.program)) return build;
    OwnedText options = {0};
    program_options_append(&options, compute->device, request->options);
    if (bypasses_driver_cache) unused_option_append(&options);
    // before the build, which may crash
    if (compute->device->kernel_folder) kernel_file_write(compute->device, text, "cl", "wx", text);
    const double start = clock_seconds();
    const bool is_built = build_run(&build, compute->device, &options);
    build_log_keep(compute, &build, text, text_c(&options), clock_seconds() - start);
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
    build.built.program = clCreateProgramWithBinary(compute->context, 1, &compute->device->id, &binary->count,
                                                    &bytes, &binary_status, &status);
    build.built.from_cache = true;
    if (build_check(&build, "clCreateProgramWithBinary", status, build.built.program)) {
        OwnedText options = {0};
        program_options_append(&options, compute->device, request->options);
        if (build_run(&build, compute->device, &options)) kernel_create(&build, request->kernel);
    }
    if (build.failed_call) build_release(&build);
    return build;
}

static Build build_from_cache(const Compute *compute, const ProgramRequest *request, const char *text)
{
    if (request->no_cache || !text) return (Build){0};
    OWNED char *key = request_key(compute->device, request, text);
    OwnedText binary = {0};
    if (!cache_load(key, &binary, compute->device->warnings)) return (Build){0};
    return build_from_binary(compute, &binary, request);
}

// Loads the program of the first text or, if that one could not be built, of the second, out-of-line one,
// which may be NULL. The build has no program if neither is in the cache.
static Build load_any(const Compute *compute, const ProgramRequest *request, char *const texts[2])
{
    Build build = build_from_cache(compute, request, texts[0]);
    if (build.built.program) return build;
    build = build_from_cache(compute, request, texts[1]);
    build.built.is_out_of_line = true;
    return build;
}

// Builds the program of the first text or, if that fails, of the second. If both fail, returns the first
// failure.
static Build build_any(Compute *compute, const ProgramRequest *request, char *const texts[2])
{
    Build build = build_with_retry(compute, texts[0], request);
    if (!build.failed_call || !texts[1]) return build;
    Build out_of_line = build_with_retry(compute, texts[1], request);
    const bool is_built = !out_of_line.failed_call;
    build_release(is_built ? &build : &out_of_line);
    out_of_line.built.is_out_of_line = true;
    return is_built ? out_of_line : build;
}

bool program_build(Compute *compute, const ProgramRequest *request, Program *program)
{
    *program = (Program){0};
    if (!compute_ok(compute)) return false;
    const double start = clock_seconds();
    OWNED char *text = program_request_text(request, false),
               *out_of_line = request->out_of_line_prelude ? program_request_text(request, true) : NULL;
    char *const texts[] = {text, out_of_line};
    Build build = load_any(compute, request, texts);
    if (!build.built.program) build = build_any(compute, request, texts);
    const char *used = texts[build.built.is_out_of_line];
    if (build.failed_call) build_report(compute, &build, used, or_empty(request->options));
    *program = build.built;
    program->text_hash = hash_bytes(HASH_START, used, strlen(used));
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
    OwnedText binary = {.items = memory_allocate(size, 1), .count = size, .capacity = size};
    if (!program_query(program, CL_PROGRAM_BINARIES, sizeof binary.items, &binary.items)) return;
    OWNED char *text = program_request_text(request, program->is_out_of_line),
               *key = request_key(compute->device, request, text);
    cache_store(key, &binary, compute->device->warnings);
}

void program_close(Program *program)
{
    if (program->kernel) clReleaseKernel(program->kernel);
    if (program->program) clReleaseProgram(program->program);
    *program = (Program){0};
}
