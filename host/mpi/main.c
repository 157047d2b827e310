// glint-mpi: glint render on the devices of an MPI job, one for each rank. The first rank reads the scene,
// sends the compiled arrays to the others, hands out rows and writes the image; its own device renders in a
// thread. The others need neither the scene's files nor the output's folder.
//
// All ranks must be of one architecture and run the same program.
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/cli/options.h"
#include "host/cli/progress.h"
#include "host/cli/ranks.h"
#include "host/import/mesh/foreign.h"
#include <errno.h>
#include <mpi.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

// Messages between the first rank and another.
enum {
    TAG_TAKE, // a Request
    TAG_ROWS, // BandRows, the answer; no rows: the end
    TAG_BAND, // a FilmHeader, followed by the layers with the next tag
    TAG_LAYERS,
    TAG_END,  // to a rank that renders: the render has ended
    TAG_DONE, // the last one of a rank: why its device failed, or an empty text
};

typedef struct {
    uint32_t rows_max, step;
} Request;

// What every rank gets first.
typedef struct {
    bool is_there;
    RenderSettings settings;
    unsigned aovs;
    size_t light_count, selector_size; // the selector's with its NUL; 0: none
} Job;

// MPI waits by polling: this leaves the processor to the device.
static void rest(void)
{
    nanosleep(&(struct timespec){.tv_nsec = 200000}, NULL);
}

static void broadcast(void *bytes, size_t size, MPI_Comm ranks)
{
    const size_t most = 1 << 30; // a count is an int
    for (size_t done = 0; done < size; done += most)
        MPI_Bcast((char *)bytes + done, (int)(size - done < most ? size - done : most), MPI_BYTE, 0, ranks);
}

static void send_bytes(const void *bytes, size_t size, int rank, int tag)
{
    MPI_Send(bytes, (int)size, MPI_BYTE, rank, tag, MPI_COMM_WORLD);
}

