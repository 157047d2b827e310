#include "host/mpi/messages.h"

#include "host/base/memory.h"
#include "host/cli/interrupts.h"
#include "host/cli/open_device.h"
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static BandRows rows_acquire(void *has_ended, uint32_t rows_max, uint32_t step)
{
    (void)has_ended;
    const Request request = {rows_max, step};
    BandRows rows;
    send_bytes(&request, sizeof request, 0, TAG_REQUEST);
    receive_bytes(&rows, sizeof rows, 0, TAG_ROWS);
    return rows;
}

static bool band_send(void *has_ended, const Film *band)
{
    const FilmHeader header = film_header(band);
    send_bytes(&header, sizeof header, 0, TAG_BAND);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (band->layers[layer]) send_bytes(band->layers[layer], film_layer_size(band, layer), 0, TAG_LAYERS);
    return !end_poll(has_ended);
}

// The state of this rank's renderer.
typedef struct {
    size_t local_rank;
    OpenDevice device;  // zeroed while no device is open
    Renderer *renderer; // NULL if it cannot render, for a reason in `messages` or the device
    MessageList messages;
    Rank self;
} RankRenderer;

static void device_close_quietly(RankRenderer *worker)
{
    renderer_close(worker->renderer);
    worker->renderer = NULL;
    compute_close(&worker->device.compute);
    device_list_close(&worker->device.devices);
}

// Prepares for another image. Reopens a device that failed.
static void worker_begin(RankRenderer *worker, const Job *job, const char *selector,
                         const char *reference_selector)
{
    Rank *self = &worker->self;
    *self = (Rank){0};
    gethostname(self->host, sizeof self->host - 1);
    Compute *compute = &worker->device.compute;
    if (!compute_ok(compute)) device_close_quietly(worker);
    if (!compute->device) {
        device_list_open(&worker->device.devices, &device_warnings);
        const Device *device =
            device_choose_numbered(&worker->device.devices, selector, worker->local_rank, &worker->messages);
        if (!device) {
            snprintf(self->failure, sizeof self->failure, "%s", message_first_error(&worker->messages));
            device_list_close(&worker->device.devices);
            return;
        }
        compute_open(compute, device);
    }
    if (job->settings.precision == PRECISION_CERTIFIED &&
        !reference_open(compute, &worker->device.devices, reference_selector)) {
        snprintf(self->failure, sizeof self->failure, "no suitable reference device");
        device_close_quietly(worker);
        return;
    }
    worker->renderer = renderer_open_empty(compute, &job->settings, worker->renderer, &worker->messages);
    rank_set_devices(self, compute->device, compute->reference ? compute->reference->device : NULL);
    for (PixelPass pass = PASS_ALL; pass < PASS_COUNT; pass++)
        self->lanes[pass] = renderer_lanes(worker->renderer, pass);
}

// Receives a scene. All ranks of its variant take part, even those that can no longer render.
static void scene_receive(RankRenderer *worker, SceneVariant variant)
{
    CompiledScene compiled;
    const bool needs_scene = worker->self.lanes[variant.pass] == variant.lanes;
    scene_broadcast(&compiled, needs_scene);
    if (!needs_scene) return;
    if (!worker->renderer) {
        compiled_scene_free(&compiled);
    } else if (!renderer_receive_scene(worker->renderer, variant.pass, &compiled, &worker->messages)) {
        renderer_close(worker->renderer);
        worker->renderer = NULL;
    }
}

// Renders until the first rank has no more rows, and sends the reason if the device failed. Waits for
// TAG_END, which would otherwise end the next job.
static void worker_render(RankRenderer *worker, unsigned aovs)
{
    char failure[sizeof worker->self.failure];
    bool has_ended = false;
    const BandQueue queue = {
        .acquire = rows_acquire, .deliver = band_send, .has_ended = end_poll, .context = &has_ended};
    const Compute *compute = &worker->device.compute;
    if (worker->renderer) renderer_work(worker->renderer, aovs, &queue);
    snprintf(failure, sizeof failure, "%s", message_first_error(&worker->messages));
    if (failure[0] == '\0' && !compute_ok(compute)) {
        OWNED char *text = compute_failure_text(compute);
        snprintf(failure, sizeof failure, "%s", text);
    }
    send_bytes(failure, sizeof failure, 0, TAG_DONE);
    end_await(&has_ended);
}

// Returns the text of this size that the first rank broadcasts, or NULL if the size is 0.
static char *selector_receive(size_t size)
{
    char *selector = size > 0 ? memory_allocate(size, 1) : NULL;
    broadcast(selector, size, MPI_COMM_WORLD);
    return selector;
}

static void job_run(RankRenderer *worker, const Job *job)
{
    Order order;
    OWNED char *selector = selector_receive(job->device_selector_size);
    OWNED char *reference_selector = selector_receive(job->reference_selector_size);
    worker_begin(worker, job, selector, reference_selector);
    MPI_Gather(&worker->self, sizeof worker->self, MPI_BYTE, NULL, 0, MPI_BYTE, 0, MPI_COMM_WORLD);
    while (broadcast(&order, sizeof order, MPI_COMM_WORLD), order.type == ORDER_SCENE)
        scene_receive(worker, order.variant);
    if (order.type == ORDER_START) worker_render(worker, job->aovs);
    renderer_release_scene(worker->renderer);
    message_list_free(&worker->messages);
}

void other_rank_run(size_t local_rank, int argument_count, char **arguments)
{
    interrupts_ignore(); // signals reach every rank, but only the first rank acts on them
    RankRenderer worker = {.local_rank = local_rank};
    Job job;
    while (broadcast(&job, sizeof job, MPI_COMM_WORLD), job.type != JOB_END) {
        if (job.type == JOB_FRAMES)
            frames_work(local_rank, argument_count, arguments);
        else
            job_run(&worker, &job);
    }
    device_close_quietly(&worker);
}
