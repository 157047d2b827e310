#include "host/measure/bench.h"

#include <math.h>
#include <stdlib.h>

const char *const bench_ray_names[RAYS_COUNT] = {"camera", "camera_hits", "reflected", "refracted", "shadow"};

static const double converged_spread = 0.02, largest_drift = 0.01;
// Over a shorter time the wait before a launch would pass for a drift.
static const double drift_seconds = 1;

void bench_add_launch(BenchTimes *times, const LaunchTime *launch)
{
    times->run_event += launch->event_seconds;
    times->run_host += launch->host_seconds;
    if (!launch->trusted && !times->doubt) times->doubt = launch_time_doubt(launch);
    if (times->host_last == 0) {
        times->device_first = launch->start_seconds;
        times->host_first = launch->host_start_seconds;
    }
    times->device_last = launch->end_seconds;
    times->host_last = launch->host_start_seconds + launch->host_seconds;
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

const char *bench_doubt(const BenchTimes *times)
{
    if (times->doubt) return times->doubt;
    double device = times->device_last - times->device_first, host = times->host_last - times->host_first;
    if (host >= drift_seconds && fabs(device / host - 1) > largest_drift)
        return "the device's clock drifts from the host's by more than 1 %";
    return NULL;
}

Summary bench_kernel(const BenchTimes *times)
{
    return series_summarize(bench_doubt(times) ? &times->host : &times->event);
}

bool bench_converged(const BenchTimes *times, size_t enough)
{
    if (times->frame.count < enough) return false;
    Summary kernel = bench_kernel(times), frame = series_summarize(&times->frame);
    return kernel.quartile_range <= converged_spread * kernel.median &&
           frame.quartile_range <= converged_spread * frame.median;
}

void bench_row_free(BenchRow *row)
{
    bench_times_free(&row->times);
    free(row->failure);
}

double bench_rays_per_second(const BenchRow *row)
{
    uint64_t sum = 0;
    for (int kind = 0; kind < RAYS_COUNT; kind++)
        if (kind != RAYS_CAMERA_HITS) sum += row->rays[kind]; // these are camera rays
    return (double)sum / bench_kernel(&row->times).median;
}
