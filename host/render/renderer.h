// Renders a compiled scene on a device in bands, or traces explicit rays through it. Among the rooms of the
// host, only this one uses both scenes and OpenCL.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/compile/settings.h"
#include "host/opencl/compute.h"
#include "host/render/band_queue.h"
#include "host/render/scheduler.h"
#include "host/render/trace.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t width, height;                                   // of the whole image
    uint32_t region_x, region_y, region_width, region_height; // the part of it to render
    // Above 1, only one pixel per square of cell x cell pixels is rendered, in color, with no AOVs. The
    // squares begin at region_x, region_y, and there are region_width x region_height of them. At most 4096.
    uint32_t cell;
    uint32_t sample_count; // per pixel, at least 1
    // Renders samples first_sample .. end_sample - 1 alone, as part of an image whose other samples another
    // scene has; an end_sample of 0 means sample_count. Unless they include the last, colors are their sum,
    // else their sum over sample_count. Both are 0 for renderer_accumulate.
    uint32_t first_sample, end_sample;
    uint32_t bounce_count; // the limit per camera ray, 0..BOUNCES_MAX
    // Reflected and refracted rays whose weight in a pixel is below this in all channels are not traced; 0
    // traces all.
    double min_contribution;
    Precision precision;
    uint32_t lanes; // rays per work-item: 1, 4, 8 or 16, or 0: see device_lanes
    BvhChoice bvh;
    InstanceChoice instances;
    bool counting; // counts the image's rays, not those of AOVs, by type in a slower build
    uint32_t
        perturb_seed; // unless 0, injects rounding errors that OpenCL permits (kernels/numerics/perturb.h)
    uint32_t perturb_scale;    // multiplies those errors, up to PERTURB_SCALE_MAX; 0 means 1
    FeatureSet extra_features; // built in beyond the scene's own, for tests
    bool shift_to_eye;         // makes the eye the origin, for images; false for explicit rays
    bool moves;                // keeps the flat arrays in the host's memory, so that renderer_move is fast
    // With `moves`, renderer_move leaves the arrays as they are for the last eye, which takes no time. Their
    // roundings are then relative to that eye's distance from the surfaces.
    bool is_preview;
    bool no_cache;
    double band_seconds;         // the target duration of a launch; 0 means 0.1
    bool (*stop)(void *context); // called between launches, ends the render by returning true; may be NULL
    void *stop_context;
    bool hashes_scene;  // computes renderer_scene_hash
    uint32_t band_rows; // a fixed number of rows per band, for tests; 0 sizes bands by time
    Stage *stage;       // shows the progress before the first launch; may be NULL
} RenderSettings;

// Returns the settings of a whole image with one sample per pixel.
static inline RenderSettings settings_of_image(uint32_t width, uint32_t height, Precision precision)
{
    return (RenderSettings){.width = width,
                            .height = height,
                            .region_width = width,
                            .region_height = height,
                            .sample_count = 1,
                            .precision = precision};
}

// The largest injected error is 8192 ulp (kernels/numerics/perturb.h). Times this it is below 2^23 ulp, so
// that an injected error stays below one binade.
enum { PERTURB_SCALE_MAX = 1000 };

enum { SAMPLES_MAX = 1 << 20 };

typedef struct Renderer Renderer;

enum { LANES_MAX = 16 };

// The pixels that a renderer renders: all of them; at `certified`, then the flagged ones, in double precision
// with bounds; then those that remain uncertified, so that these equal a render at `double`.
typedef enum { PASS_ALL, PASS_FLAGGED, PASS_UNCERTIFIED, PASS_COUNT } PixelPass;

// The inputs of a scene's compilation in addition to the settings. Devices with the same lanes read the same
// arrays.
typedef struct {
    PixelPass pass;
    uint32_t lanes;
} SceneVariant;

// Other renderers of the same image, such as other processes, which receive the compiled scene.
typedef struct {
    bool (*needs)(void *context, SceneVariant variant);
    void (*send)(void *context, SceneVariant variant, const CompiledScene *compiled);
    void *context;
} SceneReceivers;

// Opens a renderer on each device. The scene is compiled once for each variant that the renderers or the
// receivers (which may be NULL) need, and uploaded. Kernels are built when first used. Computes must outlive
// their renderers. `moves` is ignored if there are several devices. On entry renderers[i] is NULL or an
// earlier renderer of the device, which is closed; its kernels are reused where they suit.
//
// Returns false with a message, and all renderers NULL, if a number of the scene does not fit the precision.
// A single renderer is NULL with a message in its own list if the settings do not fit its device (double
// without fp64, certified if its reference device lacks fp64, lanes other than 1, 4, 8 or 16), or if the
// scene does not fit its memory. It is NULL with no message if the device failed; its Compute has the
// failure.
bool renderers_open(Renderer **renderers, Compute *const *computes, size_t count, const Scene *scene,
                    const RenderSettings *settings, const SceneReceivers *others, MessageList *messages,
                    MessageList *of_each);
// Opens a renderer on one device. Returns NULL with a message if a number of the scene does not fit the
// precision, if the settings do not fit the device or if the scene does not fit its memory, and NULL with no
// message if the device failed.
Renderer *renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                        MessageList *messages);
// Opens a renderer that has no scene on one device. The caller then calls renderer_receive_scene with the
// scene of each pass. Closes `earlier`, NULL or an earlier renderer of the device, and reuses its kernels
// where they suit. Returns NULL with a message if the settings do not fit the device, and NULL with no
// message if the device failed.
Renderer *renderer_open_empty(Compute *compute, const RenderSettings *settings, Renderer *earlier,
                              MessageList *messages);
