#include "host/mpi/messages.h"

#include "host/base/array.h"
#include "host/base/exit_status.h"
#include "host/base/file.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/cli/interrupts.h"
#include "host/cli/options.h"
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const size_t NO_FRAME = SIZE_MAX;
// A frame's status if another device may be able to render it.
enum { FRAME_UNFIT = 256 };

static int frame_render(RenderCommand *command, size_t frame)
{
    const int status = render_command_run(command, frame, NULL);
    return status == EXIT_USER && command->open.is_unfit ? FRAME_UNFIT : status;
}

// Tests whether the files are shared.

enum { MARKER_BYTES = 4096 };

// The arguments that a rank was called with, of which files_hash skips glint-mpi's name and its command's.
typedef struct {
    int argument_count;
    char **arguments;
} Call;

// Adds what identifies a file and its content to a hash.
static uint64_t file_hash_add(uint64_t hash, const char *path)
{
    struct stat file = {0};
    if (stat(path, &file) != 0) file.st_size = -1;
    const uint64_t facts[] = {file.st_ino, (uint64_t)file.st_size, (uint64_t)file.st_mtim.tv_sec,
                              (uint64_t)file.st_mtim.tv_nsec};
    return hash_bytes(hash, facts, sizeof facts);
}

// Returns a hash of the arguments, the images' names and the files of the scenes and of the camera. It is the
// same for two ranks only if both render the same and see the same of these files. Files that these name,
// such as meshes, are not compared.
static uint64_t files_hash(const RenderCommand *command, Call call)
{
    uint64_t hash = HASH_START;
    for (int i = 2; i < call.argument_count; i++)
        hash = hash_bytes(hash, call.arguments[i], strlen(call.arguments[i]) + 1);
    for (size_t i = 0; i < command->count; i++) {
        hash = hash_bytes(hash, command->paths[i], strlen(command->paths[i]) + 1);
        hash = file_hash_add(hash, render_command_scene(command, i));
    }
    const char *camera = command->options.common.scene.camera;
    return camera ? file_hash_add(hash, camera) : hash;
}

// Returns whether standard streams are used, which only one rank can read, or write in order.
static bool uses_standard_streams(const RenderCommand *command)
{
    if (timing_uses_stdout(command->options.timing)) return true;
    for (size_t i = 0; i < command->count; i++)
        if (strcmp(render_command_scene(command, i), "-") == 0 || strcmp(command->paths[i], "-") == 0)
            return true;
    return false;
}

