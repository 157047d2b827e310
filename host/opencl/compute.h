// Opens a device and handles its context, queue, programs, buffers, launches and their times. Knows no
// scenes.
//
// `failure` keeps the first OpenCL call that fails, as stdio keeps a stream's error. From then on every
// function with a Compute argument enqueues and creates nothing and returns NULL, zeros or false, so that a
// sequence of calls needs one check, compute_ok. Existing objects are released as usual. A release never
// fails, since no result depends on it. A failed Compute is closed, not repaired. Others are not affected.
#pragma once

#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/text.h"
#include "host/opencl/device.h"

typedef struct {
    char call[40];   // the OpenCL function or the host's work, empty if nothing failed
    cl_int status;   // CL_SUCCESS means that the call returned NULL, unless is_of_host
    bool is_of_host; // whether the host's work failed, which the detail names
    char *detail;    // more about the failure, such as a build log, or NULL
} ComputeFailure;

// The latest value of a kernel's argument.
typedef struct {
    cl_kernel kernel;
    cl_uint index;
    bool is_buffer;
    Text value;
} CapturedArgument;

typedef struct Compute {
    const Device *device; // outlives the Compute
    cl_context context;
    cl_command_queue queue;              // in order, profiling on
    ComputeFailure failure;              // the first
    ComputeFailure unmap_failure;        // the first of an unmap, which the next launch makes the Compute's
    struct Compute *reference;           // another device for work in double, or NULL if this one does it
    ARRAY_OF(CapturedArgument) captured; // empty unless the device has a capture folder
} Compute;

// Opens the device. Returns false on failure. compute_close closes it in either case.
bool compute_open(Compute *compute, const Device *device);
void compute_close(Compute *compute); // closes and zeroes; accepts a zeroed one

// Opens the device as the Compute's reference, which compute_close closes.
bool compute_open_reference(Compute *compute, const Device *device);
// Returns the Compute that does this one's work in double.
static inline Compute *compute_in_double(Compute *compute)
{
    return compute->reference ? compute->reference : compute;
}
// Copies a reference's failure to the Compute. Returns compute_ok.
bool compute_check_reference(Compute *compute);

static inline bool compute_ok(const Compute *compute)
{
    return compute->failure.call[0] == '\0';
}

