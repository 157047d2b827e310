// What the ranks of a job send each other. The first rank broadcasts a Job, again and again. For an image
// follow
//   the others' answers, their Ranks;
//   Orders: the compiled scene for each variant that a rank needs, after which it follows, then the start.
// From then on each asks the first one for rows and sends their bands, until it has sent TAG_DONE and
// received TAG_END.
#pragma once

#include "host/cli/ranks.h"
#include <mpi.h>

enum {
    TAG_TAKE, // a Request
    TAG_ROWS, // BandRows, the answer; no rows: the end
    TAG_BAND, // a FilmHeader, followed by the layers with the next tag
    TAG_LAYERS,
    TAG_END,        // to a rank that renders: the render has ended
    TAG_DONE,       // the last one of a rank: why its device failed, or an empty text
    TAG_FRAME_DONE, // the exit status of a rank's frame; EXIT_DONE, too, before the first
    TAG_FRAME,      // the answer: the next frame's index, or NO_FRAME
};

typedef struct {
    uint32_t rows_max, step;
} Request;

typedef struct {
    enum { JOB_END, JOB_FRAMES, JOB_IMAGE } type;
    RenderSettings settings; // of an image, and what follows
    unsigned aovs;
    size_t selector_size; // the device selector's, which follows, with its NUL; 0: none
} Job;

typedef struct {
    enum { ORDER_SCENE, ORDER_START, ORDER_CANCEL } type;
    SceneVariant variant; // of a scene
} Order;

// MPI waits by polling: this leaves the processor to the device.
void rest(void);

// From the first of `ranks`.
void broadcast(void *bytes, size_t size, MPI_Comm ranks);
void send_bytes(const void *bytes, size_t size, int rank, int tag);
void receive_bytes(void *bytes, size_t size, int rank, int tag);
bool has_message(int rank, int tag, MPI_Status *status);

// Sends a compiled scene from the first rank to those of the others that take it, which allocate its arrays.
// All ranks call it; `compiled` is unused by a rank that does not take it.
void scene_broadcast(CompiledScene *compiled, int rank, bool takes);
