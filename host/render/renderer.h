// A scene compiled and uploaded to a device, then rendered in bands or probed with explicit rays. Of the
// rooms, only this one uses both scenes and OpenCL.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/compile/settings.h"
#include "host/opencl/compute.h"
#include "host/render/film.h"
#include "host/render/scheduler.h"
#include "host/render/trace.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t width, height;                                   // of the whole image
    uint32_t region_x, region_y, region_width, region_height; // the part to render
    // Above 1: of each cell x cell pixels from region_x, region_y on, region_width x region_height squares,
    // only one is rendered, in color without AOVs. At most 4096.
    uint32_t cell;
    uint32_t sample_count; // per pixel, >= 1
    uint32_t bounce_count; // at most, per ray; 0..BOUNCES_MAX
    Precision precision;
    uint32_t lanes; // rays per work-item: 1, 4, 8, 16; 0: device_lanes
    BvhChoice bvh;
    bool counting;             // count the rays of the image, not those of AOVs, by kind in a slower build
    uint32_t perturb_seed;     // not 0: inject the rounding error OpenCL permits (kernels/numerics/perturb.h)
    uint32_t perturb_scale;    // multiplies that error, up to PERTURB_SCALE_MAX; 0: 1
    FeatureSet extra_features; // built in beyond the scene's own, for tests
    bool shift_to_eye;         // the eye is the origin, for images; false for explicit rays
    bool moves;                // the flat arrays stay in the host's memory, so that renderer_move is fast
    // With `moves`: renderer_move leaves the arrays as the last eye saw them, which takes no time. Their
    // roundings are then relative to that eye's distance from the surfaces.
    bool is_preview;
    bool no_cache;
    double band_seconds;         // target duration of a launch; 0: 0.1
    bool (*stop)(void *context); // called between launches; true ends the render; NULL: never
    void *stop_context;
    bool hashes_scene;  // for the report
    uint32_t band_rows; // fixed rows per band, for tests; 0: by time
    Stage *stage;       // shows what is done before the first launch; NULL: not wanted
} RenderSettings;

// A whole image, with one sample per pixel.
static inline RenderSettings settings_of_image(uint32_t width, uint32_t height, Precision precision)
{
    return (RenderSettings){.width = width,
                            .height = height,
                            .region_width = width,
                            .region_height = height,
                            .sample_count = 1,
                            .precision = precision};
}

// 8192 ulp, the largest error (kernels/numerics/perturb.h), times this is below 2^23 ulp: an injected error
// stays below one binade.
enum { PERTURB_SCALE_MAX = 1000 };

enum { SAMPLES_MAX = 1 << 20 };

typedef struct Renderer Renderer;

enum { LANES_MAX = 16 };

// The pixels that a renderer renders: all; at `certified` then those in doubt, in double with bounds of its
// own; then those that these leave undecided, which so look as they do at `double`.
typedef enum { PASS_ALL, PASS_IN_DOUBT, PASS_UNDECIDED, PASS_COUNT } PixelPass;

// What a scene is compiled for beside the settings. Devices with the same lanes read the same arrays.
typedef struct {
    PixelPass pass;
    uint32_t lanes;
} SceneVariant;

// Others that render the same image, such as other processes.
typedef struct {
    bool (*needs)(void *context, SceneVariant variant);
    void (*send)(void *context, SceneVariant variant, const CompiledScene *compiled);
    void *context;
} SceneReceivers;

// Opens a renderer on each device. The scene is compiled once for each variant that they or the receivers
// (NULL: none) need, and uploaded; kernels are built when first used. False with a message, and all renderers
// NULL: a number of the scene does not fit the precision. A single renderer is NULL with a message in its own
// list if the settings do not fit its device (double without fp64, certified where its reference lacks that,
// lanes not 1, 4, 8 or 16), or the scene its memory; without one if the device failed, see Compute. Computes
// outlive their renderers. `moves` is ignored where there are several devices. renderers[i] is NULL before,
// or an earlier renderer of the device, which is closed: its kernels are used again where they suit.
bool renderers_open(Renderer **renderers, Compute *const *computes, size_t count, const Scene *scene,
                    const RenderSettings *settings, const SceneReceivers *others, MessageList *messages,
                    MessageList *of_each);
// On one device: NULL as there.
Renderer *renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                        MessageList *messages);
// On one device, without a scene: renderer_take is called with that of each pass. NULL as above. `earlier` as
// there.
Renderer *renderer_open_empty(Compute *compute, const RenderSettings *settings, Renderer *earlier,
                              MessageList *messages);
// The lanes of a pass; 0: there is no such pass.
uint32_t renderer_lanes(Renderer *renderer, PixelPass pass);
// Takes the compiled scene of the pass and its lanes, even on failure. False with a message: it exceeds the
// device's memory; without: the device failed.
bool renderer_take(Renderer *renderer, PixelPass pass, CompiledScene *compiled, MessageList *messages);
// Frees what the scene takes in memory. Only the kernels are left, for a later renderer.
void renderer_release_scene(Renderer *renderer);
void renderer_close(Renderer *renderer);
// Takes another camera, size, region, samples or bounces, and without settings->moves other objects,
// materials, lights and BvhChoice; all else in `scene` and `settings` is what the renderer was opened with.
// Textures stay on the device, and kernels where they suit. False as where
// renderer_open returns NULL; the renderer then renders what it did before, unless the device failed.
bool renderer_move(Renderer *renderer, const Scene *scene, const RenderSettings *settings,
                   MessageList *messages);

