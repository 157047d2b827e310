// The settings of an image, or of explicit rays, and of the passes in which it is rendered.
#pragma once

#include "host/compile/settings.h"
#include "host/opencl/compute.h"
#include <stdbool.h>
#include <stdint.h>

enum { SAMPLES_MAX = 1 << 20, LANES_MAX = 16 };

// The largest injected error is 8192 ulp (kernels/numerics/perturb.h). Times this it is below 2^23 ulp, so
// that an injected error stays below one binade.
enum { PERTURB_SCALE_MAX = 1000 };

// glint-mpi sends these settings to other processes, all but the three pointers.
typedef struct {
    // The image.
    uint32_t width, height;                                   // of the whole image
    uint32_t region_x, region_y, region_width, region_height; // the part of it to render
    // Above 1, only one pixel per square of cell x cell pixels is rendered, in color, with no AOVs. The
    // squares begin at region_x, region_y, and there are region_width x region_height of them. At most 4096.
    uint32_t cell;

    // The samples of a pixel and their rays.
    uint32_t sample_count; // per pixel, at least 1
    // Renders samples first_sample .. end_sample - 1 alone, as part of an image whose other samples another
    // scene has; an end_sample of 0 means sample_count. Unless they include the last, colors are their sum,
    // else their sum over sample_count. Both are 0 for renderer_accumulate.
    uint32_t first_sample, end_sample;
    uint32_t bounce_count; // the limit per camera ray, 0..BOUNCES_MAX
    // Reflected and refracted rays whose weight in a pixel is below this in all channels are not traced; 0
    // traces all.
    double min_contribution;

    // The kernels.
    Precision precision;
    uint32_t lanes; // rays per work-item: 1, 4, 8 or 16, or 0 for the choice of device_lanes
    bool counting;  // counts the image's rays, not those of AOVs, by type in a slower build
    bool no_cache;

    // The compilation of the scene.
    BvhChoice bvh;
    InstanceChoice instances;
    bool shift_to_eye; // makes the eye the origin, for images; false for explicit rays
    bool hashes_scene; // computes renderer_scene_hash
    bool moves;        // keeps the flat arrays in the host's memory, so that renderer_move is fast
    // With `moves`, renderer_move leaves the arrays as they are for the last eye, which takes no time. Their
    // roundings are then relative to that eye's distance from the surfaces.
    bool is_preview;

    // The course of the render.
    double band_seconds;         // the target duration of a launch; 0 means 0.1
    bool (*stop)(void *context); // called between launches, ends the render by returning true; may be NULL
    void *stop_context;
    Stage *stage; // shows the progress before the first launch; may be NULL

    // Only tests and measurements set these.
    FeatureSet extra_features; // built in beyond the scene's own
    // Unless 0, injects rounding errors that OpenCL permits (kernels/numerics/perturb.h).
    uint32_t perturb_seed;
    uint32_t perturb_scale; // multiplies those errors, up to PERTURB_SCALE_MAX; 0 means 1
    uint32_t band_rows;     // a fixed number of rows per band; 0 sizes bands by time
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

// Returns how many columns and rows of the image one rendered pixel stands for.
static inline uint32_t settings_cell(const RenderSettings *settings)
{
    return settings->cell > 0 ? settings->cell : 1;
}

// Returns the index behind the last sample that is rendered.
static inline uint32_t samples_end(const RenderSettings *settings)
{
    return settings->end_sample > 0 ? settings->end_sample : settings->sample_count;
}

// Returns how many samples of each pixel are rendered.
static inline uint32_t samples_rendered(const RenderSettings *settings)
{
    return samples_end(settings) - settings->first_sample;
}

// Returns false with a message if the settings do not fit the device.
bool settings_fit(const RenderSettings *settings, const Compute *compute, MessageList *messages);

// The pixels that a pass renders. The first pass renders all of them. At `certified`, the second renders the
// flagged ones in double precision with bounds, and the third those that remain uncertified as at `double`.
typedef enum { PASS_ALL, PASS_FLAGGED, PASS_UNCERTIFIED, PASS_COUNT } PixelPass;

// Returns the settings of one pass of an image.
RenderSettings settings_of_pass(const RenderSettings *settings, PixelPass pass);

// The inputs of a scene's compilation in addition to the settings. Devices with the same lanes read the same
// arrays.
typedef struct {
    PixelPass pass;
    uint32_t lanes;
} SceneVariant;

// Returns the settings with which a variant of an image's scene is compiled.
CompileSettings settings_of_variant(const RenderSettings *settings, SceneVariant variant);
