// A scene on a device: flattened, uploaded, rendered in bands, or probed with explicit rays.
// The only room that joins scene and opencl.
#pragma once

#include "host/compile/settings.h"
#include "host/opencl/compute.h"
#include "host/render/film.h"
#include "host/render/trace.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t width, height;                                   // of the whole picture
    uint32_t region_x, region_y, region_width, region_height; // what is rendered of it
    uint32_t sample_count;                                    // per pixel, >= 1
    uint32_t bounce_count;                                    // of a ray, at most; 0..16
    Precision precision;
    uint32_t lanes; // 1, 4, 8, 16; 0: the device's own choice
    BvhChoice bvh;
    bool counting;             // count rays by kind, with a build of its own: never time such a run
    uint32_t perturb_seed;     // not 0: a build that errs as devices may (kernels/numerics/perturb.h)
    uint32_t perturb_scale;    // times as much, at most PERTURB_SCALE_LARGEST; 0: once
    FeatureSet extra_features; // built in though the scene does not need them, for tests
    bool shift_to_eye;         // true for pictures; false for probes: rays and scene as they are
    bool no_cache;
    double band_seconds; // aim for a launch's length; 0: 0.1
    bool (*stop)(void);  // asked between launches whether to end early; NULL: never
    uint32_t band_rows;  // fixed number of rows in a band (tests); 0: by time
} RenderSettings;

// Beyond this an error could reach the next power of two but one.
enum { PERTURB_SCALE_LARGEST = 1000 };

typedef struct Renderer Renderer;

// Flattens and uploads; kernels are built when first used. NULL with a message: the settings do not fit the
// device (double without fp64, lanes not 1, 4, 8 or 16) or a number of the scene does not fit the precision.
// NULL without one: the device failed, see Compute. The compute outlives it.
Renderer *renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                        MessageList *messages);
void renderer_close(Renderer *renderer);

// Called for each band from the top, whose layers are valid until it returns; returns false to stop.
typedef bool (*BandSink)(void *context, const Film *band, double fraction_done);

// Renders the color and the AOVs of the set in bands of about band_seconds each. False: the device failed
// (compute_ok says so), else settings.stop or the sink ended it. A failed device delivers no further band.
bool renderer_render(Renderer *renderer, unsigned aovs, BandSink sink, void *context);
// The same into one film in double, which film_free frees. False: the device failed, or settings.stop ended
// it; there is nothing to free.
bool renderer_render_film(Renderer *renderer, unsigned aovs, Film *film);

// Closest hits of explicit rays (host/render/trace.h), by the same intersection code that renders. False: the
// device failed, and `hits` are undefined.
bool renderer_trace(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits);

// A kernel's launch, or a transfer.
typedef struct {
    const char *name; // "render", "aov", "path", "trace", "read-back"
    LaunchTime time;
} NamedLaunch;

typedef struct {
    FeatureSet features;
    uint32_t lanes;
    bool wide; // structs in double
    uint64_t kernel_hash;
    double flatten_seconds, bvh_seconds, build_seconds, upload_seconds;
    bool build_from_cache; // every program was
    uint64_t rays[5];      // of each RAYS_… (kernels/types.h); counted only where asked for
    struct {
        NamedLaunch *items;
        size_t count, capacity;
    } launches, reads;
} RenderReport;
const RenderReport *renderer_report(const Renderer *renderer);
// Forgets launches, reads and counted rays, so that the next picture has a report of its own.
void renderer_report_restart(Renderer *renderer);
