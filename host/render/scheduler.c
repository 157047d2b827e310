// Implements guided self-scheduling (Polychronopoulos and Kuck, 1987) with shares by pace. A worker gets at
// most half of its share of the remaining rows, so that the last bands are short. A worker whose pace is
// unknown gets one step, since it may be a thousand times slower than the others. A worker that would end
// after another could have rendered all remaining rows gets nothing more.
//
// The states of a row, with the functions that change them:
//
//     FREE ──scheduler_acquire──▶ ACQUIRED ──scheduler_deliver──▶ FORWARDED ──sink accepts──▶ DELIVERED
//      ▲                            ├────────earlier rows missing─▶ WAITING ──next──▶ FORWARDED
//      └────────scheduler_drop──────┘
//
// The bands of a checkpoint start in WAITING. If the sink rejects a band or the checkpoint fails, all rows
// stay where they are.
//
// These invariants hold whenever the mutex is free:
//
//  1. The first `delivered_rows` rows have reached the sink. Until `has_ended`, each of the others is in
//     `is_free`, in the `rows` of one worker, in `waiting` or in the band that the sink has.
//  2. `is_delivering` is set while the sink has a band, which starts at `delivered_rows`. So bands reach the
//     sink one at a time and in order. The mutex is free meanwhile.
//  3. `free_count` is the number of rows in `is_free`. With a checkpoint, `waiting` bands have no layers.
//  4. A worker that acquires rows has none and is not dropped. A dropped worker has none.
//  5. `has_ended` and `is_dropped` are never cleared.
//  6. A change that may give a waiting worker rows, or end its wait, broadcasts `changed` before the function
//     that makes it returns.
#include "host/render/scheduler.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

// The default limit for bytes of waiting bands, which usually holds one band per worker
// (docs/measurements/README.md).
static const size_t waiting_bytes_min = 64 << 20, waiting_bytes_of_worker = 16 << 20;

typedef struct {
    BandRows rows; // acquired and not yet delivered
    double acquired_seconds;
    double rows_per_second; // in the last band; 0 if unknown
    bool is_dropped;
    WorkerShare share;
} WorkerState;

struct Scheduler {
    SchedulerSettings settings;
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    double start_seconds;
    uint32_t delivered_rows; // to the sink
    bool is_delivering, has_ended;
    WorkerState *workers;
    size_t active_count;    // workers that are not dropped
    bool *is_free;          // whether each row is neither acquired nor rendered
    uint32_t free_count;    // the number of these rows
    ARRAY_OF(Film) waiting; // copies, which have no layers if the checkpoint has them
    size_t row_bytes;       // memory per row of a waiting band; 0 if none or unknown
};

bool scheduler_close(Scheduler *scheduler, WorkerShare *shares)
{
    const double seconds = clock_seconds() - scheduler->start_seconds;
    const bool is_whole = scheduler->delivered_rows == scheduler->settings.row_count;
    for (size_t i = 0; shares && i < scheduler->settings.worker_count; i++) {
        shares[i] = scheduler->workers[i].share;
        shares[i].idle_seconds = fmax(0, seconds - shares[i].busy_seconds);
    }
    for (size_t i = 0; i < scheduler->waiting.count; i++)
        film_free(&scheduler->waiting.items[i]);
    free(scheduler->waiting.items);
    free(scheduler->is_free);
    free(scheduler->workers);
    pthread_cond_destroy(&scheduler->changed);
    pthread_mutex_destroy(&scheduler->mutex);
    free(scheduler);
    return is_whole;
}

// Returns the part of the remaining rows that the worker, whose pace is known, would render if all workers
// ended at the same time. Unknown paces count as the mean of the known ones.
static double share_of(const Scheduler *scheduler, size_t worker)
{
    double sum = 0;
    size_t known = 0;
    for (size_t i = 0; i < scheduler->settings.worker_count; i++) {
        const double pace = scheduler->workers[i].rows_per_second;
        if (scheduler->workers[i].is_dropped) continue;
        known += pace > 0;
        sum += pace;
    }
    const double mean = sum / (double)known;
    return scheduler->workers[worker].rows_per_second / (mean * (double)scheduler->active_count);
}

