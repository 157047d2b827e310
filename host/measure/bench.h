// How fast one variant renders one scene: times of repeated runs, and what follows from them.
#pragma once

#include "host/measure/series.h"
#include "host/render/renderer.h"
#include <stdbool.h>
#include <stdint.h>

// A number, or why it is unavailable.
typedef struct {
    double value;
    const char *why_not; // NULL: there is a value
} Figure;

// Times of the runs of one variant; zeroed: none yet.
typedef struct {
    Series frame;       // seconds from a run's first enqueue until the host has read its last band
    Series processor;   // seconds of all processors that this process used meanwhile
    Series event, host; // seconds of a run's launches, by their events and by the host's clock
    const char *doubt;  // why the events are not to be believed, as seen in some launch; NULL: they are
    double run_event, run_host; // sums of the run at work
    // over the launches so far, of the device's clock less the host's, were the device's 1 % faster or slower
    double least_fast_start, greatest_slow_end;
} BenchTimes;

// For each launch of a run, then once for the run.
void bench_add_launch(BenchTimes *times, const LaunchTime *launch);
void bench_end_run(BenchTimes *times, double frame_seconds, double processor_seconds);
void bench_times_free(BenchTimes *times);

// Why the host's clock is used for the launches, or NULL where their events' times are: every event agreed
// with the host's clock, and the device's clock did not drift from it over all the runs.
const char *bench_doubt(const BenchTimes *times);
// Of the runs' launches, by events or by the host's clock as bench_doubt says.
Summary bench_kernel(const BenchTimes *times);
// Whether the times have converged: at least `enough` runs, and a small interquartile range.
bool bench_converged(const BenchTimes *times, size_t enough);

// Identifies a row. The scene is its path, and the hash of all files it was read from, by which rows of
// reports match.
typedef struct {
    const char *scene, *precision, *bvh;
    uint32_t lanes, width, height, samples, bounces;
    uint64_t scene_hash;
} BenchKey;

extern const char *const bench_ray_names[RAYS_COUNT];

typedef struct {
    BenchKey key;
    char *failure; // why there is nothing but the key; NULL: there is
    BenchTimes times;
    uint64_t kernel_hash;
    Figure build_cold, build_cached; // seconds
    uint64_t rays[RAYS_COUNT];
    bool traverses_bvh;
} BenchRow;

void bench_row_free(BenchRow *row);

// Rays of every kind for each second of the launches.
double bench_rays_per_second(const BenchRow *row);
