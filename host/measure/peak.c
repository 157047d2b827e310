#include "host/measure/peak.h"

#include "host/base/clock.h"
#include "host/base/text.h"
#include <math.h>

static const double launch_seconds_wanted = 0.03;
static const double window_seconds = 0.1, seconds_max = 1;
static const double stable_ratio = 1.03;

enum { FLOPS_OF_ROUND = 2 * 8 }; // of one lane: an fma in each of eight chains
enum { COPY_BYTES_MAX = 128 << 20, COPY_BYTES_OF_ITEM = 16 };
void peak_windows_add(PeakWindows *windows, double rate)
{
    windows->count++;
    for (size_t i = 0; i < PEAK_WINDOWS_NEEDED; i++)
        if (rate > windows->best[i]) {
            double lower = windows->best[i];
            windows->best[i] = rate;
            rate = lower;
        }
}

bool peak_windows_stable(const PeakWindows *windows)
{
    return windows->count >= PEAK_WINDOWS_NEEDED &&
           windows->best[0] <= stable_ratio * windows->best[PEAK_WINDOWS_NEEDED - 1];
}

// The rate of one launch.
typedef double (*RateFunction)(Peak *peak, Compute *compute, void *context);

// The best of many launches, until windows of time repeat it or the peak's time is up.
static double rate_measure(Peak *peak, Compute *compute, RateFunction launch, void *context)
{
    PeakWindows windows = {0};
    double start = clock_seconds();
    while (compute_ok(compute) && !peak_windows_stable(&windows) && clock_seconds() - start < peak->seconds) {
        double best = 0, window_start = clock_seconds();
        do {
            double rate = launch(peak, compute, context);
            if (rate > best) best = rate;
        } while (compute_ok(compute) && clock_seconds() - window_start < window_seconds);
        peak_windows_add(&windows, best);
    }
    peak->is_stable &= peak_windows_stable(&windows);
    return windows.best[0];
}

static double launch_seconds(Peak *peak, const LaunchTime *time)
{
    peak->by_events &= time->trusted;
    return time->trusted ? time->event_seconds : time->host_seconds;
}

// The program at the device's own width, whatever the renderer's, and its arithmetic.
typedef struct {
    ProgramRequest request;
    Text prelude;
    Program program;
    cl_kernel kernel;
    cl_mem results;
    size_t items, group;
    uint32_t lanes;
    cl_uint rounds;
} Arithmetic;

static void arithmetic_open(Arithmetic *arithmetic, Compute *compute, bool is_double)
{
    const Device *device = compute->device;
    *arithmetic = (Arithmetic){.lanes = device_lanes(device, is_double), .rounds = 256};
    text_appendf(&arithmetic->prelude, "#define LANES %u\n#define IS_DOUBLE %d\n", arithmetic->lanes,
                 is_double);
    arithmetic->request = (ProgramRequest){
        .root = "peak.cl", .prelude = text_c(&arithmetic->prelude), .options = "-cl-std=CL1.2"};
    program_build(compute, &arithmetic->request, &arithmetic->program);
    arithmetic->kernel = program_kernel(compute, &arithmetic->program, "arithmetic");
    // what a compute unit runs concurrently: one work-item on a CPU
    arithmetic->group = device->type == CL_DEVICE_TYPE_CPU ? 1 : 64;
    arithmetic->items = device->compute_units * arithmetic->group * 64;
    size_t scalar_size = is_double ? sizeof(double) : sizeof(float);
    arithmetic->results = buffer_create(compute, arithmetic->items * scalar_size, NULL, CL_MEM_WRITE_ONLY);
    // converges to a fixed point of 1, so that no chain overflows or becomes subnormal
    const double factor = 0.5, addend = 0.5;
    const float factor_single = 0.5F, addend_single = 0.5F;
    kernel_argument(compute, arithmetic->kernel, 1, scalar_size,
                    is_double ? (const void *)&factor : &factor_single);
    kernel_argument(compute, arithmetic->kernel, 2, scalar_size,
                    is_double ? (const void *)&addend : &addend_single);
    kernel_argument(compute, arithmetic->kernel, 3, sizeof(cl_mem), &arithmetic->results);
}