static void receive_bytes(void *bytes, size_t size, int rank, int tag)
{
    MPI_Recv(bytes, (int)size, MPI_BYTE, rank, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
}

static bool has_message(int rank, int tag, MPI_Status *status)
{
    int is_there;
    MPI_Iprobe(rank, tag, MPI_COMM_WORLD, &is_there, status);
    return is_there;
}

// Sends a compiled scene from the first rank of `ranks` to the others, which allocate its arrays.
static void compiled_broadcast(CompiledScene *compiled, bool is_sender, MPI_Comm ranks)
{
    broadcast(compiled, sizeof *compiled, ranks);
    if (!is_sender) compiled->textures = NULL; // only a renderer that moves reads them
    for (size_t kind = 0; kind < FLAT_COUNT; kind++) {
        FlatArray *array = &compiled->arrays[kind];
        const size_t size = array->count * array->layout.size;
        if (!is_sender) array->items = aligned_alloc(64, (size + 127) / 64 * 64);
        if (!array->items) fault("out of memory for %zu bytes of the scene", size);
        broadcast(array->items, size, ranks);
    }
}

// The ranks that render with that many lanes, and the first rank; MPI_COMM_NULL for the others. All call it.
static MPI_Comm ranks_of_lanes(int rank, uint32_t own, uint32_t lanes)
{
    MPI_Comm ranks;
    MPI_Comm_split(MPI_COMM_WORLD, rank == 0 || own == lanes ? 0 : MPI_UNDEFINED, rank, &ranks);
    return ranks;
}

// The first rank's side.

static Rank rank_of_message(const Rank *received)
{
    Rank rank = *received;
    rank.device[sizeof rank.device - 1] = rank.driver[sizeof rank.driver - 1] = '\0';
    rank.host[sizeof rank.host - 1] = rank.failure[sizeof rank.failure - 1] = '\0';
    return rank;
}

static bool ranks_begin(Ranks *ranks, const Scene *scene, const RenderSettings *settings, unsigned aovs,
                        const char *device_selector, MessageList *messages)
{
    Job job = {.is_there = true,
               .settings = *settings,
               .aovs = aovs,
               .light_count = scene->lights.count,
               .selector_size = device_selector ? strlen(device_selector) + 1 : 0};
    job.settings.stop = NULL;
    broadcast(&job, sizeof job, MPI_COMM_WORLD);
    broadcast((void *)(uintptr_t)device_selector, job.selector_size, MPI_COMM_WORLD);
    Rank *all = memory_allocate_zeroed(ranks->count + 1, sizeof *all);
    MPI_Gather(MPI_IN_PLACE, 0, MPI_BYTE, all, sizeof *all, MPI_BYTE, 0, MPI_COMM_WORLD);
    for (size_t i = 0; i < ranks->count; i++)
        ranks->items[i] = rank_of_message(&all[i + 1]);
    free(all);
    bool all_fit = true;
    for (size_t i = 0; i < ranks->count; i++) {
        const Rank *rank = &ranks->items[i];
        if (rank->failure[0] == '\0') continue;
        message_add(messages, MESSAGE_ERROR, "rank %zu on %s: %s", i + 1, rank->host, rank->failure);
        all_fit = false;
    }
    if (!all_fit) broadcast(&all_fit, sizeof all_fit, MPI_COMM_WORLD); // can_start of ranks_go_on
    return all_fit;
}

static void ranks_go_on(const Scene *scene, const RenderSettings *settings, bool can_start,
                        MessageList *messages)
{
    RenderSettings of_lanes = *settings;
    broadcast(&can_start, sizeof can_start, MPI_COMM_WORLD);
    for (size_t i = 0; i < LANES_CHOICE_COUNT && can_start; i++) {
        MPI_Comm receivers = ranks_of_lanes(0, 0, lanes_choice_values[i]);
        int size;
        MPI_Comm_size(receivers, &size);
        if (size > 1) {
            CompiledScene compiled;
            of_lanes.lanes = lanes_choice_values[i];
            // this rank's renderer has compiled it for its own lanes: no error is left
            if (!renderer_compile(&compiled, scene, &of_lanes, messages)) fault("the scene does not compile");
            compiled_broadcast(&compiled, true, receivers);
            compiled_scene_free(&compiled);
        }
        MPI_Comm_free(&receivers);
    }
}

typedef struct {
    Request request;
    BandRows rows; // handed out, and not received yet
    Film band;     // of them, while its layers arrive; of no height: its header has not arrived
    Layer next_layer;
    bool wants_rows, end_sent, is_rejected, is_done;
} RankState;

// Receives the message of a status, which must have that size; else discards it and returns false.
static bool receive_checked(void *bytes, size_t size, const MPI_Status *status)
{
    int count;
    MPI_Get_count(status, MPI_BYTE, &count);
    const bool fits = (size_t)count == size;
    void *discarded = fits ? NULL : memory_allocate((size_t)count + 1, 1);
    MPI_Recv(fits ? bytes : discarded, count, MPI_BYTE, status->MPI_SOURCE, status->MPI_TAG, MPI_COMM_WORLD,
             MPI_STATUS_IGNORE);
    free(discarded);
    return fits;
}

// False also for a rank that still owes rows, or an answer to whose last request it did not wait for.
static bool request_receive(RankState *state, const MPI_Status *status)
{
    const bool is_due = !state->wants_rows && state->rows.row_count == 0;
    state->wants_rows = true;
    return receive_checked(&state->request, sizeof state->request, status) && is_due &&
           state->request.rows_max > 0 && state->request.step > 0;
}

// Gives the scheduler the band once it has all layers.
static void layers_await(RankState *state, Scheduler *scheduler, size_t worker)
{
    while (state->next_layer < LAYER_COUNT && !state->band.layers[state->next_layer])
        state->next_layer++;
    if (state->next_layer < LAYER_COUNT) return;
    state->rows = (BandRows){0};
    scheduler_give(scheduler, worker, &state->band);
    film_free(&state->band);
}

// False: it is not the band of the rows that the rank was given.
static bool header_receive(const Ranks *ranks, RankState *state, const MPI_Status *status)
{
    FilmHeader header;
    if (!receive_checked(&header, sizeof header, status) || state->band.height > 0 ||
        !film_header_fits(&header, &ranks->film) || header.first_row != state->rows.first_row ||
        header.row_count != state->rows.row_count)
        return false;
    state->band = film_of_header(&header);
    state->next_layer = 0;
    return true;
}

// Its layers are messages like any other: a rank that sends none keeps nobody waiting.
static bool layer_receive(RankState *state, const MPI_Status *status)
{
    void *layer = state->band.height > 0 ? state->band.layers[state->next_layer] : NULL;
    const size_t size = layer ? film_layer_size(&state->band, state->next_layer) : SIZE_MAX;
    const bool is_right = receive_checked(layer, size, status);
    state->next_layer += is_right;
    return is_right;
}

// The others render the rows of a rank that cannot.
static void rank_drop(const Ranks *ranks, Scheduler *scheduler, size_t worker, int rank, const char *why)
{
    fprintf(stderr, "glint: warning: rank %d on %s: %s\n", rank, ranks->items[rank - 1].host, why);
    scheduler_drop(scheduler, worker);
}

static void message_receive(const Ranks *ranks, RankState *states, Scheduler *scheduler, size_t first_worker,
                            const MPI_Status *status)
{
    const int rank = status->MPI_SOURCE;
    const size_t index = (size_t)rank - 1, worker = first_worker + index;
    RankState *state = &states[index];
    char failure[sizeof ranks->items->failure];
    bool is_right = false;
    if (status->MPI_TAG == TAG_TAKE) {
        is_right = request_receive(state, status);
    } else if (status->MPI_TAG == TAG_BAND && !state->is_rejected) {
        is_right = header_receive(ranks, state, status);
        if (is_right) layers_await(state, scheduler, worker);
    } else if (status->MPI_TAG == TAG_LAYERS && !state->is_rejected) {
        is_right = layer_receive(state, status);
        if (is_right) layers_await(state, scheduler, worker);
    } else if (status->MPI_TAG == TAG_DONE) {
        const bool owes_rows = state->rows.row_count > 0 && !scheduler_has_ended(scheduler);
        is_right = receive_checked(failure, sizeof failure, status);
        failure[sizeof failure - 1] = '\0';
        state->is_done = true;
        if (is_right && failure[0] != '\0' && !state->is_rejected)
            rank_drop(ranks, scheduler, worker, rank, failure);
        else
            is_right &= !owes_rows;
    } else {
        receive_checked(NULL, SIZE_MAX, status);
    }
    if (is_right || state->is_rejected) return;
    state->is_rejected = true;
    rank_drop(ranks, scheduler, worker, rank,
              "it sent what is not a band of its rows; the others go on without it");
}

// Answers a rank that wants rows, and reports the end to each once. False: there is nothing to do.
static bool rank_answer(RankState *state, Scheduler *scheduler, size_t worker, int rank)
{
    if (state->wants_rows && !state->is_done) {
        bool waits = false;
        BandRows rows = {0};
        if (!state->is_rejected)
            rows = scheduler_try(scheduler, worker, state->request.rows_max, state->request.step, &waits);
        if (rows.row_count == 0 && waits) return false;
        send_bytes(&rows, sizeof rows, rank, TAG_ROWS);
        state->rows = rows;
        state->wants_rows = false;
        return true;
    }
    if (state->end_sent || !(state->is_done || scheduler_has_ended(scheduler))) return false;
    send_bytes(NULL, 0, rank, TAG_END);
    state->end_sent = true;
    return true;
}

static void ranks_serve(void *context, Scheduler *scheduler, size_t first_worker)
{
    const Ranks *ranks = context;
    RankState *states = memory_allocate_zeroed(ranks->count, sizeof *states);
    for (size_t done_count = 0; done_count < ranks->count;) {
        MPI_Status status;
        bool is_busy = has_message(MPI_ANY_SOURCE, MPI_ANY_TAG, &status);
        if (is_busy) message_receive(ranks, states, scheduler, first_worker, &status);
        if (progress_interrupted()) scheduler_end(scheduler);
        done_count = 0;
        for (size_t i = 0; i < ranks->count; i++) {
            is_busy |= rank_answer(&states[i], scheduler, first_worker + i, (int)i + 1);
            done_count += states[i].is_done && states[i].end_sent;
        }
        if (!is_busy) rest();
    }
    for (size_t i = 0; i < ranks->count; i++)
        film_free(&states[i].band);
    free(states);
}

// Another rank's side.

static bool has_ended(void *ended)
{
    bool *end_received = ended;
    MPI_Status status;
    if (!*end_received && has_message(0, TAG_END, &status)) {
        receive_bytes(NULL, 0, 0, TAG_END);
        *end_received = true;
    }
    return *end_received;
}

static BandRows rows_take(void *ended, uint32_t rows_max, uint32_t step)
{
    const Request request = {rows_max, step};
    send_bytes(&request, sizeof request, 0, TAG_TAKE);
    MPI_Status status;
    while (!has_message(0, TAG_ROWS, &status)) {
        has_ended(ended);
        rest();
    }
    BandRows rows;
    receive_bytes(&rows, sizeof rows, 0, TAG_ROWS);
    return rows;
}

static bool band_give(void *ended, const Film *band)
{
    const FilmHeader header = film_header(band);
    send_bytes(&header, sizeof header, 0, TAG_BAND);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (band->layers[layer]) send_bytes(band->layers[layer], film_layer_size(band, layer), 0, TAG_LAYERS);
    return !has_ended(ended);
}

static Rank rank_describe(const Device *device, const RenderSettings *settings)
{
    Rank rank = {.lanes = settings->lanes ? settings->lanes
                                          : device_lanes(device, settings->precision == PRECISION_DOUBLE)};
    snprintf(rank.device, sizeof rank.device, "%s", device->name);
    snprintf(rank.driver, sizeof rank.driver, "%s, %s", device->platform_name, device->driver);
    return rank;
}

// Renders until the first rank has no more rows. `failure` says why the device could not. Before the next job
// it waits for this one's end, which would end that.
static void rank_render(Compute *compute, CompiledScene *compiled, const Job *job, char *failure, size_t size)
{
    MessageList messages = {0};
    Renderer *renderer =
        renderer_open_compiled(compute, compiled, job->light_count, &job->settings, &messages);
    bool end_received = false;
    const BandQueue queue = {
        .take = rows_take, .give = band_give, .has_ended = has_ended, .context = &end_received};
    if (renderer) renderer_work(renderer, job->aovs, &queue);
    if (messages.count > 0)
        snprintf(failure, size, "%s", messages.items[0].text);
    else if (!compute_ok(compute)) {
        char *text = compute_failure_text(compute);
        snprintf(failure, size, "%s", text);
        free(text);
    }
    message_list_free(&messages);
    renderer_close(renderer);
    send_bytes(failure, size, 0, TAG_DONE);
    if (!end_received) receive_bytes(NULL, 0, 0, TAG_END);
}

// An interrupt reaches all ranks: the first one ends the render, and the job.
static void signals_ignore(void)
{
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++)
        signal(signals[i], SIG_IGN);
}

