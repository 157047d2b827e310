// Programs: composed, then loaded from the cache or built.
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/opencl/cache.h"
#include "host/opencl/compose.h"
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

// All that the compiled program depends on. The native width distinguishes processors of the same name.
static char *request_key(const Compute *compute, const ProgramRequest *request, const char *text)
{
    const Device *device = compute->device;
    Text key = {0};
    text_appendf(&key, "options %s\nlaunch %s\n", or_empty(request->options), or_empty(request->launch));
    text_appendf(&key, "device %s, %s, native width %u\n", device->name, device->version,
                 device->native_float_width);
    text_appendf(&key, "driver %s, %s\n", device->vendor, device->driver);
    text_appendf(&key, "platform %s, %s\n", device->platform_name, device->platform_version);
    text_append(&key, text, strlen(text));
    return key.items;
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

// Saves the text for the reader of the build log. Caller frees the path, or what replaces it in a message.
static char *save_text(const char *text)
{
    char path[4096];
    const char *folder = getenv("TMPDIR");
    snprintf(path, sizeof path, "%s/glint-kernel-XXXXXX.cl", folder && folder[0] != '\0' ? folder : "/tmp");
    int descriptor = mkstemps(path, 3);
    FILE *file = descriptor < 0 ? NULL : fdopen(descriptor, "w");
    bool written = file && fputs(text, file) >= 0;
    if (file && fclose(file) != 0) written = false;
    return memory_copy_text(written ? path : "could not be saved");
}

// Where drivers keep what they compile: PoCL's own variable, then the XDG Base Directory Specification.
static void describe_cache_disk(Text *text)
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

static void build_fail(Compute *compute, cl_program program, cl_int status, const char *text,
                       const char *options)
{
    char *log = build_log(compute, program), *path = save_text(text);
    Text reason = {0};
    text_appendf(&reason, "%s", log[strspn(log, " \n")] ? log : "the driver gives no build log");
    describe_cache_disk(&reason);
    compute_fail(compute, "clBuildProgram", status, "options \"%s\"\n%s\nthe composed text: %s", options,
                 text_c(&reason), path);
    text_free(&reason);
    free(path);
    free(log);
}

// PoCL has a cache of its own, with the options in its key: an option never used before makes it build.
static void append_unused_option(Text *options)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    text_appendf(options, " -D GLINT_BUILD=%jd%09ld%d", (intmax_t)now.tv_sec, now.tv_nsec, (int)getpid());
}

// NULL: failed; unless `afresh`, a failed build is no failure of the Compute yet.
static cl_program build_from_source(Compute *compute, const char *text, const char *options, bool afresh)
{
    cl_int status;
    fault_note_call("clCreateProgramWithSource");
    cl_program program = clCreateProgramWithSource(compute->context, 1, &text, NULL, &status);
    if (!compute_check_object(compute, program, status, "clCreateProgramWithSource")) return NULL;
    Text all_options = {0};
    text_appendf(&all_options, "%s", options);
    if (afresh) append_unused_option(&all_options);
    fault_note_call("clBuildProgram");
    status = clBuildProgram(program, 1, &compute->device->id, text_c(&all_options), NULL, NULL);
    fault_note_call(NULL);
    text_free(&all_options);
    if (status == CL_SUCCESS) return program;
    if (afresh) build_fail(compute, program, status, text, options);
    clReleaseProgram(program);
    return NULL;
}

// Processes that build the same program at once can fail in PoCL's cache (3.1: one removes the file that
// another reads), so a build counts as failed only if it fails outside that cache, too.
static cl_program build_with_retry(Compute *compute, const char *text, const char *options)
{
    cl_program program = build_from_source(compute, text, options, false);
    return program || !compute_ok(compute) ? program : build_from_source(compute, text, options, true);
}

// NULL if the driver refuses the binary.
static cl_program build_from_binary(const Compute *compute, const Text *binary, const char *options)
{
    const unsigned char *bytes = (const unsigned char *)text_c(binary);
    cl_int binary_status, status;
    fault_note_call("clCreateProgramWithBinary");
    cl_program program = clCreateProgramWithBinary(compute->context, 1, &compute->device->id, &binary->count,
                                                   &bytes, &binary_status, &status);
    if (status != CL_SUCCESS || !program) return NULL;
    fault_note_call("clBuildProgram");
    status = clBuildProgram(program, 1, &compute->device->id, options, NULL, NULL);
    fault_note_call(NULL);
    if (status == CL_SUCCESS) return program;
    clReleaseProgram(program);
    return NULL;
}

bool program_build(Compute *compute, const ProgramRequest *request, Program *program)
{
    *program = (Program){0};
    if (!compute_ok(compute)) return false;
    double start = clock_seconds();
    const char *options = or_empty(request->options);
    char *text = program_text(request->root, or_empty(request->prelude));
    program->text_hash = hash_bytes(HASH_START, text, strlen(text));
    if (request->no_cache) {
        program->program = build_from_source(compute, text, options, true);
    } else {
        char *key = request_key(compute, request, text);
        Text binary = {0};
        if (cache_load(key, &binary)) program->program = build_from_binary(compute, &binary, options);
        program->from_cache = program->program != NULL;
        if (!program->from_cache) program->program = build_with_retry(compute, text, options);
        text_free(&binary);
        free(key);
    }
    free(text);
    program->build_seconds = clock_seconds() - start;
    return compute_ok(compute);
}

cl_kernel program_kernel(Compute *compute, const Program *program, const char *name)
{
    if (!compute_ok(compute)) return NULL;
    cl_int status;
    fault_note_call("clCreateKernel");
    cl_kernel kernel = clCreateKernel(program->program, name, &status);
    compute_check_object(compute, kernel, status, "clCreateKernel");
    return kernel;
}

static bool program_query(const Program *program, cl_program_info what, size_t size, void *value)
{
    fault_note_call("clGetProgramInfo");
    cl_int status = clGetProgramInfo(program->program, what, size, value, NULL);
    fault_note_call(NULL);
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
    char *text = program_text(request->root, or_empty(request->prelude)),
         *key = request_key(compute, request, text);
    Text binary = {.items = bytes, .count = size, .capacity = size};
    cache_store(key, &binary);
    text_free(&binary);
    free(key);
    free(text);
}

void program_close(Program *program)
{
    if (program->program) clReleaseProgram(program->program);
    *program = (Program){0};
}