static void arithmetic_close(Arithmetic *arithmetic, Compute *compute)
{
    program_store(compute, &arithmetic->request, &arithmetic->program);
    if (arithmetic->kernel) clReleaseKernel(arithmetic->kernel);
    buffer_release(arithmetic->results);
    program_close(&arithmetic->program);
    text_free(&arithmetic->prelude);
}

// Each launch is long enough that its overhead is negligible.
static double arithmetic_rate(Peak *peak, Compute *compute, void *context)
{
    Arithmetic *arithmetic = context;
    kernel_argument(compute, arithmetic->kernel, 0, sizeof arithmetic->rounds, &arithmetic->rounds);
    LaunchTime time = kernel_launch(compute, arithmetic->kernel, 1, &arithmetic->items, &arithmetic->group);
    double seconds = launch_seconds(peak, &time);
    double flops = (double)arithmetic->items * arithmetic->lanes * arithmetic->rounds * FLOPS_OF_ROUND;
    if (seconds < launch_seconds_wanted && arithmetic->rounds < 1u << 28) arithmetic->rounds *= 2;
    return flops / seconds;
}

typedef struct {
    cl_kernel kernel;
    cl_mem buffers[2];
    size_t items;
    cl_uint turn;
} Copy;

// Back and forth.
static double copy_rate(Peak *peak, Compute *compute, void *context)
{
    Copy *copy = context;
    kernel_argument(compute, copy->kernel, 0, sizeof(cl_mem), &copy->buffers[copy->turn % 2]);
    kernel_argument(compute, copy->kernel, 1, sizeof(cl_mem), &copy->buffers[1 - copy->turn % 2]);
    copy->turn++;
    LaunchTime time = kernel_launch(compute, copy->kernel, 1, &copy->items, NULL);
    return 2 * (double)copy->items * COPY_BYTES_OF_ITEM / launch_seconds(peak, &time);
}

// A limit of 0 is unknown.
static uint64_t limited(uint64_t size, uint64_t limit)
{
    return limit > 0 && size > limit ? limit : size;
}

static void copy_measure(Peak *peak, Compute *compute, const Program *program)
{
    const Device *device = compute->device;
    uint64_t size =
        limited(limited(COPY_BYTES_MAX, device->largest_buffer_bytes / 4), device->memory_bytes / 16);
    Copy copy = {.kernel = program_kernel(compute, program, "copy"),
                 .items = (size_t)size / COPY_BYTES_OF_ITEM};
    for (cl_uint i = 0; i < 2; i++)
        copy.buffers[i] = buffer_create(compute, copy.items * COPY_BYTES_OF_ITEM, NULL, CL_MEM_READ_WRITE);
    // both buffers have been written before a copy is measured
    for (cl_uint i = 0; i < 2; i++)
        copy_rate(peak, compute, &copy);
    peak->bytes_per_second = rate_measure(peak, compute, copy_rate, &copy);
    for (cl_uint i = 0; i < 2; i++)
        buffer_release(copy.buffers[i]);
    if (copy.kernel) clReleaseKernel(copy.kernel);
}

void peak_measure(Peak *peak, Compute *compute, bool with_double, double seconds)
{
    *peak = (Peak){.by_events = true, .is_stable = true, .seconds = fmin(seconds, seconds_max)};
    for (int is_double = 0; is_double < (with_double ? 2 : 1); is_double++) {
        Arithmetic arithmetic;
        arithmetic_open(&arithmetic, compute, is_double);
        peak->flops_per_second[is_double] = rate_measure(peak, compute, arithmetic_rate, &arithmetic);
        if (!is_double) copy_measure(peak, compute, &arithmetic.program);
        arithmetic_close(&arithmetic, compute);
    }
}
