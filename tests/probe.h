// Provides the renderer as tests use it, with one device for the whole program, chosen as glint chooses its
// default.
#pragma once

#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/compile/features.h"
#include "host/opencl/compose.h"
#include "host/render/arithmetic.h"
#include "host/render/renderer.h"
#include "tests/check.h"
#include "tests/film.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static DeviceList probe_devices;
static Compute probe_compute;
// The renderers of probe_shared_renderer by precision and lanes.
static Renderer *probe_renderers[PRECISION_COUNT][LANES_MAX + 1];

// The number of the call of stop_now that stops a render.
static unsigned stop_countdown;

// A RenderSettings.stop.
static inline bool stop_now(void *context)
{
    (void)context;
    if (stop_countdown > 0) stop_countdown--;
    return stop_countdown == 0;
}

// cmocka's group setup and teardown. The teardown fails if a call of OpenCL failed.
static inline int probe_open(void **state)
{
    (void)state;
    OwnedMessageList messages = {0};
    device_list_open(&probe_devices, NULL);
    const Device *device = device_choose(&probe_devices, getenv("GLINT_DEVICE"), &messages);
    message_list_print(&messages, stderr);
    if (device == NULL) return -1;
    return compute_open(&probe_compute, device) ? 0 : -1;
}

static inline int probe_close(void **state)
{
    (void)state;
    const bool ok = compute_ok(&probe_compute);
    if (!ok) {
        OWNED char *failure = compute_failure_text(&probe_compute);
        fprintf(stderr, "%s\n", failure);
    }
    for (size_t i = 0; i < PRECISION_COUNT * (LANES_MAX + 1); i++)
        renderer_close(probe_renderers[i / (LANES_MAX + 1)][i % (LANES_MAX + 1)]);
    compute_close(&probe_compute);
    device_list_close(&probe_devices);
    return ok ? 0 : -1;
}

static inline const Passport *probe_passport(void)
{
    return arithmetic_passport(&probe_compute, PRECISION_SINGLE, device_lanes(probe_compute.device, false, 0),
                               false);
}

// Returns the least precision whose error bounds hold, and at which the same operations give the same bits
// everywhere in a kernel: `single`, which glint renders at on any device, unless its arithmetic is broken.
// PoCL on 32-bit x86 rounds a number once or twice, depending on whether its compiler keeps it in an x87
// register or in memory.
static inline Precision probe_sound_from(void)
{
    OwnedText broken = {0};
    const Passport *passport = probe_passport();
    const bool is_sound = passport && !passport_broken(passport, &broken);
    return is_sound ? PRECISION_SINGLE : PRECISION_STRICT;
}

// Returns the least precision at which every build of a kernel must give the same bits, probe_sound_from's
// unless the device's quotients or roots are inexact. Then a compiler may choose another approximation in
// another build. At `single` an NVIDIA H100 gives other bits at one lane than at four.
static inline Precision probe_same_bits_from(void)
{
    const Passport *passport = probe_passport();
    const bool is_exact = passport && passport->quotients.wrong_count + passport->roots.wrong_count == 0;
    return is_exact ? probe_sound_from() : PRECISION_STRICT;
}

// Returns whether the device has the precision. If a passport refuses it, prints the reason.
static inline bool probe_has(Precision precision)
{
    const RenderSettings settings = settings_of_image(1, 1, precision);
    return (precision < PRECISION_DOUBLE || probe_compute.device->fp64) &&
           !arithmetic_is_refused(&probe_compute, &settings);
}

// Opens a renderer as renderer_reopen does. Skips the test if the device's arithmetic is refused, and fails
// it if the renderer does not open otherwise.
static inline Renderer *probe_reopen(Renderer *earlier, const Scene *scene, const RenderSettings *settings)
{
    skip_if_refused(&probe_compute, settings);
    OwnedMessageList messages = {0};
    Renderer *renderer = renderer_reopen(earlier, &probe_compute, scene, settings, &messages);
    message_list_print(&messages, stderr);
    assert_non_null(renderer);
    return renderer;
}

static inline Renderer *probe_renderer(const Scene *scene, const RenderSettings *settings)
{
    return probe_reopen(NULL, scene, settings);
}

// Returns a renderer that probe_close, or the next call with the precision and lanes, closes. Its kernels
// serve scene after scene.
static inline Renderer *probe_shared_renderer(const Scene *scene, const RenderSettings *settings)
{
    Renderer **shared = &probe_renderers[settings->precision][settings->lanes], *earlier = *shared;
    *shared = NULL;
    return *shared = probe_reopen(earlier, scene, settings);
}

// Builds a program of the test's kernels, which may include the shipped ones, with every feature. Unless the
// seed is 0, errors are injected, which `strict` repairs.
static inline cl_program probe_program(const char *text, uint32_t lanes, Precision precision, bool has_fma,
                                       uint32_t perturb_seed, const char *options)
{
    OwnedText prelude = {0};
    text_appendf(&prelude,
                 "#define LANES %u\n#define IS_STRICT %d\n#define IS_DOUBLE %d\n#define HAS_FMA %d\n"
                 "#define PERTURB %d\n#define REPAIRS_DIVIDE %d\n#define PERTURB_SEED %uu\n"
                 "#define PERTURB_SCALE 1\n#define IS_CERTIFIED 0\n#define IS_PIXEL_LIST 0\n"
                 "#define IS_COUNTING 0\n#define PENDING_MAX 1\n#define STACK_CAPACITY 40\n",
                 lanes, precision == PRECISION_STRICT, precision == PRECISION_DOUBLE, has_fma,
                 perturb_seed != 0, perturb_seed != 0 && precision == PRECISION_STRICT, perturb_seed);
    features_write_prelude(&prelude, FEATURE_ALL);
    size_t file_count = 0;
    while (kernel_files[file_count].name)
        file_count++;
    OWNED EmbeddedFile *files = memory_allocate_zeroed(file_count + 2, sizeof *files);
    memcpy(files, kernel_files, file_count * sizeof *files);
    files[file_count] = (EmbeddedFile){"probe.cl", text};
    OWNED char *composed = kernel_compose(files, "probe.cl", text_c(&prelude));
    if (composed == NULL) fault("a test's kernel cannot be composed");
    const char *source = composed;
    cl_int status;
    cl_program program = clCreateProgramWithSource(probe_compute.context, 1, &source, NULL, &status);
    compute_check_object(&probe_compute, program, status, "clCreateProgramWithSource");
    compute_try(&probe_compute, clBuildProgram(program, 1, &probe_compute.device->id, options, NULL, NULL));
    return program;
}

static inline cl_kernel probe_kernel(cl_program program, const char *name)
{
    cl_int status;
    cl_kernel kernel = clCreateKernel(program, name, &status);
    compute_check_object(&probe_compute, kernel, status, "clCreateKernel");
    return kernel;
}

// Finds closest hits with every feature built in, so that one program serves all scenes. Returns false if the
// device cannot.
static inline bool probe_trace(const Scene *scene, Precision precision, uint32_t lanes, const TraceRay *rays,
                               size_t count, TraceHit *hits)
{
    RenderSettings settings = settings_of_image(1, 1, precision);
    settings.lanes = lanes;
    settings.extra_features = FEATURE_ALL;
    return renderer_trace(probe_shared_renderer(scene, &settings), rays, count, hits);
}
