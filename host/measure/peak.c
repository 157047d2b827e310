#include "host/measure/peak.h"

#include "host/base/clock.h"
#include "host/base/text.h"

static const double launch_seconds_wanted = 0.03, total_seconds = 0.3;

enum { FLOPS_OF_ROUND = 2 * 8 }; // of one lane: an fma in each of eight chains
enum { COPY_BYTES_MAX = 128 << 20, COPY_BYTES_OF_ITEM = 16 };

static double launch_seconds(Peak *peak, const LaunchTime *time)
{
    peak->by_events &= time->trusted;
    return time->trusted ? time->event_seconds : time->host_seconds;
}

// The best of several launches, each long enough that its overhead is negligible.
static void arithmetic_measure(Peak *peak, Compute *compute, cl_kernel kernel, uint32_t lanes, bool is_double)
{
    const Device *device = compute->device;
    // what a compute unit runs concurrently: one work-item on a CPU
    size_t group = device->type == CL_DEVICE_TYPE_CPU ? 1 : 64;
    size_t items = device->compute_units * group * 64;
    size_t scalar_size = is_double ? sizeof(double) : sizeof(float);
    cl_mem results = buffer_create(compute, items * scalar_size, NULL, CL_MEM_WRITE_ONLY);
    // converges to a fixed point of 1, so that no chain overflows or becomes subnormal
    const double factor = 0.5, addend = 0.5;
    const float factor_single = 0.5F, addend_single = 0.5F;
    kernel_argument(compute, kernel, 1, scalar_size, is_double ? (const void *)&factor : &factor_single);
    kernel_argument(compute, kernel, 2, scalar_size, is_double ? (const void *)&addend : &addend_single);
    kernel_argument(compute, kernel, 3, sizeof(cl_mem), &results);
    cl_uint rounds = 256;
    double best = 0, start = clock_seconds();
    while (compute_ok(compute) && clock_seconds() - start < total_seconds) {
        kernel_argument(compute, kernel, 0, sizeof rounds, &rounds);
        LaunchTime time = kernel_launch(compute, kernel, 1, &items, &group);
        double seconds = launch_seconds(peak, &time);
        double rate = (double)items * lanes * rounds * FLOPS_OF_ROUND / seconds;
        if (rate > best) best = rate;
        if (seconds < launch_seconds_wanted && rounds < 1u << 28) rounds *= 2;
    }
    peak->flops_per_second[is_double] = best;
    buffer_release(results);
}

// A limit of 0 is unknown.
static uint64_t limited(uint64_t size, uint64_t limit)
{
    return limit > 0 && size > limit ? limit : size;
}

static void copy_measure(Peak *peak, Compute *compute, cl_kernel kernel)
{
    const Device *device = compute->device;
    uint64_t size =
        limited(limited(COPY_BYTES_MAX, device->largest_buffer_bytes / 4), device->memory_bytes / 16);
    size_t items = (size_t)size / COPY_BYTES_OF_ITEM, bytes = items * COPY_BYTES_OF_ITEM;
    cl_mem buffers[2];
    for (cl_uint i = 0; i < 2; i++)
        buffers[i] = buffer_create(compute, bytes, NULL, CL_MEM_READ_WRITE);
    double best = 0, start = clock_seconds();
    // back and forth, so that both buffers have been written before a copy is measured
    for (cl_uint turn = 0; compute_ok(compute) && (turn < 3 || clock_seconds() - start < total_seconds);
         turn++) {
        kernel_argument(compute, kernel, 0, sizeof(cl_mem), &buffers[turn % 2]);
        kernel_argument(compute, kernel, 1, sizeof(cl_mem), &buffers[1 - turn % 2]);
        LaunchTime time = kernel_launch(compute, kernel, 1, &items, NULL);
        double rate = 2 * (double)bytes / launch_seconds(peak, &time);
        if (turn >= 2 && rate > best) best = rate;
    }
    peak->bytes_per_second = best;
    for (cl_uint i = 0; i < 2; i++)
        buffer_release(buffers[i]);
}

// At the device's own width, whatever the renderer's.
static void program_measure(Peak *peak, Compute *compute, bool is_double)
{
    uint32_t lanes = device_lanes(compute->device, is_double);
    Text prelude = {0};
    text_appendf(&prelude, "#define LANES %u\n#define IS_DOUBLE %d\n", lanes, is_double);
    ProgramRequest request = {.root = "peak.cl", .prelude = text_c(&prelude), .options = "-cl-std=CL1.2"};
    Program program;
    program_build(compute, &request, &program);
    cl_kernel arithmetic = program_kernel(compute, &program, "arithmetic"),
              copy = program_kernel(compute, &program, "copy");
    arithmetic_measure(peak, compute, arithmetic, lanes, is_double);
    if (!is_double) copy_measure(peak, compute, copy);
    program_store(compute, &request, &program);
    if (arithmetic) clReleaseKernel(arithmetic);
    if (copy) clReleaseKernel(copy);
    program_close(&program);
    text_free(&prelude);
}

void peak_measure(Peak *peak, Compute *compute, bool with_double)
{
    *peak = (Peak){.by_events = true};
    program_measure(peak, compute, false);
    if (with_double) program_measure(peak, compute, true);
}
