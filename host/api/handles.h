// Defines the handles of glint.h and declares the functions that its implementation shares.
#pragma once

#include "host/api/glint.h"
#include "host/import/load.h"
#include "host/render/renderer.h"
#include <pthread.h>

struct GlintDevice {
    DeviceList list;
    Compute compute;
    WarningReceiver receiver;
    MessageList warnings;  // received and not yet passed to the caller
    pthread_mutex_t mutex; // held while a call uses the Compute or the warnings
};

struct GlintScene {
    Scene scene;
};

struct GlintTracer {
    GlintDevice *device;
    Renderer *renderer;
    Precision precision;
};

// Copies a caller's struct, which may be of another version of the interface, to `full`, a struct of this
// version. Returns false with a message that names its type if it is NULL, if its size is not set or if a
// member that this version does not know is not 0.
bool struct_read(void *full, size_t full_size, const void *given, const char *type, MessageList *messages);

// Copies a struct of this version over the caller's, which may be of another version of the interface and
// keeps its size. Members that this version does not know become 0.
void struct_write(void *given, const void *full, size_t full_size);

// Ends a call. Passes its messages to the caller, including the warnings and the failure of the device, which
// may be NULL. Returns `status`, or the status of the failure.
GlintStatus call_end(MessageList *list, GlintDevice *device, GlintStatus status, char **messages);

// Returns whether the caller's struct, which may be NULL, states a size of at least `size_min` bytes, and
// adds a message if not.
bool struct_has_size(const void *given, size_t size_min, const char *type, MessageList *messages);

// Returns whether a type of numbers is known, and adds a message if not.
bool real_is_known(GlintReal real, MessageList *messages);

// Converts a precision. Returns false with a message if it is invalid.
bool precision_read(Precision *precision, GlintPrecision given, MessageList *messages);

// Opens a renderer, with the reference device that `certified` may need. Returns NULL with a message, or
// without one if the device failed.
Renderer *device_renderer(GlintDevice *device, const Scene *scene, const RenderSettings *settings,
                          MessageList *messages);

// Returns how many of the rays are traced at once. On a CPU they are few enough that their data, some 300
// bytes each, stays in its caches. On a GPU they are enough to occupy it.
static inline size_t batch_rays(const GlintTracer *tracer, size_t ray_count)
{
    const bool is_gpu = tracer->device->compute.device->type & CL_DEVICE_TYPE_GPU;
    const size_t most = is_gpu ? 1 << 18 : 1 << 16;
    return ray_count < most ? ray_count : most;
}

// Copies a caller's rays, of any version of the interface. Returns false with a message if they are invalid.
bool rays_read(GlintRays *read, const GlintRays *given, MessageList *messages);

// Reads `count` rays from `first` on and scales them (host/render/trace.h). Returns false with a message if
// one is invalid.
bool rays_scale(TraceRay *scaled, int *exponents, const GlintRays *rays, size_t first, size_t count,
                Precision precision, MessageList *messages);
