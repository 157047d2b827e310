// The protocol between the ranks of a job. All ranks are processes of one program and one architecture, so
// messages are structs. Pointers in them are NULL or replaced by the receiver. If a process dies, mpirun ends
// the job.
//
// The first rank broadcasts Jobs, the last of which is JOB_END.
//
// JOB_IMAGE: all ranks render bands of one image.
// 1. The first rank broadcasts the selectors of the device and of the reference device. Each other rank opens
//    a device and answers with its Rank.
// 2. The first rank broadcasts Orders: ORDER_SCENE with each variant of the scene that a rank needs, followed
//    by the compiled scene for the ranks that need it, and then ORDER_START. ORDER_CANCEL ends the job
//    instead if a rank has no device or the image cannot be rendered.
// 3. Each other rank sends TAG_REQUEST, receives TAG_ROWS and sends the band of these rows as TAG_BAND and
//    TAG_LAYERS, until it receives no rows or TAG_END or its device fails. Then it sends TAG_DONE.
// 4. The first rank sends TAG_END to each other rank once, when all rows are rendered, when the user
//    interrupts, or after that rank's TAG_DONE. The rank then waits for the next Job.
// A rank that reports a failure, or sends anything but its rows, is dropped with a warning. The others render
// its rows, its bands are discarded, and its requests are answered with no rows.
//
// JOB_FRAMES: each rank renders whole frames alone.
// 1. The first rank broadcasts the name of a marker file and a hash of the arguments and files. All ranks
//    learn whether all see both. If not, the job ends, and all ranks render the frames together.
// 2. Each other rank sends TAG_FRAME_DONE and receives TAG_FRAME, until it receives NO_FRAME.
// 3. The first rank sends TAG_END to each other rank once, before NO_FRAME: when all frames are rendered,
//    when the user interrupts, which stops a frame that is being rendered, or when that rank's device has
//    failed. Other ranks then render its frame.
#pragma once

#include "host/cli/render.h"
#include <mpi.h>

enum {
    TAG_REQUEST,    // a Request
    TAG_ROWS,       // BandRows, the answer, without rows at the end
    TAG_BAND,       // a FilmHeader, followed by the layers with the next tag
    TAG_LAYERS,     // a layer, in several messages if it is large
    TAG_END,        // no bytes
    TAG_DONE,       // a rank's last message, which states why its device failed, or is empty
    TAG_FRAME_DONE, // the status of a rank's frame; EXIT_DONE before the first
    TAG_FRAME,      // the index of the next frame, or NO_FRAME
};

typedef struct {
    uint32_t rows_max, step;
} Request;

typedef struct {
    enum { JOB_END, JOB_FRAMES, JOB_IMAGE } type;
    RenderSettings settings; // of an image, like the members below; all pointers are NULL
    unsigned aovs;
    // of the selectors with their NULs, which follow, or 0 for none
    size_t device_selector_size, reference_selector_size;
} Job;

typedef struct {
    enum { ORDER_SCENE, ORDER_START, ORDER_CANCEL } type;
    SceneVariant variant; // of a scene
} Order;

// Sleeps briefly. MPI waits by polling, and this leaves the processor to the device.
void poll_pause(void);

// Returns the size of the next message of a sequence that sends `bytes_left` more bytes. MPI counts the bytes
// of a message by an int.
int message_size(size_t bytes_left);
// Broadcasts from the first of `ranks`.
void broadcast(void *bytes, size_t size, MPI_Comm ranks);
// Send and receive bytes in one message, even if there are none, or in several of the same tag. receive_bytes
// sleeps between polls until each message has arrived.
void send_bytes(const void *bytes, size_t size, int rank, int tag);
void receive_bytes(void *bytes, size_t size, int rank, int tag);
bool has_message(int rank, int tag, MPI_Status *status);
// Receives TAG_END if it has arrived, and returns whether it has been received in this job. `has_ended`
// points to a bool that the caller sets to false when the job begins.
bool end_poll(void *has_ended);
// Waits for TAG_END unless it was received.
void end_await(bool *has_ended);

// Sends a compiled scene from the first rank to the others that call with `needs_scene`, which allocate its
// arrays. All ranks call it, the first one with `needs_scene`. The others leave `compiled` unchanged. Arrays
// that only a move of the scene reads are not sent.
void scene_broadcast(CompiledScene *compiled, bool needs_scene);

// The processes. Each is called with the arguments of glint-mpi.

// Runs glint render on the first rank, with the other ranks' devices added. Returns the exit status.
int first_rank_run(size_t other_count, int argument_count, char **arguments);
// Renders rows of the first rank's images on another rank's device, until there are no more images.
// `local_rank` is the rank's number on its machine, by which ranks share the devices.
void other_rank_run(size_t local_rank, int argument_count, char **arguments);

// Distribute whole frames. If all ranks see the files, each renders frames alone, the next one as soon as it
// has finished one. Frames that do not divide evenly are left to all ranks together.
// frames_deal runs on the first rank with the command of the arguments. Returns the first frame that is left
// to all ranks. frames_work runs on another rank.
size_t frames_deal(RenderCommand *command, size_t other_count, int argument_count, char **arguments);
void frames_work(size_t local_rank, int argument_count, char **arguments);