// Marks rows as free or as not free. All of them must be in the other state.
static void rows_set_free(Scheduler *scheduler, BandRows rows, bool is_free)
{
    memset(scheduler->is_free + rows.first_row, is_free, rows.row_count);
    if (is_free)
        scheduler->free_count += rows.row_count;
    else
        scheduler->free_count -= rows.row_count;
}

// Returns the uppermost free rows, up to the first row that is not free.
static BandRows rows_first(const Scheduler *scheduler)
{
    const bool *first = memchr(scheduler->is_free, true, scheduler->settings.row_count);
    const uint32_t first_row = (uint32_t)(first - scheduler->is_free),
                   left = scheduler->settings.row_count - first_row;
    const bool *end = memchr(first, false, left);
    return (BandRows){first_row, end ? (uint32_t)(end - first) : left};
}

// Returns the row where bands must end for now, so that the waiting ones fit into memory. The uppermost
// missing band always fits, so that the render never blocks.
static uint32_t row_limit(const Scheduler *scheduler)
{
    if (scheduler->row_bytes == 0) return UINT32_MAX;
    return scheduler->delivered_rows +
           (uint32_t)(scheduler->settings.waiting_bytes_max / scheduler->row_bytes);
}

// Returns the seconds until the first of the other workers could have rendered all remaining rows; infinite
// while no pace is known.
static double others_seconds(const Scheduler *scheduler, size_t worker)
{
    double least = INFINITY;
    for (size_t i = 0; i < scheduler->settings.worker_count; i++) {
        const WorkerState *other = &scheduler->workers[i];
        if (i == worker || other->is_dropped || other->rows_per_second <= 0) continue;
        const uint32_t rows = other->rows.row_count + scheduler->free_count;
        least = fmin(least, rows / other->rows_per_second);
    }
    return least;
}

// Returns the largest number of rows for a worker that shares the image with others. The fastest worker
// always gets some.
static uint32_t rows_fair(const Scheduler *scheduler, size_t worker, uint32_t step)
{
    const double pace = scheduler->workers[worker].rows_per_second, left = scheduler->free_count;
    if (pace <= 0) return step;
    if (fmin(step, left) / pace > others_seconds(scheduler, worker)) return 0;
    return (uint32_t)fmax(1, 0.5 * share_of(scheduler, worker) * left / step) * step;
}

// Returns the rows for the worker, beginning at the first free row, of which there must be one. Returns none
// while they are too far down, or if another worker would end sooner.
static BandRows rows_choose(const Scheduler *scheduler, size_t worker, uint32_t rows_max, uint32_t step)
{
    const BandRows first = rows_first(scheduler);
    uint32_t rows = rows_max, limit = row_limit(scheduler);
    if (scheduler->active_count > 1) {
        const uint32_t fair = rows_fair(scheduler, worker, step);
        if (rows > fair) rows = fair;
    }
    if (rows > first.row_count) rows = first.row_count;
    if (first.first_row > scheduler->delivered_rows && first.first_row + rows > limit) rows = 0;
    return (BandRows){first.first_row, rows};
}

static bool rows_are_out(const Scheduler *scheduler)
{
    for (size_t i = 0; i < scheduler->settings.worker_count; i++)
        if (scheduler->workers[i].rows.row_count > 0) return true;
    return false;
}

