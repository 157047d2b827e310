// A device opened for work: context, queue, programs, buffers, launches and their times. Knows no scenes.
// Every OpenCL status that is not success is a fault (exit 2) that names the call and the symbolic status.
#pragma once

#include "host/opencl/device.h"

// `cl_must(clFinish(queue))`: faults with the call's text and the status' name.
#define cl_must(call) cl_check((call), #call)
void cl_check(cl_int status, const char *call);
const char *cl_status_name(cl_int status);

typedef struct {
    const Device *device; // outlives the Compute
    cl_context context;
    cl_command_queue queue; // in order, profiling on
} Compute;

void compute_open(Compute *compute, const Device *device);
void compute_close(Compute *compute); // and zeroes; accepts a zeroed one

typedef struct {
    const char *root;    // the embedded file to compile, such as "render.cl"
    const char *prelude; // definitions placed before the text (features, LANES, precision)
    const char *options; // compiler flags only
    const char *launch; // which kernel at which work-group size, such as "render 8x1"; may be NULL; see below
    bool no_cache;
} ProgramRequest;

typedef struct {
    cl_program program;
    uint64_t text_hash; // of the composed text, prelude included
    double build_seconds;
    bool from_cache;
} Program;

// Composes the text (each quoted include expanded once, with #line), then takes the program from the cache in
// $XDG_CACHE_HOME/glint (or $HOME/.cache/glint; neither set: no cache) or builds it. The key: text, options,
// launch, device name, driver, platform version and the cache's own format version. Entries carry a checksum
// and their whole key; a damaged one is rebuilt. Written beside and renamed: safe with many processes. A
// cache that cannot be written is not an error. `no_cache` keeps PoCL's own cache out of it, too. A text that
// does not compile is a fault: prints the build log and saves the composed text, named in the message.
void program_build(Compute *compute, const ProgramRequest *request, Program *program);
// Call after the program's first launch has ended: puts the program into the cache, unless it came from
// there. Not earlier: PoCL compiles a kernel at its first launch, its binaries hold what was launched by
// then, and one loaded from a binary hands out that binary for ever (3.1; hence `launch` in the key).
void program_store(Compute *compute, const ProgramRequest *request, const Program *program);
void program_close(Program *program);

// Composes only; for tests and hashes. NULL if `root` or an include is not embedded. Caller frees.
char *program_text(const char *root, const char *prelude);

// A buffer of at least one byte. `bytes` NULL: not initialised. A device that cannot allocate it is a fault
// that says what was asked for and what the device has.
cl_mem buffer_create(Compute *compute, size_t size, const void *bytes, cl_mem_flags flags);

// Memory for a buffer's contents, at least `size` bytes; large contents lie on large pages where the system
// has them, which spares a CPU that reads them at random most of its address translations. Given to
// buffer_take.
void *buffer_bytes_allocate(size_t size);
// A read-only buffer of those bytes, which belong to it from then on: a CPU may read large ones where they
// are, else the device gets a copy. Fails as buffer_create does.
cl_mem buffer_take(Compute *compute, size_t size, void *bytes);

// One command's time as its event says it, beside the host's clock around it.
typedef struct {
    double queued_seconds, start_seconds, end_seconds; // device clock, from an arbitrary moment
    double event_seconds;                              // end - start; 0 where the runtime reports zeros
    double host_seconds;                               // from enqueue to completion seen by the host
    double host_start_seconds;                         // clock_seconds() before the enqueue
    bool trusted; // false: zeros, a mere count, end before start, or event longer than the host saw
} LaunchTime;

// What an event's moments (nanoseconds of the device clock) are worth beside the host's seconds. An event may
// be longer than the host saw by the timer's resolution and 1 %, no more.
LaunchTime launch_time_judge(cl_ulong queued, cl_ulong start, cl_ulong end, double host_seconds,
                             double resolution_seconds);

// Why the event's times are not to be believed, or NULL where they are.
const char *launch_time_doubt(const LaunchTime *time);

// Halves the longest side of a work-group, the last among equals, until it has at most `largest` work-items
// and no side is longer than its own limit.
void work_group_fit(size_t *sides, cl_uint dimensions, size_t largest, const size_t *longest_sides);

// Enqueues over `items` and waits. `group` is the work-group that is wished for: it is made to fit the device
// and the kernel, and the work-items are rounded up to whole groups, so a kernel must not count on either.
// NULL: the runtime's choice, nothing rounded.
LaunchTime kernel_launch(Compute *compute, cl_kernel kernel, cl_uint dimensions, const size_t *items,
                         const size_t *group);
// Waits for the event and reads it; host_start from clock_seconds() before the enqueue. Releases the event.
LaunchTime event_time(cl_event event, double host_start);

// Sets argument `index` or faults.
void kernel_argument(cl_kernel kernel, cl_uint index, size_t size, const void *value);
