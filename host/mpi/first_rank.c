#include "host/mpi/messages.h"

#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/cli/interrupts.h"
#include "host/cli/options.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void ranks_start(bool can_start)
{
    Order order = {.type = can_start ? ORDER_START : ORDER_CANCEL};
    broadcast(&order, sizeof order, MPI_COMM_WORLD);
}

static size_t text_size_of(const char *text)
{
    return text ? strlen(text) + 1 : 0;
}

static bool ranks_begin(Ranks *ranks, const RenderSettings *settings, unsigned aovs,
                        const char *device_selector, const char *reference_selector, MessageList *messages)
{
    Job job = {.type = JOB_IMAGE,
               .settings = *settings,
               .aovs = aovs,
               .device_selector_size = text_size_of(device_selector),
               .reference_selector_size = text_size_of(reference_selector)};
    // the others show no progress, stop when they receive TAG_END, and neither hash nor keep the scene
    job.settings.stop = NULL;
    job.settings.stop_context = NULL;
    job.settings.stage = NULL;
    job.settings.hashes_scene = job.settings.moves = false;
    broadcast(&job, sizeof job, MPI_COMM_WORLD);
    broadcast((void *)(uintptr_t)device_selector, job.device_selector_size, MPI_COMM_WORLD);
    broadcast((void *)(uintptr_t)reference_selector, job.reference_selector_size, MPI_COMM_WORLD);
    OWNED Rank *all = memory_allocate_zeroed(ranks->remote.count + 1, sizeof *all);
    MPI_Gather(MPI_IN_PLACE, 0, MPI_BYTE, all, sizeof *all, MPI_BYTE, 0, MPI_COMM_WORLD);
    memcpy(ranks->items, all + 1, ranks->remote.count * sizeof *all);
    bool all_fit = true;
    for (size_t i = 0; i < ranks->remote.count; i++) {
        const Rank *rank = &ranks->items[i];
        if (rank->failure[0] == '\0') continue;
        message_error(messages, "rank %zu on %s: %s", i + 1, rank->host, rank->failure);
        all_fit = false;
    }
    if (!all_fit) ranks_start(false);
    return all_fit;
}

static bool ranks_need(void *context, SceneVariant variant)
{
    const Ranks *ranks = context;
    for (size_t i = 0; i < ranks->remote.count; i++)
        if (ranks->items[i].lanes[variant.pass] == variant.lanes) return true;
    return false;
}

static void scene_send(void *context, SceneVariant variant, const CompiledScene *compiled)
{
    (void)context;
    Order order = {ORDER_SCENE, variant};
    CompiledScene sent = *compiled;
    broadcast(&order, sizeof order, MPI_COMM_WORLD);
    scene_broadcast(&sent, true);
}

// What the first rank knows about another one.
typedef struct {
    Request request;
    BandRows rows; // handed out and not yet received
    Film band;     // collects their layers; height 0 until its header arrives
    Layer next_layer;
    bool wants_rows, end_sent, is_dropped, is_done;
    char failure[sizeof((Rank *)0)->failure]; // as reported by TAG_DONE
} RankState;

// Receives `size` bytes, beginning with the message of a status. Discards the message and returns false if it
// has another size than the first of these or if `bytes` is NULL.
static bool receive_checked(void *bytes, size_t size, const MPI_Status *status)
{
    int count;
    MPI_Get_count(status, MPI_BYTE, &count);
    const bool fits = bytes && count == message_size(size);
    OWNED void *discarded = fits ? NULL : memory_allocate((size_t)count + 1, 1);
    MPI_Recv(fits ? bytes : discarded, count, MPI_BYTE, status->MPI_SOURCE, status->MPI_TAG, MPI_COMM_WORLD,
             MPI_STATUS_IGNORE);
    if (fits && (size_t)count < size)
        receive_bytes((char *)bytes + count, size - (size_t)count, status->MPI_SOURCE, status->MPI_TAG);
    return fits;
}

// Receives a request. Also returns false for a rank that has not sent all its rows, or did not wait for the
// answer to its last request.
static bool request_receive(RankState *state, const MPI_Status *status)
{
    const bool is_due = !state->wants_rows && state->rows.row_count == 0;
    state->wants_rows = true;
    return receive_checked(&state->request, sizeof state->request, status) && is_due &&
           state->request.rows_max > 0 && state->request.step > 0;
}

// Delivers the band to the scheduler if it has all layers.
static void band_deliver(RankState *state, Scheduler *scheduler, size_t worker)
{
    while (state->next_layer < LAYER_COUNT && !state->band.layers[state->next_layer])
        state->next_layer++;
    if (state->next_layer < LAYER_COUNT) return;
    state->rows = (BandRows){0};
    scheduler_deliver(scheduler, worker, &state->band);
    film_free(&state->band);
}

// Receives the header of a band. Returns false if its rows are not those that the rank was given.
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

// Receives one layer. A rank that sends none does not block the others.
static bool layer_receive(RankState *state, const MPI_Status *status)
{
    void *layer = state->band.height > 0 ? state->band.layers[state->next_layer] : NULL;
    const size_t size = layer ? film_layer_size(&state->band, state->next_layer) : 0;
    const bool is_right = receive_checked(layer, size, status);
    state->next_layer += is_right;
    return is_right;
}