// Acquires rows if there are any for the worker now. Otherwise *waits tells whether there may be rows later.
static BandRows rows_acquire(Scheduler *scheduler, size_t worker, uint32_t rows_max, uint32_t step,
                             bool *waits)
{
    const bool is_free = scheduler->free_count > 0;
    BandRows rows = {0};
    if (is_free && !scheduler->has_ended) rows = rows_choose(scheduler, worker, rows_max, step);
    *waits = rows.row_count == 0 && !scheduler->has_ended && (is_free || rows_are_out(scheduler));
    if (rows.row_count == 0) return rows;
    rows_set_free(scheduler, rows, false);
    scheduler->workers[worker].rows = rows;
    scheduler->workers[worker].acquired_seconds = clock_seconds();
    return rows;
}

BandRows scheduler_acquire(Scheduler *scheduler, size_t worker, uint32_t rows_max, uint32_t step)
{
    bool waits;
    BandRows rows;
    pthread_mutex_lock(&scheduler->mutex);
    while ((rows = rows_acquire(scheduler, worker, rows_max, step, &waits)).row_count == 0 && waits)
        pthread_cond_wait(&scheduler->changed, &scheduler->mutex);
    pthread_mutex_unlock(&scheduler->mutex);
    return rows;
}

BandRows scheduler_try(Scheduler *scheduler, size_t worker, uint32_t rows_max, uint32_t step, bool *waits)
{
    pthread_mutex_lock(&scheduler->mutex);
    BandRows rows = rows_acquire(scheduler, worker, rows_max, step, waits);
    pthread_mutex_unlock(&scheduler->mutex);
    return rows;
}

// Forwards the next band to the sink. The mutex is not held meanwhile.
static void band_forward(Scheduler *scheduler, const Film *band)
{
    const uint32_t end = band->first_row + band->height;
    scheduler->is_delivering = true;
    pthread_mutex_unlock(&scheduler->mutex);
    bool continues = scheduler->settings.sink(scheduler->settings.context, band);
    pthread_mutex_lock(&scheduler->mutex);
    scheduler->is_delivering = false;
    if (continues)
        scheduler->delivered_rows = end;
    else
        scheduler->has_ended = true;
}

// Removes the next band from the waiting ones. Returns false if it is not among them.
static bool waiting_acquire(Scheduler *scheduler, Film *band)
{
    for (size_t i = 0; i < scheduler->waiting.count; i++) {
        if (scheduler->waiting.items[i].first_row != scheduler->delivered_rows) continue;
        *band = scheduler->waiting.items[i];
        scheduler->waiting.items[i] = scheduler->waiting.items[--scheduler->waiting.count];
        return true;
    }
    return false;
}

// Forwards the waiting bands up to the first missing row to the sink, unless another thread is doing so.
static void waiting_forward(Scheduler *scheduler)
{
    Film band;
    while (!scheduler->has_ended && !scheduler->is_delivering && waiting_acquire(scheduler, &band)) {
        Checkpoint *checkpoint = scheduler->settings.checkpoint;
        if (checkpoint && !checkpoint_read(checkpoint, band.first_row, &band))
            scheduler->has_ended = true;
        else
            band_forward(scheduler, &band);
        film_free(&band);
    }
}

// Adds the checkpoint's bands to the waiting ones, as if they had been rendered.
static void checkpoint_resume(Scheduler *scheduler)
{
    size_t count;
    const BandRows *bands = checkpoint_bands(scheduler->settings.checkpoint, &count);
    for (size_t i = 0; i < count; i++) {
        rows_set_free(scheduler, bands[i], false);
        array_push(scheduler->waiting,
                   ((Film){.first_row = bands[i].first_row, .height = bands[i].row_count}));
    }
    waiting_forward(scheduler);
}

