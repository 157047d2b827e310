// Hands out the rows of an image in bands to workers that render them, such as devices, each in a separate
// thread. The bands reach the sink in order from the top, no matter which worker renders them. A worker that
// fails is dropped, and its rows are handed to others.
//
// The size of a band follows its worker's measured pace. Bands shrink towards the end so that all workers end
// at the same time. A worker's first band has one step of rows.
#pragma once

#include "host/render/checkpoint.h"
#include "host/render/film.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Receives a band, whose layers are valid until the sink returns. A sink that returns false ends the render.
typedef bool (*BandSink)(void *context, const Film *band);

// Hands out rows to one worker and receives their bands. The functions have the contracts of
// scheduler_acquire, scheduler_deliver and scheduler_has_ended.
typedef struct {
    BandRows (*acquire)(void *context, uint32_t rows_max, uint32_t step);
    BandSink deliver;
    bool (*has_ended)(void *context); // may be NULL
    void *context;
} BandQueue;

typedef struct {
    uint32_t row_count;
    size_t worker_count;
    BandSink sink; // called by the workers' threads, for one band at a time in order from the top
    // Called by a worker's thread when the worker was dropped and others continue, never while the sink runs;
    // may be NULL.
    void (*dropped)(void *context, size_t worker);
    void *context;          // passed to both
    Checkpoint *checkpoint; // provides finished bands and receives all others; may be NULL
    // The approximate limit for bands that wait for one above them. 0 means 16 MiB per worker, at least 64
    // MiB.
    size_t waiting_bytes_max;
} SchedulerSettings;

// The work that one worker did.
typedef struct {
    uint32_t rows, bands;
    double busy_seconds; // spent rendering bands
    double idle_seconds; // the rest of the time from scheduler_open to the end of the last worker
} WorkerShare;

typedef struct Scheduler Scheduler;

// Opens a scheduler. Passes the checkpoint's bands to the sink up to the first missing row.
Scheduler *scheduler_open(const SchedulerSettings *settings);
// Frees the scheduler. Returns true if all rows reached the sink. Unless it is NULL, `shares` receives each
// worker's share.
bool scheduler_close(Scheduler *scheduler, WorkerShare *shares);

// Returns the next rows for the worker: at most `rows_max`, and a multiple of `step` where possible. Waits
// while all rows are handed out or left to a faster worker, since that worker may yet fail, and while too
// many bands wait for one above them. Returns no rows if the image is complete or the render has ended.
BandRows scheduler_acquire(Scheduler *scheduler, size_t worker, uint32_t rows_max, uint32_t step);
// Delivers the band of the rows that the worker took. Returns false if the render has ended.
bool scheduler_deliver(Scheduler *scheduler, size_t worker, const Film *band);
// Returns the next rows for the worker as scheduler_acquire does, but does not wait. If there are none now,
// *waits tells whether there may be rows later.
BandRows scheduler_try(Scheduler *scheduler, size_t worker, uint32_t rows_max, uint32_t step, bool *waits);
// Hands the worker's rows to others. The worker takes no more rows.
void scheduler_drop(Scheduler *scheduler, size_t worker);
// Ends the render before all rows are done.
void scheduler_end(Scheduler *scheduler);
bool scheduler_has_ended(Scheduler *scheduler);
