// Measures how fast one variant renders one scene, by the times of repeated runs and the figures that follow
// from them.
#pragma once

#include "host/measure/comparison.h"
#include "host/measure/series.h"
#include "host/render/renderer.h"
#include <stdbool.h>
#include <stdint.h>

// A number, or the reason why it is unavailable.
typedef struct {
    double value;
    const char *why_not; // NULL if there is a value
} Figure;

// Times of the runs of one variant. All zeros means no runs.
typedef struct {
    Series frame;       // seconds from a run's first enqueue until the host has read its last band
    Series processor;   // seconds of all processors that this process used during the run
    Series event, host; // seconds of a run's launches, by their events and by the host's clock
    // Why the host's clock times the launches, or NULL if their events do. Every event then agreed with the
    // host's clock, and the device's clock did not drift from it over all runs.
    const char *clock_fault;
    double run_event, run_host; // sums over the current run
    // Extremes over the launches so far of the device's clock minus the host's, if the device's ran 1%
    // faster or slower.
    double least_fast_start, greatest_slow_end;
} BenchTimes;

// Adds a launch to the current run. bench_end_run is then called once per run.
void bench_add_launch(BenchTimes *times, const LaunchTime *launch);
void bench_end_run(BenchTimes *times, double frame_seconds, double processor_seconds);
void bench_times_free(BenchTimes *times);
#define OwnedBenchTimes __attribute__((cleanup(bench_times_free))) BenchTimes

// Returns the summary of the runs' launch times, by the host's clock if the events have a fault.
Summary bench_kernel(const BenchTimes *times);
// Returns whether the times have converged, so that there are at least `enough` runs and the interquartile
// range is small.
bool bench_converged(const BenchTimes *times, size_t enough);

// Compares the last runs with the first (comparison_of_ends), which detects throttled devices. Uses the
// processor time of a CPU device, else the launches' time.
Comparison bench_drift(const BenchTimes *times, bool is_cpu, size_t row_count);

// The energy of a row's frames, rendered one after another.
typedef struct {
    const char *source;     // what measured it; NULL if it was not measured
    const char *why_not;    // why it was not measured
    double joules, seconds; // per frame
} BenchEnergy;

// Identifies a row. The scene is known by its path and by the hash of all files it was read from; rows of
// different reports match by the hash.
typedef struct {
    const char *scene, *precision, *bvh;
    const char *variant; // the options of --variant, or NULL
    uint32_t lanes, width, height, samples, bounces;
    uint64_t scene_hash;
} BenchKey;

extern const char *const bench_ray_names[RAYS_COUNT];

typedef struct {
    BenchKey key;
    char *failure; // why only the key is set, or NULL
    BenchTimes times;
    uint64_t kernel_hash;
    Figure build_cold, build_cached; // seconds
    BenchEnergy energy;
    uint64_t rays[RAYS_COUNT];
    bool traverses_bvh;
} BenchRow;

void bench_row_free(BenchRow *row);

// Returns the number of rays of all types per second of the launches.
double bench_rays_per_second(const BenchRow *row);
