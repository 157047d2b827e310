// The rows of an image, handed out in bands to workers that render them, such as devices, each in a thread of
// its own. The bands reach the sink in order from the top, whoever renders them. A worker that fails is
// dropped, and its rows go to the others.
//
// Bands are sized by each worker's measured pace, and shrink towards the end so that all workers end
// together. A worker's first band is a step.
#pragma once

#include "host/render/checkpoint.h"
#include "host/render/film.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Called for each band from the top, whose layers are valid until it returns; returns false to stop.
typedef bool (*BandSink)(void *context, const Film *band, double fraction_done);
// Called when a worker was dropped while others go on.
typedef void (*WorkerDropped)(void *context, size_t worker);

typedef struct {
    uint32_t row_count;
    size_t worker_count;
    BandSink sink;            // called by the workers' threads, one at a time
    WorkerDropped dropped;    // likewise, never while the sink runs; NULL: not called
    void *context;            // of both
    Checkpoint *checkpoint;   // has the bands that are done, and gets all others; NULL: none
    size_t waiting_bytes_max; // of bands that wait for one above them, about; 0: 16 MiB per worker, at least
                              // 64 MiB
} SchedulerSettings;

// What a worker did.
typedef struct {
    uint32_t rows, bands;
    double busy_seconds; // rendering bands
    double idle_seconds; // the rest of the time from scheduler_open to the end of the last worker
} WorkerShare;

typedef struct Scheduler Scheduler;

// Passes the checkpoint's bands to the sink, as far as none is missing above them.
Scheduler *scheduler_open(const SchedulerSettings *settings);
// Frees; true: all rows reached the sink. `shares`, of each worker, may be NULL.
bool scheduler_close(Scheduler *scheduler, WorkerShare *shares);

// The next rows for the worker: at most `rows_max`, and a multiple of `step` where possible. Waits where all
// are handed out or left to a faster worker, since that may yet fail, or while too many bands wait for one
// above them. No rows: the image is complete, or the render has ended.
BandRows scheduler_take(Scheduler *scheduler, size_t worker, uint32_t rows_max, uint32_t step);
// The band of the rows that the worker took. False: the render has ended.
bool scheduler_give(Scheduler *scheduler, size_t worker, const Film *band);
// As scheduler_take, but does not wait: *waits says that there may be rows later.
BandRows scheduler_try(Scheduler *scheduler, size_t worker, uint32_t rows_max, uint32_t step, bool *waits);
// Returns the worker's rows; it takes no more.
void scheduler_drop(Scheduler *scheduler, size_t worker);
// Ends the render before all rows are done.
void scheduler_end(Scheduler *scheduler);
bool scheduler_has_ended(Scheduler *scheduler);