// Makes a new file in the images' folder. Its name is empty if that fails. It is that of a temporary of the
// first image (output.h), so that the next process that replaces the image removes what a killed one left.
static void marker_make(const RenderCommand *command, char *name)
{
    enum { TRIES = 100 };
    const char *path = command->paths[0], *image = file_base_name(path);
    for (int i = 0; i < TRIES; i++) {
        const int length =
            snprintf(name, MARKER_BYTES, "%.*s.%.200s.glint-%d", (int)(image - path), path, image, i);
        if (length >= MARKER_BYTES) break;
        const int descriptor = open(name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
        if (descriptor >= 0) close(descriptor);
        if (descriptor >= 0) return;
    }
    name[0] = '\0';
}

// Returns whether all ranks see the scenes and the images' folder. All ranks call it; `command` is NULL if
// the arguments could not be read.
static bool files_are_shared(RenderCommand *command, Call call, bool is_first)
{
    char marker[MARKER_BYTES] = "";
    const uint64_t local_hash = command ? files_hash(command, call) : 0;
    uint64_t hash = local_hash;
    const bool can_render = command && !uses_standard_streams(command) &&
                            render_devices_open(&command->open, &command->options.common);
    if (is_first) {
        interrupts_hold(); // so that the marker is removed in any case
        marker_make(command, marker);
    }
    broadcast(marker, sizeof marker, MPI_COMM_WORLD);
    broadcast(&hash, sizeof hash, MPI_COMM_WORLD);
    int sees = can_render && local_hash == hash && marker[0] != '\0' && access(marker, F_OK) == 0, all_see;
    MPI_Allreduce(&sees, &all_see, 1, MPI_INT, MPI_LAND, MPI_COMM_WORLD);
    if (is_first && marker[0] != '\0') unlink(marker);
    if (is_first) interrupts_release();
    return all_see;
}

// The first rank. Its own device renders in a thread.

typedef struct {
    pthread_mutex_t mutex;
    RenderCommand *command;
    size_t next, end;         // frames that were not dealt yet
    ARRAY_OF(size_t) retries; // frames of ranks whose devices failed
    size_t workers, dealt;    // workers whose devices work, frames that are being rendered
    atomic_bool has_ended;
} Deal;

// Returns the next frame, or NO_FRAME. There may be one later if a rank that has one fails.
static size_t frame_acquire(Deal *deal)
{
    size_t frame = NO_FRAME;
    pthread_mutex_lock(&deal->mutex);
    if (!deal->has_ended && deal->retries.count > 0)
        frame = deal->retries.items[--deal->retries.count];
    else if (!deal->has_ended && deal->next < deal->end)
        frame = deal->next++;
    deal->dealt += frame != NO_FRAME;
    pthread_mutex_unlock(&deal->mutex);
    return frame;
}

// Records a frame's status. Returns false if the worker's device failed or does not fit the frame. The other
// workers then render it and all frames that are left. A frame that does not fit the last worker either is
// skipped.
static bool frame_record(Deal *deal, size_t frame, int status)
{
    pthread_mutex_lock(&deal->mutex);
    if (status == FRAME_UNFIT && deal->workers == 1) status = EXIT_USER;
    const bool works = status != EXIT_MACHINE && status != FRAME_UNFIT;
    deal->dealt--;
    if (works) {
        render_command_record(deal->command, status);
    } else {
        array_push(deal->retries, frame);
        deal->end = deal->command->count;
        deal->workers--;
    }
    if (status == EXIT_INTERRUPTED || deal->workers == 0) deal->has_ended = true;
    pthread_mutex_unlock(&deal->mutex);
    return works;
}

// Returns whether no frame is left and none that is being rendered may return from a rank that fails.
static bool deal_is_over(Deal *deal)
{
    pthread_mutex_lock(&deal->mutex);
    const bool is_over =
        deal->has_ended || (deal->dealt == 0 && deal->retries.count == 0 && deal->next == deal->end);
    pthread_mutex_unlock(&deal->mutex);
    return is_over;
}

static void *own_frames_render(void *context)
{
    Deal *deal = context;
    for (bool works = true; works && !deal_is_over(deal);) {
        const size_t frame = frame_acquire(deal);
        if (frame == NO_FRAME) {
            poll_pause();
            continue;
        }
        works = frame_record(deal, frame, frame_render(deal->command, frame));
        if (!works) render_command_drop_devices(deal->command);
    }
    return NULL;
}

typedef struct {
    size_t frame; // or NO_FRAME
    bool wants, has_failed, end_sent, is_over;
} RankFrames;

// Receives the status of the rank's last frame.
static void frame_done_receive(Deal *deal, RankFrames *state, int rank)
{
    int status;
    receive_bytes(&status, sizeof status, rank, TAG_FRAME_DONE);
    if (state->frame != NO_FRAME) state->has_failed = !frame_record(deal, state->frame, status);
    state->frame = NO_FRAME;
    state->wants = true;
}

// Sends a frame to a rank that wants one, and the end to each once. Returns false if nothing is due.
static bool frame_send(Deal *deal, RankFrames *state, int rank)
{
    if (!state->end_sent && (state->has_failed || deal_is_over(deal))) {
        send_bytes(NULL, 0, rank, TAG_END);
        return state->end_sent = true;
    }
    if (!state->wants) return false;
    if (!state->end_sent) state->frame = frame_acquire(deal);
    if (state->frame == NO_FRAME && !state->end_sent) return false;
    send_bytes(&state->frame, sizeof state->frame, rank, TAG_FRAME);
    state->wants = false;
    state->is_over = state->frame == NO_FRAME;
    return true;
}

static void frames_serve(Deal *deal, size_t other_count)
{
    OWNED RankFrames *states = memory_allocate_zeroed(other_count, sizeof *states);
    for (size_t i = 0; i < other_count; i++)
        states[i].frame = NO_FRAME;
    for (size_t over_count = 0; over_count < other_count;) {
        MPI_Status status;
        bool is_busy = has_message(MPI_ANY_SOURCE, TAG_FRAME_DONE, &status);
        if (is_busy) frame_done_receive(deal, &states[status.MPI_SOURCE - 1], status.MPI_SOURCE);
        if (is_interrupted()) deal->has_ended = true;
        over_count = 0;
        for (size_t i = 0; i < other_count; i++) {
            is_busy |= frame_send(deal, &states[i], (int)i + 1);
            over_count += states[i].is_over;
        }
        if (!is_busy) poll_pause();
    }
}

size_t frames_deal(RenderCommand *command, size_t other_count, int argument_count, char **arguments)
{
    const size_t worker_count = other_count + 1, whole = command->count / worker_count;
    if (other_count == 0 || whole == 0) return 0;
    Job job = {.type = JOB_FRAMES};
    broadcast(&job, sizeof job, MPI_COMM_WORLD);
    if (!files_are_shared(command, (Call){argument_count, arguments}, true)) return 0;
    Deal deal = {.mutex = PTHREAD_MUTEX_INITIALIZER,
                 .command = command,
                 .end = whole * worker_count,
                 .workers = worker_count};
    pthread_t thread;
    interrupts_hold(); // also while the thread reads a scene
    const bool has_thread = pthread_create(&thread, NULL, own_frames_render, &deal) == 0;
    if (!has_thread) {
        stderr_print("warning: cannot start a thread; the other ranks render the frames");
        deal.workers--;
    }
    frames_serve(&deal, other_count);
    if (has_thread) pthread_join(thread, NULL);
    interrupts_release();
    free(deal.retries.items);
    if (deal.workers == 0) {
        stderr_print("no rank is left that can render");
        render_command_record(command, EXIT_MACHINE);
    } else if (is_interrupted() && (deal.next < deal.end || deal.retries.count > 0)) {
        render_command_record(command, EXIT_INTERRUPTED);
    }
    return deal.end;
}

// The other ranks.

void frames_work(size_t local_rank, int argument_count, char **arguments)
{
    int status;
    RenderCommand *command = render_command_open(argument_count - 1, arguments + 1, &status);
    if (command) {
        command->open.is_single = true;
        command->open.number = local_rank;
    }
    if (files_are_shared(command, (Call){argument_count, arguments}, false)) {
        bool has_ended = false;
        status = EXIT_DONE;
        interrupts_set_source(end_poll, &has_ended);
        for (size_t frame;; status = frame_render(command, frame)) {
            send_bytes(&status, sizeof status, 0, TAG_FRAME_DONE);
            receive_bytes(&frame, sizeof frame, 0, TAG_FRAME);
            if (frame == NO_FRAME) break;
        }
        interrupts_set_source(NULL, NULL);
        end_await(&has_ended);
        render_command_drop_devices(command);
    }
    if (command) render_command_close(command);
}