static void job_run(const Job *job, int rank, size_t local_rank)
{
    char *selector = memory_allocate_zeroed(job->selector_size + 1, 1);
    broadcast(selector, job->selector_size, MPI_COMM_WORLD);
    OpenDevices devices;
    MessageList messages = {0};
    Rank own = {0};
    bool is_open =
        devices_open_one(&devices, job->selector_size > 0 ? selector : NULL, local_rank, &messages);
    if (is_open)
        own = rank_describe(devices.items[0].compute.device, &job->settings);
    else
        snprintf(own.failure, sizeof own.failure, "%s", messages.items[0].text);
    gethostname(own.host, sizeof own.host - 1);
    MPI_Gather(&own, sizeof own, MPI_BYTE, NULL, 0, MPI_BYTE, 0, MPI_COMM_WORLD);
    bool can_start;
    broadcast(&can_start, sizeof can_start, MPI_COMM_WORLD);
    CompiledScene compiled = {0};
    for (size_t i = 0; i < LANES_CHOICE_COUNT && can_start; i++) {
        MPI_Comm ranks = ranks_of_lanes(rank, own.lanes, lanes_choice_values[i]);
        if (ranks == MPI_COMM_NULL) continue;
        compiled_broadcast(&compiled, false, ranks);
        MPI_Comm_free(&ranks);
    }
    if (can_start) {
        Job own_job = *job;
        own_job.settings.lanes = own.lanes;
        rank_render(&devices.items[0].compute, &compiled, &own_job, own.failure, sizeof own.failure);
    }
    message_list_free(&messages);
    if (is_open) devices_abandon(&devices);
    free(selector);
}

