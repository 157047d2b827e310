// Other machines that render bands of the same image, as processes of one MPI job; implemented by host/mpi.
#pragma once

#include "host/render/renderer.h"

// One process, and the device that it renders on.
typedef struct {
    uint32_t lanes;
    char device[128], driver[128], host[64];
    char failure[256]; // why it cannot render; empty: it can
} Rank;

typedef struct Ranks {
    size_t count; // without the first, which is this process
    Rank *items;
    WorkerShare *shares;
    FilmHeader film; // of the image, once it is rendered
    // Sends all of them what they need to render. False with a message.
    bool (*begin)(struct Ranks *ranks, const Scene *scene, const RenderSettings *settings, unsigned aovs,
                  const char *device_selector, MessageList *messages);
    void (*serve)(void *ranks, Scheduler *scheduler, size_t first_worker); // see RemoteWorkers
    bool has_begun;
} Ranks;

// glint render, with other ranks' devices.
int command_render_on(Ranks *ranks, int argument_count, char **arguments);