// Returns the lanes of a pass, or 0 if the renderer does not have that pass.
uint32_t renderer_lanes(Renderer *renderer, PixelPass pass);
// Uploads the compiled scene of the pass and its lanes, and takes ownership of it even on failure. Returns
// false with a message if the scene does not fit the device's memory, and false with no message if the device
// failed.
bool renderer_receive_scene(Renderer *renderer, PixelPass pass, CompiledScene *compiled,
                            MessageList *messages);
// Frees the memory that the scene takes. Only the kernels are left, for a later renderer.
void renderer_release_scene(Renderer *renderer);
void renderer_close(Renderer *renderer);
// Changes the camera, size, region, samples or bounces and, without settings->moves, also the objects,
// materials, lights and BvhChoice. Everything else in `scene` and `settings` must be what the renderer was
// opened with. Textures stay on the device, and so do kernels that suit. Returns false with a message if a
// number of the scene does not fit the precision, if the settings do not fit the device or if the scene does
// not fit its memory; the renderer then still renders its previous scene. Returns false with no message if
// the device failed.
bool renderer_move(Renderer *renderer, const Scene *scene, const RenderSettings *settings,
                   MessageList *messages);

// Returns scene_color_max of the renderer's scene, which must be `scene`.
double renderer_color_max(const Renderer *renderer, const Scene *scene);
// Returns what all bands with the color and the AOVs of the set have in common.
FilmHeader renderer_film_header(const Renderer *renderer, unsigned aovs);
// Renders the color and the AOVs of the set in bands of about band_seconds each. Returns false if the device
// failed, in which case compute_ok returns false, or if settings.stop or the sink ended the render. A failed
// device delivers no further bands.
bool renderer_render(Renderer *renderer, unsigned aovs, BandSink sink, void *context);

// Renders the rows of the queue until none are left. Returns false if the device failed, or if settings.stop
// or the queue ended the render.
bool renderer_work(Renderer *renderer, unsigned aovs, const BandQueue *queue);

// Workers on other machines. They are the last of the scheduler's workers.
typedef struct {
    size_t count;
    // Hands out rows, in the caller's thread, until the image is complete or the render has ended.
    void (*serve)(void *context, Scheduler *scheduler, size_t first_worker);
    WorkerShare *shares; // output, one per worker
    void *context;
} RemoteWorkers;

// The rendering of one image by several renderers.
typedef struct {
    Renderer *const *renderers; // with the same scene and settings, each on a different device
    size_t count;
    unsigned aovs;
    BandSink sink;               // called by the renderers' threads, one at a time
    WorkerDropped dropped;       // receives the renderer's index
    void *context;               // passed to both
    Checkpoint *checkpoint;      // may be NULL
    const RemoteWorkers *remote; // may be NULL
} RenderJob;

// Renders the color and the AOVs of the job's set. Returns false if every device failed, if the checkpoint
// cannot be written or read, or if settings.stop or the sink ended the render.
bool render_job_run(const RenderJob *job);

// Renders the image in passes over all of its pixels, so that a preview sharpens. After the first pass every
// pixel has one sample, and after the last it has all. The AOVs of the set follow the first pass. The final
// image equals renderer_render's bit for bit. A band of AOVs has no color. Returns false if the device
// failed, or if settings.stop or the sink ended the render.
bool renderer_accumulate(Renderer *renderer, unsigned aovs, BandSink sink, void *context);

// Renders the color and the AOVs of the set into one film in double, which film_free frees. Returns false,
// with nothing to free, if the device failed or settings.stop ended the render.
bool renderer_render_film(Renderer *renderer, unsigned aovs, Film *film);

// Finds the closest hits of explicit rays (host/render/trace.h) with the intersection code that renders. The
// report includes neither its launches nor its reads. Returns false if the device failed; `hits` is then
// undefined.
bool renderer_trace(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits);
// Finds the closest hits as renderer_trace does, but faster, because it computes neither reflected and
// refracted rays nor transmission and light.
bool renderer_trace_closest(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits);

// The time of a kernel launch or a transfer.
typedef struct {
    const char *name; // "render", "aov", "path", "coverage", "re-render", "read-back"
    LaunchTime time;
} NamedLaunch;

typedef struct {
    const Device *device;
    const Device *reference_device; // re-renders flagged pixels at `certified`; NULL if `device` does
    FeatureSet features;
    uint32_t lanes;
    bool is_double; // whether the structs are in double
    uint64_t kernel_hash;
    double flatten_seconds, bvh_seconds, build_seconds, upload_seconds;
    bool build_from_cache;     // whether every program came from the cache
    const char *build_options; // the kernels' options, before those of the device
    bool is_out_of_line;       // whether a driver could not build a kernel with its functions inlined
    uint64_t rays[RAYS_COUNT]; // by RAYS_… (kernels/types.h), if settings.counting
    struct {
        NamedLaunch *items;
        size_t count, capacity;
    } launches, reads;
    struct {
        HostSpan *items; // a build has its kernel's name
        size_t count, capacity;
    } builds, bands;
    WorkerShare share; // in the last render
} RenderReport;
const RenderReport *renderer_report(const Renderer *renderer);

// Returns, if settings.hashes_scene, the hash of all passes' arrays, their unit and the samples' offsets. It
// excludes the BVH and the order that it gives the primitives, since they do not change the image.
uint64_t renderer_scene_hash(const Renderer *renderer);

// Returns the composed text of the kernel that renders, for other compilers. The caller frees it.
char *renderer_kernel_text(const Renderer *renderer);
// Returns the hash of that text, which the report contains once the kernel is built.
uint64_t renderer_kernel_hash(const Renderer *renderer);
// Clears launches, reads, bands and counted rays, so that the next render has its own report.
void renderer_report_restart(Renderer *renderer);