static void rank_run(int rank, size_t local_rank)
{
    signals_ignore();
    Job job;
    for (;;) {
        broadcast(&job, sizeof job, MPI_COMM_WORLD);
        if (!job.is_there) return;
        job_run(&job, rank, local_rank);
    }
}

static int first_rank_run(Ranks *ranks, int argument_count, char **arguments)
{
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);
    progress_catch_signals();
    fault_catch_crashes();
    int status = EXIT_USER;
    if (argument_count < 2 || strcmp(arguments[1], "render") != 0) {
        fprintf(stderr, "usage: mpirun -n RANKS glint-mpi render SCENE... [OPTIONS]\n"
                        "The options are those of glint render; each rank renders on a device of its own.\n");
    } else {
        char name[] = "glint-mpi render"; // which getopt's messages begin with
        arguments[1] = name;
        status = command_render_on(ranks, argument_count - 1, arguments + 1);
    }
    Job none = {.is_there = false};
    broadcast(&none, sizeof none, MPI_COMM_WORLD);
    if (fflush(stdout) == 0 && !ferror(stdout)) return status;
    fprintf(stderr, "glint: cannot write the standard output: %s\n", strerror(errno));
    return EXIT_MACHINE;
}

int main(int argument_count, char **arguments)
{
    const int child_status = foreign_child_main(argument_count, arguments);
    if (child_status >= 0) return child_status;
    int level, rank, size, local_rank, status = EXIT_DONE;
    MPI_Comm local;
    MPI_Init_thread(&argument_count, &arguments, MPI_THREAD_FUNNELED, &level);
    if (level < MPI_THREAD_FUNNELED) fault("this MPI cannot be used by a program with threads");
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank, MPI_INFO_NULL, &local);
    MPI_Comm_rank(local, &local_rank);
    if (rank == 0) {
        const size_t count = (size_t)size - 1;
        Ranks ranks = {.count = count,
                       .items = memory_allocate_zeroed(count, sizeof *ranks.items),
                       .shares = memory_allocate_zeroed(count, sizeof *ranks.shares),
                       .begin = ranks_begin,
                       .go_on = ranks_go_on,
                       .serve = ranks_serve};
        status = first_rank_run(&ranks, argument_count, arguments);
        free(ranks.items);
        free(ranks.shares);
    } else {
        rank_run(rank, (size_t)local_rank);
    }
    MPI_Finalize();
    return status;
}
