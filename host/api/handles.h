// What the handles of glint.h are, and what its functions share.
#pragma once

#include "host/api/glint.h"
#include "host/import/load.h"
#include "host/render/renderer.h"
#include <pthread.h>

struct GlintDevice {
    DeviceList list;
    Compute compute;
    pthread_mutex_t mutex; // held while a call uses the Compute
};

struct GlintScene {
    Scene scene;
};

struct GlintTracer {
    GlintDevice *device;
    Renderer *renderer;
    GlintPrecision precision;
    size_t object_count;
};

// Copies a caller's struct, which may be of another version of the interface. False with a message: its size
// cannot be, or it has members that are not known and not 0.
bool struct_read(void *own, size_t own_size, const void *given, MessageList *messages);

// Ends a call: hands its messages over, with the failure of the Compute (NULL: none is used) if it has one.
// Returns `status`, or that of the failure.
GlintStatus call_end(MessageList *list, const Compute *compute, GlintStatus status, char **messages);

// False with a message: there is no such precision.
bool precision_read(Precision *precision, GlintPrecision given, MessageList *messages);

// Opens a renderer, with the reference device that `certified` may need. NULL with a message, or if the
// device failed.
Renderer *device_renderer(GlintDevice *device, const Scene *scene, const RenderSettings *settings,
                          MessageList *messages);
