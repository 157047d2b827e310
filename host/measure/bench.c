#include "host/measure/bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const bench_ray_names[RAYS_COUNT] = {"camera", "camera_hits", "reflected", "refracted", "shadow"};

static const double converged_spread = 0.02, largest_drift = 0.01;
// The error in seconds of a double that holds the nanoseconds since 1970, which a timestamp may count.
static const double timestamp_error = 1e-6;

// Returns whether the device's clock runs faster or slower than the host's by more than largest_drift. Both
// ends of a command lie within the host's wait for it, however long the host is stalled. So the time from the
// start of a command to the end of a later one is at most the time from the start of the first wait to the
// end of the second, and the time from the end of a command to the start of a later one is at least the time
// between the waits.
static bool clock_drifts(BenchTimes *times, const LaunchTime *launch)
{
    const double fast = 1 + largest_drift, slow = 1 - largest_drift;
    const double host_start = launch->host_start_seconds, host_end = host_start + launch->host_seconds;
    const double resolution = launch->device ? launch->device->timer_resolution_seconds : 0;
    const double slack = timestamp_error + 2 * resolution;
    const bool is_first = times->run_host == 0 && times->host.count == 0;
    const bool drifts =
        !is_first && (launch->end_seconds - fast * host_end > times->least_fast_start + slack ||
                      launch->start_seconds - slow * host_start < times->greatest_slow_end - slack);
    const double fast_start = launch->start_seconds - fast * host_start;
    const double slow_end = launch->end_seconds - slow * host_end;
    times->least_fast_start = is_first ? fast_start : fmin(times->least_fast_start, fast_start);
    times->greatest_slow_end = is_first ? slow_end : fmax(times->greatest_slow_end, slow_end);
    return drifts;
}

void bench_add_launch(BenchTimes *times, const LaunchTime *launch)
{
    if (!times->clock_fault) {
        if (launch->fault)
            times->clock_fault = launch->fault;
        else if (clock_drifts(times, launch))
            times->clock_fault = "the device's clock drifts from the host's by more than 1%";
    }
    times->run_event += launch->event_seconds;
    times->run_host += launch->host_seconds;
}

void bench_end_run(BenchTimes *times, double frame_seconds, double processor_seconds)
{
    series_add(&times->frame, frame_seconds);
    series_add(&times->processor, processor_seconds);
    series_add(&times->event, times->run_event);
    series_add(&times->host, times->run_host);
    times->run_event = times->run_host = 0;
}

void bench_times_free(BenchTimes *times)
{
    series_free(&times->frame);
    series_free(&times->processor);
    series_free(&times->event);
    series_free(&times->host);
}

Summary bench_kernel(const BenchTimes *times)
{
    return series_summarize(times->clock_fault ? &times->host : &times->event);
}

static bool is_narrow(const Summary *seconds)
{
    return seconds->upper_quartile - seconds->lower_quartile <= converged_spread * seconds->median;
}

bool bench_converged(const BenchTimes *times, size_t enough)
{
    if (times->frame.count < enough) return false;
    Summary kernel = bench_kernel(times), frame = series_summarize(&times->frame);
    return is_narrow(&kernel) && is_narrow(&frame);
}

static const double drift_tolerance = 1.05;

Comparison bench_drift(const BenchTimes *times, bool is_cpu, size_t row_count)
{
    const Series *all = is_cpu ? &times->processor : times->clock_fault ? &times->host : &times->event;
    return comparison_of_ends(all, row_count, drift_tolerance);
}

void bench_row_free(BenchRow *row)
{
    bench_times_free(&row->times);
    free(row->failure);
}

double bench_rays_per_second(const BenchRow *row)
{
    uint64_t sum = 0;
    for (int type = 0; type < RAYS_COUNT; type++)
        if (type != RAYS_CAMERA_HITS) sum += row->rays[type]; // these are camera rays
    return (double)sum / bench_kernel(&row->times).median;
}