Scheduler *scheduler_open(const SchedulerSettings *settings)
{
    Scheduler *scheduler = memory_allocate_zeroed(1, sizeof *scheduler);
    scheduler->settings = *settings;
    if (settings->waiting_bytes_max == 0) {
        const size_t of_workers = settings->worker_count * waiting_bytes_of_worker;
        scheduler->settings.waiting_bytes_max =
            of_workers > waiting_bytes_min ? of_workers : waiting_bytes_min;
    }
    scheduler->start_seconds = clock_seconds();
    scheduler->active_count = settings->worker_count;
    scheduler->workers = memory_allocate_zeroed(settings->worker_count, sizeof *scheduler->workers);
    if (pthread_mutex_init(&scheduler->mutex, NULL) != 0 || pthread_cond_init(&scheduler->changed, NULL) != 0)
        fault("out of memory: mutex");
    scheduler->is_free = memory_allocate(settings->row_count, sizeof *scheduler->is_free);
    rows_set_free(scheduler, (BandRows){0, settings->row_count}, true);
    pthread_mutex_lock(&scheduler->mutex);
    if (settings->checkpoint) checkpoint_resume(scheduler);
    pthread_mutex_unlock(&scheduler->mutex);
    return scheduler;
}

static bool is_next(const Scheduler *scheduler, const Film *band)
{
    return !scheduler->is_delivering && band->first_row == scheduler->delivered_rows;
}

// Keeps a copy of the band until those above it are complete.
static void band_keep(Scheduler *scheduler, const Film *band)
{
    Film copy = {.first_row = band->first_row, .height = band->height};
    if (!scheduler->settings.checkpoint) {
        scheduler->row_bytes = film_size(band) / band->height;
        pthread_mutex_unlock(&scheduler->mutex);
        copy = film_copy(band);
        pthread_mutex_lock(&scheduler->mutex);
    }
    array_push(scheduler->waiting, copy);
}

static void rows_done(WorkerState *worker)
{
    double seconds = clock_seconds() - worker->acquired_seconds;
    worker->share.rows += worker->rows.row_count;
    worker->share.bands++;
    worker->share.busy_seconds += seconds;
    worker->rows_per_second = worker->rows.row_count / fmax(seconds, 1e-9);
}

bool scheduler_deliver(Scheduler *scheduler, size_t worker, const Film *band)
{
    Checkpoint *checkpoint = scheduler->settings.checkpoint;
    bool is_kept = !checkpoint || checkpoint_append(checkpoint, band);
    pthread_mutex_lock(&scheduler->mutex);
    rows_done(&scheduler->workers[worker]);
    if (!is_kept) scheduler->has_ended = true;
    if (!scheduler->has_ended && is_next(scheduler, band))
        band_forward(scheduler, band);
    else if (!scheduler->has_ended)
        band_keep(scheduler, band);
    scheduler->workers[worker].rows = (BandRows){0};
    waiting_forward(scheduler);
    bool continues = !scheduler->has_ended;
    pthread_cond_broadcast(&scheduler->changed);
    pthread_mutex_unlock(&scheduler->mutex);
    return continues;
}

void scheduler_drop(Scheduler *scheduler, size_t worker)
{
    pthread_mutex_lock(&scheduler->mutex);
    WorkerState *dropped = &scheduler->workers[worker];
    dropped->is_dropped = true;
    rows_set_free(scheduler, dropped->rows, true);
    dropped->rows = (BandRows){0};
    const bool others_continue = --scheduler->active_count > 0;
    while (scheduler->is_delivering)
        pthread_cond_wait(&scheduler->changed, &scheduler->mutex);
    if (others_continue && scheduler->settings.dropped)
        scheduler->settings.dropped(scheduler->settings.context, worker);
    pthread_cond_broadcast(&scheduler->changed);
    pthread_mutex_unlock(&scheduler->mutex);
}

void scheduler_end(Scheduler *scheduler)
{
    pthread_mutex_lock(&scheduler->mutex);
    scheduler->has_ended = true;
    pthread_cond_broadcast(&scheduler->changed);
    pthread_mutex_unlock(&scheduler->mutex);
}

bool scheduler_has_ended(Scheduler *scheduler)
{
    pthread_mutex_lock(&scheduler->mutex);
    bool has_ended = scheduler->has_ended;
    pthread_mutex_unlock(&scheduler->mutex);
    return has_ended;
}
