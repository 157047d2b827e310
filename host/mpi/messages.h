// The messages between the ranks of a job. The first rank broadcasts one Job after another. For an image,
// the others answer with their Ranks and then receive Orders: one for each variant that a rank needs,
// followed by its compiled scene, and then the start. From then on, each asks the first rank for rows and
// sends their bands, until it has sent TAG_DONE and received TAG_END.
//
// Messages are structs of this program without pointers, which would mean nothing in another process.
#pragma once

#include "host/cli/ranks.h"
#include <mpi.h>

enum {
    TAG_REQUEST,    // a Request
    TAG_ROWS,       // BandRows, the answer; no rows: the end
    TAG_BAND,       // a FilmHeader, followed by the layers with the next tag
    TAG_LAYERS,     // a layer, in several messages if it is large
    TAG_END,        // to a rank that renders: the render has ended
    TAG_DONE,       // a rank's last message: why its device failed, or an empty text
    TAG_FRAME_DONE, // the exit status of a rank's frame; EXIT_DONE before the first
    TAG_FRAME,      // the answer: the next frame's index, or NO_FRAME
};

typedef struct {
    uint32_t rows_max, step;
} Request;

// MEMBER(Type, name): the settings that the other ranks need. These ranks do not compile the scene, show no
// progress and stop when the first rank tells them to.
#define JOB_SETTINGS_LIST(MEMBER)                                                                            \
    MEMBER(uint32_t, width)                                                                                  \
    MEMBER(uint32_t, height)                                                                                 \
    MEMBER(uint32_t, region_x)                                                                               \
    MEMBER(uint32_t, region_y)                                                                               \
    MEMBER(uint32_t, region_width)                                                                           \
    MEMBER(uint32_t, region_height)                                                                          \
    MEMBER(uint32_t, cell)                                                                                   \
    MEMBER(uint32_t, sample_count)                                                                           \
    MEMBER(uint32_t, first_sample)                                                                           \
    MEMBER(uint32_t, end_sample)                                                                             \
    MEMBER(uint32_t, bounce_count)                                                                           \
    MEMBER(double, min_contribution)                                                                         \
    MEMBER(Precision, precision)                                                                             \
    MEMBER(uint32_t, lanes)                                                                                  \
    MEMBER(bool, counting)                                                                                   \
    MEMBER(bool, no_cache)                                                                                   \
    MEMBER(double, band_seconds)                                                                             \
    MEMBER(FeatureSet, extra_features)                                                                       \
    MEMBER(uint32_t, perturb_seed)                                                                           \
    MEMBER(uint32_t, perturb_scale)                                                                          \
    MEMBER(uint32_t, band_rows)

#define JOB_SETTING(Type, name) Type name;
typedef struct {
    JOB_SETTINGS_LIST(JOB_SETTING)
} JobSettings;

// Convert the settings. What a job does not have is 0.
JobSettings job_settings_of(const RenderSettings *settings);
RenderSettings settings_of_job(const JobSettings *settings);

typedef struct {
    enum { JOB_END, JOB_FRAMES, JOB_IMAGE } type;
    JobSettings settings; // of an image, like the members below
    unsigned aovs;
    size_t selector_size; // of the device selector with its NUL, which follows; 0: none
} Job;

typedef struct {
    enum { ORDER_SCENE, ORDER_START, ORDER_CANCEL } type;
    SceneVariant variant; // of a scene
} Order;

// Sleeps briefly. MPI waits by polling, and this leaves the processor to the device.
void rest(void);

// Returns the size of the next message of a sequence that sends `bytes_left` more bytes. MPI counts the bytes
// of a message by an int.
int message_size(size_t bytes_left);
// Broadcasts from the first of `ranks`.
void broadcast(void *bytes, size_t size, MPI_Comm ranks);
// Send and receive bytes in one message, even if there are none, or in several of the same tag.
void send_bytes(const void *bytes, size_t size, int rank, int tag);
void receive_bytes(void *bytes, size_t size, int rank, int tag);
bool has_message(int rank, int tag, MPI_Status *status);

// Sends a compiled scene from the first rank to those with `takes`, which allocate its arrays. All ranks
// call it. A rank that does not take the scene leaves `compiled` unchanged.
void scene_broadcast(CompiledScene *compiled, int rank, bool takes);
