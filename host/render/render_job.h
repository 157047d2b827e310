// Renders one image on several devices, and on those of other machines.
#pragma once

#include "host/render/renderer.h"
#include "host/render/scheduler.h"

// Workers on other machines, which are the last of the scheduler's workers. The functions are called in this
// order.
typedef struct {
    size_t count;
    WorkerShare *shares; // output, one per worker
    // Returns whether a worker needs the compiled scene of the variant, and sends it to those.
    bool (*needs_scene)(void *context, SceneVariant variant);
    void (*send_scene)(void *context, SceneVariant variant, const CompiledScene *compiled);
    // Hands out rows, in the caller's thread, until the image is complete or the render has ended.
    void (*serve)(void *context, Scheduler *scheduler, size_t first_worker);
    void *context;
} RemoteWorkers;

// The renderers of one image, each on a different device.
typedef struct {
    Renderer **renderers;
    Compute *const *computes; // outlive the renderers
    MessageList *messages;    // one list per renderer
    size_t count;
} RendererSet;

// Opens a renderer on each device as renderer_reopen does. The scene is compiled once for each variant that
// the renderers or the remote workers (which may be NULL) need. The setting `moves` is ignored if there are
// several devices. On entry renderers[i] is NULL or an earlier renderer of the device.
//
// Returns false with a message, and all renderers NULL, if a number of the scene does not fit the precision.
// A single renderer is NULL with a message in its own list if the settings do not fit its device, or if the
// scene does not fit its memory. It is NULL with no message if the device failed; its Compute has the
// failure.
bool renderers_open(const RendererSet *set, const Scene *scene, const RenderSettings *settings,
                    const RemoteWorkers *remote, MessageList *messages);

// The rendering of one image by several renderers.
typedef struct {
    Renderer *const *renderers; // with the same scene and settings, each on a different device
    size_t count;
    unsigned aovs;
    BandSink sink; // these three are the scheduler's
    void (*dropped)(void *context, size_t renderer);
    void *context;
    Checkpoint *checkpoint;      // may be NULL
    const RemoteWorkers *remote; // may be NULL
} RenderJob;

// Renders the color and the AOVs of the job's set. Returns false if every device failed, if the checkpoint
// cannot be written or read, or if settings.stop or the sink ended the render.
bool render_job_run(const RenderJob *job);