// Returns scene_color_max of the renderer's scene, which `scene` is.
double renderer_color_max(const Renderer *renderer, const Scene *scene);
// What all bands with the color and the AOVs of the set have together.
FilmHeader renderer_film_header(const Renderer *renderer, unsigned aovs);
// Renders the color and the AOVs of the set in bands of about band_seconds each. False: the device failed
// (compute_ok says so), else settings.stop or the sink ended it. A failed device delivers no further band.
bool renderer_render(Renderer *renderer, unsigned aovs, BandSink sink, void *context);

// Where a renderer gets its rows and leaves their bands: see scheduler_take, scheduler_give and
// scheduler_has_ended.
typedef struct {
    BandRows (*take)(void *context, uint32_t rows_max, uint32_t step);
    bool (*give)(void *context, const Film *band);
    bool (*has_ended)(void *context);
    void *context;
} BandQueue;

// Renders the rows of the queue until none are left. False: the device failed, or settings.stop or the queue
// ended it.
bool renderer_work(Renderer *renderer, unsigned aovs, const BandQueue *queue);

// Workers on other machines, which are the scheduler's last.
typedef struct {
    size_t count;
    // Hands out rows until the image is complete or the render has ended; in the caller's thread.
    void (*serve)(void *context, Scheduler *scheduler, size_t first_worker);
    WorkerShare *shares; // filled
    void *context;
} RemoteWorkers;

// One image by several renderers.
typedef struct {
    Renderer *const *renderers; // of one scene and one set of settings, each on a device of its own
    size_t count;
    unsigned aovs;
    BandSink sink;               // see SchedulerSettings
    WorkerDropped dropped;       // gets the renderer's index
    void *context;               // of both
    Checkpoint *checkpoint;      // or NULL
    const RemoteWorkers *remote; // or NULL
} RenderJob;

// As renderer_render. False: the last device failed, too, the checkpoint cannot be written or read, or
// settings.stop or the sink ended it.
bool render_job_run(const RenderJob *job);

// Called for each band of a pass. Its color is the sum of `samples` samples, or their mean where they are
// all; a band of AOVs has no color.
typedef bool (*PassSink)(void *context, const Film *band, uint32_t samples);

// Renders the image in passes over all of it, so that a preview sharpens: after the first, every pixel has
// one sample, after the last all. The AOVs of the set follow the first pass. The bits are renderer_render's.
// False as there.
bool renderer_accumulate(Renderer *renderer, unsigned aovs, PassSink sink, void *context);

// renderer_render into one film in double, which film_free frees. False: the device failed, or settings.stop
// ended it; there is nothing to free.
bool renderer_render_film(Renderer *renderer, unsigned aovs, Film *film);

// Closest hits of explicit rays (host/render/trace.h), by the same intersection code that renders. The
// report has neither its launches nor its reads. False: the device failed, and `hits` are undefined.
bool renderer_trace(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits);
// Computes neither reflected and refracted rays nor transmission and light, which makes it faster.
bool renderer_trace_closest(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits);

// A kernel launch or a transfer.
typedef struct {
    const char *name; // "render", "aov", "path", "repeat", "read-back"
    LaunchTime time;
} NamedLaunch;

typedef struct {
    const Device *device;
    const Device *reference_device; // that re-renders pixels at `certified`; NULL: `device` does
    FeatureSet features;
    uint32_t lanes;
    bool is_double; // structs in double
    uint64_t kernel_hash;
    uint64_t scene_hash; // of this pass, see renderer_scene_hash
    double flatten_seconds, bvh_seconds, build_seconds, upload_seconds;
    bool build_from_cache;     // every program was
    const char *build_options; // of its kernels, before those of the device
    bool is_out_of_line;       // a driver could not build a kernel with its functions inlined
    uint64_t rays[RAYS_COUNT]; // of each RAYS_… (kernels/types.h); where settings.counting
    struct {
        NamedLaunch *items;
        size_t count, capacity;
    } launches, reads;
    WorkerShare share; // of the last render
} RenderReport;
const RenderReport *renderer_report(const Renderer *renderer);

// Where settings.hashes_scene: of the arrays of all passes, their unit and the samples' offsets, but not of
// the BVH and the order that it gives the primitives, which do not change the image.
uint64_t renderer_scene_hash(const Renderer *renderer);

// The composed text of the kernel that renders, for other compilers. Caller frees.
char *renderer_kernel_text(const Renderer *renderer);
// Its hash, which the report has once the kernel is built.
uint64_t renderer_kernel_hash(const Renderer *renderer);
// Clears launches, reads and counted rays, so that the next render has its own report.
void renderer_report_restart(Renderer *renderer);
