// Other machines that render bands of the same image, as processes of one MPI job; implemented by host/mpi.
#pragma once

#include "host/render/renderer.h"
#include <stdio.h>

// One process, and the device that it renders on.
typedef struct {
    uint32_t lanes[PASS_COUNT]; // of each pass; 0: there is none
    char device[128], driver[128], host[64];
    char failure[256]; // why it has no device; empty: it has one
} Rank;

// Names its device. Texts too long for it are cut.
static inline void rank_set_device(Rank *rank, const Device *device)
{
    const char *board = device->board;
    snprintf(rank->device, sizeof rank->device, "%s%s%s", device->name, board[0] ? ", " : "", board);
    snprintf(rank->driver, sizeof rank->driver, "%s, %s", device->platform_name, device->driver);
}

// They are called in this order.
typedef struct Ranks {
    size_t count; // without the first, which is this process
    Rank *items;
    WorkerShare *shares;
    FilmHeader film; // of the image, once it is rendered
    // Asks all of them for their devices. False with a message: one of them has none, and all go no further.
    bool (*begin)(struct Ranks *ranks, const RenderSettings *settings, unsigned aovs,
                  const char *device_selector, MessageList *messages);
    SceneReceivers receivers; // send them the compiled scene
    // After that they are to be served; or, unless they `can_start`, this ends their job.
    void (*start)(bool can_start);
    void (*serve)(void *ranks, Scheduler *scheduler, size_t first_worker); // see RemoteWorkers
} Ranks;
