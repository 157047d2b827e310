// Other machines that render bands of the same image as processes of one MPI job. host/mpi implements them.
#pragma once

#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/render/render_job.h"
#include <stdio.h>

// One process, and the device that it renders on.
typedef struct {
    uint32_t lanes[PASS_COUNT]; // the lanes of each pass, 0 if the rank does not have it
    char device[128], driver[128], host[64];
    char reference[320]; // the model of the device that works in double for it; empty if there is none
    char failure[256];   // why it has no device; empty if it has one
} Rank;

// Returns a text that identifies the rank's device and driver, and its lanes. The caller frees it.
static inline char *rank_model(const Rank *rank, uint32_t lanes)
{
    return text_format("\"%s, %s\", %u lanes", rank->device, rank->driver, lanes);
}

// Sets the names of the rank's device, cut to fit, and its reference device, which may be NULL.
static inline void rank_set_devices(Rank *rank, const Device *device, const Device *reference)
{
    const char *board = device->board;
    snprintf(rank->device, sizeof rank->device, "%s%s%s", device->name, board[0] ? ", " : "", board);
    snprintf(rank->driver, sizeof rank->driver, "%s, %s", device->platform_name, device->driver);
    if (!reference) return;
    Rank other = {0};
    rank_set_devices(&other, reference, NULL);
    OWNED char *model = rank_model(&other, device_lanes(reference, true, 0));
    snprintf(rank->reference, sizeof rank->reference, "%s", model);
}

// The ranks. `begin` must be called before the functions of `remote`, and `start` before the last of them.
typedef struct Ranks {
    RemoteWorkers remote; // excludes the first rank, which is this process
    Rank *items;          // one per remote worker
    FilmHeader film;      // describes the image after it is rendered
    // Asks all ranks for their devices. Returns false with a message if a rank has none. All ranks then stop.
    bool (*begin)(struct Ranks *ranks, const RenderSettings *settings, unsigned aovs,
                  const char *device_selector, const char *reference_selector, MessageList *messages);
    // Starts serving the ranks if `can_start` is set, otherwise ends their job.
    void (*start)(bool can_start);
} Ranks;