// Receives a rank's last message.
static bool done_receive(RankState *state, const MPI_Status *status)
{
    const bool is_right = receive_checked(state->failure, sizeof state->failure, status);
    state->failure[is_right ? sizeof state->failure - 1 : 0] = '\0';
    state->is_done = true;
    return is_right;
}

// Receives a message of a rank. Returns false if it is not one that was due.
static bool message_receive(const Ranks *ranks, RankState *state, const MPI_Status *status)
{
    switch (status->MPI_TAG) {
    case TAG_REQUEST:
        return request_receive(state, status);
    case TAG_BAND:
        return header_receive(ranks, state, status);
    case TAG_LAYERS:
        return layer_receive(state, status);
    case TAG_DONE:
        return done_receive(state, status);
    default:
        return receive_checked(NULL, SIZE_MAX, status);
    }
}

// Receives a message of a rank. Delivers the band that it completes, or drops the rank, whose rows the others
// then render.
static void message_process(const Ranks *ranks, RankState *state, Scheduler *scheduler, size_t worker,
                            const MPI_Status *status)
{
    const bool is_right = message_receive(ranks, state, status);
    const bool owes_rows = state->is_done && state->rows.row_count > 0 && !scheduler_has_ended(scheduler);
    if (state->is_dropped) return;
    if (is_right && !owes_rows && state->failure[0] == '\0') {
        if (status->MPI_TAG == TAG_BAND || status->MPI_TAG == TAG_LAYERS)
            band_deliver(state, scheduler, worker);
        return;
    }
    const int rank = status->MPI_SOURCE;
    stderr_print("warning: rank %d on %s: %s; the other ranks render its rows", rank,
                 ranks->items[rank - 1].host,
                 state->failure[0] != '\0' ? state->failure : "sent an unexpected message");
    state->is_dropped = true;
    state->rows = (BandRows){0}; // so that no later band is right
    film_free(&state->band);
    scheduler_drop(scheduler, worker);
}

// Answers a rank that wants rows, and reports the end to each once. Returns false if nothing is due.
static bool rank_answer(RankState *state, Scheduler *scheduler, size_t worker, int rank)
{
    if (state->wants_rows && !state->is_done) {
        bool waits = false;
        BandRows rows = {0};
        if (!state->is_dropped)
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
    OWNED RankState *states = memory_allocate_zeroed(ranks->remote.count, sizeof *states);
    for (size_t done_count = 0; done_count < ranks->remote.count;) {
        MPI_Status status;
        bool is_busy = has_message(MPI_ANY_SOURCE, MPI_ANY_TAG, &status);
        if (is_busy) {
            const size_t index = (size_t)status.MPI_SOURCE - 1;
            message_process(ranks, &states[index], scheduler, first_worker + index, &status);
        }
        if (is_interrupted()) scheduler_end(scheduler);
        done_count = 0;
        for (size_t i = 0; i < ranks->remote.count; i++) {
            is_busy |= rank_answer(&states[i], scheduler, first_worker + i, (int)i + 1);
            done_count += states[i].is_done && states[i].end_sent;
        }
        if (!is_busy) poll_pause();
    }
    for (size_t i = 0; i < ranks->remote.count; i++)
        film_free(&states[i].band);
}

// Returns false with a message if an option is for a single process.
static bool options_suit_ranks(const DriverOptions *options)
{
    return (options->work_group[0] == 0 && !options->build_options && !options->capture_folder) ||
           option_usage_fault(
               "render", "--work-group, --build-options and --capture need glint render, a single process");
}

int first_rank_run(size_t other_count, int argument_count, char **arguments)
{
    Ranks ranks = {.remote = {.count = other_count,
                              .shares = memory_allocate_zeroed(other_count, sizeof *ranks.remote.shares),
                              .needs_scene = ranks_need,
                              .send_scene = scene_send,
                              .serve = ranks_serve,
                              .context = &ranks},
                   .items = memory_allocate_zeroed(other_count, sizeof *ranks.items),
                   .begin = ranks_begin,
                   .start = ranks_start};
    interrupts_catch();
    fault_catch_crashes();
    int status = EXIT_USER;
    if (argument_count < 2 || strcmp(arguments[1], "render") != 0) {
        fprintf(stderr, "usage: mpirun -n RANKS glint-mpi render SCENE... [OPTIONS]\n"
                        "The options are those of glint render; each rank renders on a separate device.\n");
    } else {
        static char name[] = "glint-mpi render"; // getopt's messages begin with it
        arguments[1] = name;
        RenderCommand *command = render_command_open(argument_count - 1, arguments + 1, &status);
        if (command) {
            command->open.is_single = true;
            if (!options_suit_ranks(&command->options.common.driver)) {
                render_command_record(command, EXIT_USER);
            } else if (render_command_check_overwrites(command)) {
                const size_t dealt = frames_deal(command, other_count, argument_count, arguments);
                render_command_run_from(command, dealt, &ranks);
            }
            status = render_command_close(command);
        }
    }
    Job none = {.type = JOB_END};
    broadcast(&none, sizeof none, MPI_COMM_WORLD);
    free(ranks.items);
    free(ranks.remote.shares);
    return command_finish(status);
}