// Makes a call, as in `compute_try(compute, clFinish(compute->queue))`, unless an earlier one failed. The
// result is false if either failed.
#define compute_try(compute, call)                                                                           \
    (compute_ok(compute) ? (fault_record_call(#call), compute_check((compute), (call), #call)) : false)
// Records a call's failure if it is the first. The function's name is `call` up to a parenthesis. Returns
// compute_ok.
bool compute_check(Compute *compute, cl_int status, const char *call);
// Records the failure of a call that returns an object, where NULL is a failure even with CL_SUCCESS.
bool compute_check_object(Compute *compute, const void *object, cl_int status, const char *call);
void compute_fail(Compute *compute, const char *call, cl_int status, const char *detail, ...)
    __attribute__((format(printf, 4, 5)));
// Unmaps a buffer, unless `mapped` is NULL. A failed unmap is reported at the next launch.
void compute_unmap(Compute *compute, cl_mem buffer, const void *mapped);
// Returns "CALL: STATUS (CODE) on DEVICE: detail" after a failure. The caller frees it.
char *compute_failure_text(const Compute *compute);
// Returns the text of a failed unmap with no launch after it, or NULL if there is none. The caller frees it.
char *compute_unmap_failure_text(const Compute *compute);

typedef struct {
    const char *root;    // the embedded file to compile, such as "render.cl"
    const char *prelude; // definitions placed before the text (features, LANES, precision)
    // Definitions that keep functions out of line, for a second build if the first fails, or NULL for none.
    const char *out_of_line_prelude;
    const char *kernel;  // the build fails if it cannot be created; NULL creates none
    const char *options; // compiler flags only
    const char *launch;  // replaces --work-group in the cache's key of a passport; NULL for other programs
    bool no_cache;
} ProgramRequest;

typedef struct {
    cl_program program;
    cl_kernel kernel;    // the request's, or NULL if there is none
    uint64_t text_hash;  // of the composed text, prelude included
    bool is_out_of_line; // built with the out-of-line prelude
    double build_seconds;
    bool from_cache;
} Program;

// Appends the options of a request, then those of --build-options.
void program_options_append(Text *text, const Device *device, const char *options);

// Composes the text (each quoted include expanded once, with #line), then loads the program from the cache
// (host/opencl/cache.h) or builds it. The key consists of the text, the options, the launch (or --work-group
// if it is NULL), the device's name, the driver, the platform's version and the version of the cache's
// format. `no_cache` also bypasses PoCL's cache. Returns false on failure. If the text does not compile, the
// detail has the build log and the file in which the composed text was saved. If both builds fail, the first
// failure is kept.
bool program_build(Compute *compute, const ProgramRequest *request, Program *program);
// Writes the program to the cache unless it came from there. Call it after the kernel's first launch has
// ended, because PoCL compiles a kernel at its first launch, a binary holds only the kernels launched by
// then, and a program loaded from it always returns that same binary (3.1).
void program_store(Compute *compute, const ProgramRequest *request, const Program *program);
void program_close(Program *program);

// Returns the key of the cache for a request's program. The caller frees it.
char *program_key(const Device *device, const ProgramRequest *request);

// Returns the text of a request's program. The caller frees it.
char *program_request_text(const ProgramRequest *request, bool is_out_of_line);

// Creates a buffer of at least one byte, uninitialized if `bytes` is NULL. Returns NULL on failure, with a
// detail that compares the size with the device's memory. buffer_release releases it.
cl_mem buffer_create(Compute *compute, size_t size, const void *bytes, cl_mem_flags flags);
void buffer_release(cl_mem buffer); // accepts NULL
// Copy the first `size` bytes and wait. On failure buffer_read leaves `bytes` undefined.
bool buffer_read(Compute *compute, cl_mem buffer, size_t size, void *bytes);
bool buffer_write(Compute *compute, cl_mem buffer, size_t size, const void *bytes);

// Maps `size` bytes of a buffer from `begin` on, at least one, for writing new contents. Returns NULL if the
// device failed. compute_unmap transfers the contents.
void *buffer_map(Compute *compute, cl_mem buffer, size_t begin, size_t size);

// Creates a read-only buffer of bytes from memory_allocate_large and takes ownership of them, even on
// failure. A CPU may read large contents in place; other devices use a copy. Returns NULL on failure.
cl_mem buffer_adopt(Compute *compute, size_t size, void *bytes);

// The time of a command by its event and by the host's clock.
typedef struct {
    const Device *device; // its clock, which starts at an arbitrary moment, has the next four times
    double queued_seconds, submitted_seconds, start_seconds, end_seconds; // 0 if the runtime has none
    double event_seconds;       // end - start; 0 where the runtime reports zeros
    double host_seconds;        // from enqueue until the host sees it complete
    double host_start_seconds;  // clock_seconds() before the enqueue
    const char *fault;          // why the event's times are not trusted, or NULL if they are
    cl_uint dimensions;         // 0 if the command is not a kernel
    size_t global[3], local[3]; // work-items, and those of a group, which are 0 if the runtime chose
} LaunchTime;

// Compares an event's timestamps (nanoseconds of the device clock) with the host's seconds. The event's time
// may exceed the host's by the timer's resolution and 1 %.
LaunchTime launch_time_classify(cl_ulong start, cl_ulong end, double host_seconds, double resolution_seconds);

// Halves the longest side of a work-group, the last among equals, until it has at most `largest` work-items
// and no side exceeds its limit.
void work_group_fit(size_t *sides, cl_uint dimensions, size_t largest, const size_t *longest_sides);

// Launches the kernel over `items`, with global ids from `first` on, or from 0 if `first` is NULL, and waits.
// Returns a time of 0 with a fault on failure. Reduces `group`, the preferred work-group, to fit the device
// and the kernel, and rounds the work-items up to whole groups, so a kernel must not rely on either. If
// `group` is NULL, the runtime chooses and nothing is rounded.
LaunchTime kernel_launch(Compute *compute, cl_kernel kernel, cl_uint dimensions, const size_t *first,
                         const size_t *items, const size_t *group);
// Waits for the event of `command`, the OpenCL function that enqueued it, reads and releases it. `host_start`
// is clock_seconds() before the enqueue. Returns a time of 0 with a fault on failure.
LaunchTime event_time(Compute *compute, cl_event event, const char *command, double host_start);

// Set argument `index` to a value or a buffer, which may be NULL, with the kernel's name in the detail of a
// failure.
void kernel_argument(Compute *compute, cl_kernel kernel, cl_uint index, size_t size, const void *value);
void kernel_buffer(Compute *compute, cl_kernel kernel, cl_uint index, cl_mem buffer);
