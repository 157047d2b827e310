// A job runs a scheduler and one worker per device or machine.
#include "host/base/memory.h"
#include "host/render/renderer_state.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    Renderer *renderer;
    unsigned aovs;
    Scheduler *scheduler;
    size_t number;
    pthread_t thread;
    bool has_thread;
} DeviceWorker;

static BandRows worker_acquire(void *context, uint32_t rows_max, uint32_t step)
{
    const DeviceWorker *worker = context;
    return scheduler_acquire(worker->scheduler, worker->number, rows_max, step);
}

static bool worker_deliver(void *context, const Film *band)
{
    const DeviceWorker *worker = context;
    return scheduler_deliver(worker->scheduler, worker->number, band);
}

static bool worker_has_ended(void *context)
{
    return scheduler_has_ended(((const DeviceWorker *)context)->scheduler);
}

// Renders the queue's rows on a device. Drops a device that failed.
static void *worker_run(void *argument)
{
    DeviceWorker *worker = argument;
    const BandQueue queue = {.acquire = worker_acquire,
                             .deliver = worker_deliver,
                             .has_ended = worker_has_ended,
                             .context = worker};
    bool is_done = renderer_work(worker->renderer, worker->aovs, &queue);
    if (!compute_ok(worker->renderer->compute))
        scheduler_drop(worker->scheduler, worker->number);
    else if (!is_done)
        scheduler_end(worker->scheduler);
    return NULL;
}

// Starts the worker's thread. If that fails, the device counts as failed.
static void thread_start(DeviceWorker *worker)
{
    int error = pthread_create(&worker->thread, NULL, worker_run, worker);
    worker->has_thread = error == 0;
    if (worker->has_thread) return;
    compute_fail(worker->renderer->compute, "pthread_create", CL_OUT_OF_HOST_MEMORY, "%s", strerror(error));
    scheduler_drop(worker->scheduler, worker->number);
}

static void share_set(WorkerShare *share, const WorkerShare *now, bool is_part)
{
    const WorkerShare earlier = is_part ? *share : (WorkerShare){0};
    *share = (WorkerShare){.rows = now->rows,
                           .bands = earlier.bands + now->bands,
                           .busy_seconds = earlier.busy_seconds + now->busy_seconds,
                           .idle_seconds = earlier.idle_seconds + now->idle_seconds};
}

bool render_job_run(const RenderJob *job)
{
    const RemoteWorkers *remote = job->remote;
    const size_t count = job->count, remote_count = remote ? remote->count : 0;
    const SchedulerSettings settings = {.row_count = job->renderers[0]->settings.region_height,
                                        .worker_count = count + remote_count,
                                        .sink = job->sink,
                                        .dropped = job->dropped,
                                        .context = job->context,
                                        .checkpoint = job->checkpoint};
    Scheduler *scheduler = scheduler_open(&settings);
    DeviceWorker *workers = memory_allocate_zeroed(count, sizeof *workers);
    const size_t first_thread = remote ? 0 : 1; // one works in the caller's thread
    for (size_t i = 0; i < count; i++)
        workers[i] = (DeviceWorker){
            .renderer = job->renderers[i], .aovs = job->aovs, .scheduler = scheduler, .number = i};
    for (size_t i = first_thread; i < count; i++)
        thread_start(&workers[i]);
    if (remote)
        remote->serve(remote->context, scheduler, count);
    else
        worker_run(&workers[0]);
    for (size_t i = first_thread; i < count; i++)
        if (workers[i].has_thread) pthread_join(workers[i].thread, NULL);
    free(workers);
    WorkerShare *shares = memory_allocate_zeroed(count + remote_count, sizeof *shares);
    bool whole = scheduler_close(scheduler, shares);
    // the parts of an image add up, whose first sample is 0 only in the first
    const bool is_part = job->renderers[0]->settings.first_sample > 0;
    for (size_t i = 0; i < count; i++)
        share_set(&job->renderers[i]->report.share, &shares[i], is_part);
    for (size_t i = 0; i < remote_count; i++)
        share_set(&remote->shares[i], &shares[count + i], is_part);
    free(shares);
    return whole;
}

bool renderer_render(Renderer *renderer, unsigned aovs, BandSink sink, void *context)
{
    const RenderJob job = {
        .renderers = &renderer, .count = 1, .aovs = aovs, .sink = sink, .context = context};
    return render_job_run(&job) && compute_ok(renderer->compute);
}
