// Renderers share the compiled scene of their variant. A job runs a scheduler and one worker per device or
// machine.
#include "host/render/render_job.h"

#include "host/base/memory.h"
#include "host/compile/compile.h"
#include "host/render/renderer_state.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

// Finds the passes of a variant. Closes the renderers on whose devices the scene does not fit.
static size_t receivers_find(Pass **receivers, const RendererSet *set, SceneVariant variant,
                             const CompiledScene *compiled)
{
    size_t count = 0;
    for (size_t i = 0; i < set->count; i++) {
        Renderer **renderer = &set->renderers[i];
        if (renderer_lanes(*renderer, variant.pass) != variant.lanes) continue;
        receivers[count] = &(*renderer)->passes[variant.pass];
        if (device_scene_fits(&receivers[count]->scene, compiled, &set->messages[i])) {
            count++;
        } else {
            renderer_close(*renderer);
            *renderer = NULL;
        }
    }
    return count;
}

static bool variant_is_needed(SceneVariant variant, const RendererSet *set, const RemoteWorkers *remote)
{
    bool is_needed = remote && remote->needs_scene(remote->context, variant);
    for (size_t i = 0; i < set->count; i++)
        is_needed = is_needed || renderer_lanes(set->renderers[i], variant.pass) == variant.lanes;
    return is_needed;
}

// Compiles the scene for each variant that is needed. Returns false with a message if the scene cannot be
// compiled.
static bool variants_compile(const RendererSet *set, const Scene *scene, const RenderSettings *settings,
                             const RemoteWorkers *remote, MessageList *messages)
{
    OWNED Pass **receivers = memory_allocate(set->count, sizeof *receivers);
    for (PixelPass pass = PASS_ALL; pass < PASS_COUNT; pass++)
        for (uint32_t lanes = 1; lanes <= LANES_MAX; lanes *= 2) {
            const SceneVariant variant = {pass, lanes};
            if (!variant_is_needed(variant, set, remote)) continue;
            const CompileSettings compiling = settings_of_variant(settings, variant);
            CompiledScene compiled;
            if (!scene_compile(&compiled, scene, &compiling, messages)) return false;
            if (remote) remote->send_scene(remote->context, variant, &compiled);
            const size_t count = receivers_find(receivers, set, variant, &compiled);
            if (count > 0)
                passes_receive_scene(receivers, count, &compiled);
            else
                compiled_scene_free(&compiled);
        }
    return true;
}

bool renderers_open(const RendererSet *set, const Scene *scene, const RenderSettings *settings,
                    const RemoteWorkers *remote, MessageList *messages)
{
    RenderSettings shared = *settings;
    shared.moves = settings->moves && set->count == 1; // several share the arrays, and none keeps them
    for (size_t i = 0; i < set->count; i++)
        set->renderers[i] =
            renderer_open_empty(set->computes[i], &shared, set->renderers[i], &set->messages[i]);
    const bool compiles = variants_compile(set, scene, &shared, remote, messages);
    for (size_t i = 0; i < set->count; i++) {
        if (compiles && compute_check_reference(set->computes[i])) continue;
        renderer_close(set->renderers[i]);
        set->renderers[i] = NULL;
    }
    return compiles;
}

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
    if (!compute_ok(worker->renderer->passes[PASS_ALL].compute))
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
    compute_fail(worker->renderer->passes[PASS_ALL].compute, "pthread_create", CL_OUT_OF_HOST_MEMORY, "%s",
                 strerror(error));
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
    const SchedulerSettings settings = {.row_count =
                                            job->renderers[0]->passes[PASS_ALL].settings.region_height,
                                        .worker_count = count + remote_count,
                                        .sink = job->sink,
                                        .dropped = job->dropped,
                                        .context = job->context,
                                        .checkpoint = job->checkpoint};
    Scheduler *scheduler = scheduler_open(&settings);
    OWNED DeviceWorker *workers = memory_allocate_zeroed(count, sizeof *workers);
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
    OWNED WorkerShare *shares = memory_allocate_zeroed(count + remote_count, sizeof *shares);
    const bool whole = scheduler_close(scheduler, shares);
    // the parts of an image add up, whose first sample is 0 only in the first
    const bool is_part = job->renderers[0]->passes[PASS_ALL].settings.first_sample > 0;
    for (size_t i = 0; i < count; i++)
        share_set(&job->renderers[i]->report.share, &shares[i], is_part);
    for (size_t i = 0; i < remote_count; i++)
        share_set(&remote->shares[i], &shares[count + i], is_part);
    return whole;
}
