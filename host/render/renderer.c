#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/memory.h"
#include "host/compile/bvh_flatten.h"
#include "host/compile/contact.h"
#include "host/compile/culling.h"
#include "host/compile/textures.h"
#include "host/render/renderer_state.h"
#include "host/scene/transform.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const precision_names[PRECISION_COUNT] = {"fast", "single", "strict", "double"};

const char *const bvh_choice_names[BVH_CHOICE_COUNT] = {"auto", "on", "off"};

// From so many bounded primitives on the hierarchy is faster than the plain loop.
enum { BVH_WORTHWHILE = 24 };

static const struct {
    const char *file, *name;
} kernel_sources[KERNEL_COUNT] = {
    [KERNEL_RENDER] = {"render.cl", "render"},
    [KERNEL_AOV] = {"aov.cl", "aov"},
    [KERNEL_PATH] = {"path.cl", "path"},
    [KERNEL_TRACE] = {"trace.cl", "trace"},
};

static bool settings_fit(const RenderSettings *settings, const Device *device, MessageList *messages)
{
    uint32_t lanes = settings->lanes;
    if (lanes != 0 && lanes != 1 && lanes != 4 && lanes != 8 && lanes != 16) {
        message_add(messages, MESSAGE_ERROR, "lanes must be 1, 4, 8 or 16, not %u", lanes);
        return false;
    }
    if (settings->bounce_count > BOUNCES_LARGEST) {
        message_add(messages, MESSAGE_ERROR, "bounces must be at most %d, not %u", BOUNCES_LARGEST,
                    settings->bounce_count);
        return false;
    }
    if (settings->perturb_scale > PERTURB_SCALE_LARGEST) {
        message_add(messages, MESSAGE_ERROR, "errors can be at most %d times as large, not %u",
                    PERTURB_SCALE_LARGEST, settings->perturb_scale);
        return false;
    }
    if (settings->precision == PRECISION_DOUBLE && !device->fp64) {
        message_add(messages, MESSAGE_ERROR,
                    "precision double: the device \"%s\" has no 64-bit floating point", device->name);
        return false;
    }
    return true;
}

// The hierarchy counts with 28 bits.
static bool scene_is_small_enough(const Scene *scene, MessageList *messages)
{
    const size_t largest = (size_t)1 << 28;
    size_t count = scene_primitive_count(scene);
    if (count <= largest) return true;
    message_add(messages, MESSAGE_ERROR, "the scene has %zu objects and triangles, more than %zu", count,
                largest);
    return false;
}

static bool array_is_finite(const FlatArray *array, bool wide)
{
    double largest = wide ? INFINITY : 3.4028234663852886e38;
    for (size_t i = 0; i < array->count; i++) {
        const double *numbers =
            (const double *)(const void *)((const char *)array->items + i * array->layout.size);
        for (size_t k = 0; k < 4 * array->layout.scalar4_count; k++)
            if (!(fabs(numbers[k]) <= largest) || isinf(numbers[k])) return false;
    }
    return true;
}

static bool scene_fits(const CompiledScene *flat, const Renderer *renderer, MessageList *messages)
{
    for (size_t kind = 0; kind < FLAT_COUNT; kind++) {
        if (array_is_finite(&flat->arrays[kind], renderer->report.wide)) continue;
        message_add(messages, MESSAGE_ERROR,
                    "a number of the scene does not fit precision %s: its magnitude is beyond %s",
                    precision_names[renderer->settings.precision],
                    renderer->report.wide ? "1.8e308" : "3.4e38");
        return false;
    }
    return true;
}

static double distance_largest(Vector3 from, Vector3 to)
{
    return vector_largest(vector_subtract(to, from));
}

// The unit of lengths on the device. In float a torus a trillion units large, or a trillionth, is lost, as
// the third and fourth powers of lengths overflow or vanish; other shapes are at 1e19 and 1e-19. So where the
// farthest point lies beyond 2^30, or within 2^-30, lengths are counted so that it and the smallest object
// lie on the two sides of 1. Powers of two are exact: the picture is that of the scene as it is.
static double scene_unit(const Scene *scene, const RenderSettings *settings)
{
    const int kept = 30; // exponents up to there are no trouble
    Vector3 eye = settings->shift_to_eye ? scene->camera.position : (Vector3){0};
    size_t unbounded_count;
    Bounds bounds = scene_bounds(scene, &unbounded_count);
    if (settings->precision == PRECISION_DOUBLE || bounds_is_empty(&bounds)) return 1;
    int farthest, smallest;
    frexp(fmax(distance_largest(eye, bounds.min), distance_largest(eye, bounds.max)), &farthest);
    if (abs(farthest) <= kept) return 1;
    frexp(scene_smallest_size(scene), &smallest);
    int middle = (farthest + smallest) / 2;
    return farthest > 0 && middle < 0 ? 1 : ldexp(1, middle);
}

// Whether the squared way to each light fits a float.
static bool lights_are_near_enough(const Scene *scene, const Renderer *renderer, MessageList *messages)
{
    const double farthest = 1e18;
    Vector3 eye = renderer->settings.shift_to_eye ? scene->camera.position : (Vector3){0};
    if (renderer->report.wide) return true;
    for (size_t i = 0; i < scene->lights.count; i++) {
        const Light *light = &scene->lights.items[i];
        double away = distance_largest(eye, light->position);
        if (light->kind == LIGHT_DIRECTIONAL || away <= farthest) continue;
        message_add(
            messages, MESSAGE_ERROR,
            "a light lies %.3g from the eye, farther than precision %s can square (%.3g): a directional "
            "light shines from as far, and double sees it",
            away * renderer->unit, precision_names[renderer->settings.precision], farthest * renderer->unit);
        return false;
    }
    return true;
}

// Whether the device has room for the arrays, as far as it says.
static bool device_has_room(const CompiledScene *flat, const Renderer *renderer, MessageList *messages)
{
    const Device *device = renderer->compute->device;
    size_t sum = 0, largest = 0;
    for (size_t kind = 0; kind < FLAT_COUNT; kind++) {
        size_t size = flat_array_size(&flat->arrays[kind], renderer->report.wide);
        sum += size;
        if (size > largest) largest = size;
    }
    if (sum <= device->memory_bytes && largest <= device->largest_buffer_bytes) return true;
    const double mebi = 1024.0 * 1024.0;
    message_add(messages, MESSAGE_ERROR,
                "the scene needs %.1f MiB on the device, %.1f MiB of it in one buffer; the device \"%s\" has "
                "%.1f MiB, and at most %.1f MiB in one buffer",
                (double)sum / mebi, (double)largest / mebi, device->name, (double)device->memory_bytes / mebi,
                (double)device->largest_buffer_bytes / mebi);
    return false;
}

// Frees each array of the host as it goes, so that no two copies of all of them exist.
static void upload(Renderer *renderer, CompiledScene *flat)
{
    bool wide = renderer->report.wide;
    for (size_t kind = 0; kind < FLAT_COUNT; kind++) {
        size_t size = flat_array_size(&flat->arrays[kind], wide);
        void *bytes = buffer_bytes_allocate(size);
        flat_array_write(&flat->arrays[kind], wide, bytes);
        free(flat->arrays[kind].items);
        flat->arrays[kind].items = NULL;
        renderer->arrays[kind] = buffer_take(renderer->compute, size, bytes);
    }
}

// Everything that tells one variant of the kernel text from another.
static void prelude_write(Renderer *renderer)
{
    Precision precision = renderer->settings.precision;
    uint32_t seed = renderer->settings.perturb_seed, scale = renderer->settings.perturb_scale;
    const Device *device = renderer->compute->device;
    // errors are repaired, as on a device that makes them
    bool correct = device->correctly_rounded && seed == 0;
    // of doubles it is asked for; Intel's runtime for CPUs does not tell of it, but has vectors, which
    // llvmpipe and Oclgrind do not tell of
    bool has_fma = renderer->report.wide || device->fma_in_hardware || device->native_float_width > 1;
    Text *text = &renderer->prelude;
    text_appendf(text, "#define LANES %u\n", renderer->report.lanes);
    text_appendf(text, "#define IS_FAST %d\n", precision == PRECISION_FAST);
    text_appendf(text, "#define IS_STRICT %d\n", precision == PRECISION_STRICT);
    text_appendf(text, "#define IS_DOUBLE %d\n", precision == PRECISION_DOUBLE);
    text_appendf(text, "#define REPAIRS_DIVIDE %d\n", precision == PRECISION_STRICT && !correct);
    text_appendf(text, "#define HAS_FMA %d\n", has_fma);
    text_appendf(text, "#define IS_COUNTING %d\n", renderer->settings.counting);
    text_appendf(text, "#define PERTURB %d\n", seed != 0);
    text_appendf(text, "#define PERTURB_SEED %uu\n", seed);
    text_appendf(text, "#define PERTURB_SCALE %u\n", scale > 0 ? scale : 1);
    features_write_prelude(text, renderer->report.features);

    renderer->options = "-cl-std=CL1.2";
    if (precision == PRECISION_FAST) renderer->options = "-cl-std=CL1.2 -cl-fast-relaxed-math";
    if (precision == PRECISION_STRICT && correct)
        renderer->options = "-cl-std=CL1.2 -cl-fp32-correctly-rounded-divide-sqrt";
}

// Makes the flat arrays, in the scene's unit, and the renderer's unit; false, without arrays, on a user's
// fault.
static bool scene_lay(CompiledScene *flat, const Scene *scene, Renderer *renderer, MessageList *messages)
{
    const RenderSettings *settings = &renderer->settings;
    double start = clock_seconds();
    renderer->unit = scene_unit(scene, settings);
    Scene scaled = {0};
    if (renderer->unit != 1) {
        scaled = scene_scaled(scene, 1 / renderer->unit);
        scene = &scaled;
    }
    bool lit = lights_are_near_enough(scene, renderer, messages), whole = false;
    if (lit) {
        const FlattenSettings flattening = {settings->width,        settings->height,
                                            settings->sample_count, settings->bounce_count,
                                            settings->shift_to_eye, renderer->report.wide};
        flatten(flat, scene, &flattening);
        whole = textures_load(flat, scene, &flattening, messages) && scene_fits(flat, renderer, messages);
        if (whole && renderer->report.features & FEATURE_TRANSMISSION) contact_find(flat);
        if (!whole) compiled_scene_free(flat);
    }
    scene_scaled_free(&scaled);
    renderer->report.flatten_seconds = clock_seconds() - start;
    return whole;
}

Renderer *renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                        MessageList *messages)
{
    if (!compute_ok(compute) || !settings_fit(settings, compute->device, messages) ||
        !scene_is_small_enough(scene, messages))
        return NULL;
    Renderer *renderer = memory_allocate_zeroed(1, sizeof *renderer);
    renderer->compute = compute;
    renderer->settings = *settings;
    renderer->light_count = scene->lights.count;
    RenderReport *report = &renderer->report;
    report->wide = settings->precision == PRECISION_DOUBLE;
    report->lanes = settings->lanes ? settings->lanes : device_lanes(compute->device, report->wide);
    report->features = features_of(scene) | settings->extra_features;
    report->build_from_cache = true;

    CompiledScene flat;
    if (!scene_lay(&flat, scene, renderer, messages)) {
        free(renderer);
        return NULL;
    }
    size_t bounded_count = bounded_primitive_count(&flat);
    bool hangs = settings->bvh == BVH_ON || (settings->bvh == BVH_AUTO && bounded_count >= BVH_WORTHWHILE);
    if (hangs && bounded_count > 0) {
        double start = clock_seconds();
        bvh_flatten(&flat, report->lanes);
        report->features |= FEATURE_BVH;
        report->bvh_seconds = clock_seconds() - start;
    }
    double start = clock_seconds();
    culling_fill(&flat, report->wide);
    report->flatten_seconds += clock_seconds() - start;
    if (!device_has_room(&flat, renderer, messages)) {
        compiled_scene_free(&flat);
        free(renderer);
        return NULL;
    }
    start = clock_seconds();
    upload(renderer, &flat);
    report->upload_seconds = clock_seconds() - start;
    compiled_scene_free(&flat);
    if (!compute_ok(compute)) {
        renderer_close(renderer);
        return NULL;
    }
    prelude_write(renderer);
    return renderer;
}

void renderer_close(Renderer *renderer)
{
    if (!renderer) return;
    for (size_t kind = 0; kind < KERNEL_COUNT; kind++) {
        KernelSlot *slot = &renderer->kernels[kind];
        if (slot->kernel) {
            // it has been launched: its program's binary holds finished machine code
            program_store(renderer->compute, &slot->request, &slot->program);
            clReleaseKernel(slot->kernel);
        }
        program_close(&slot->program);
    }
    for (size_t kind = 0; kind < FLAT_COUNT; kind++)
        buffer_release(renderer->arrays[kind]);
    text_free(&renderer->prelude);
    free(renderer->report.launches.items);
    free(renderer->report.reads.items);
    free(renderer);
}

size_t renderer_scalar_size(const Renderer *renderer)
{
    return renderer->report.wide ? sizeof(double) : sizeof(float);
}

cl_kernel renderer_kernel(Renderer *renderer, KernelKind kind)
{
    KernelSlot *slot = &renderer->kernels[kind];
    if (slot->kernel) return slot->kernel;
    slot->request = (ProgramRequest){
        .root = kernel_sources[kind].file,
        .prelude = text_c(&renderer->prelude),
        .options = renderer->options,
        .no_cache = renderer->settings.no_cache,
    };
    program_build(renderer->compute, &slot->request, &slot->program);
    // the picture's own kernel is the one that reports name
    if (kind != KERNEL_AOV && kind != KERNEL_PATH) renderer->report.kernel_hash = slot->program.text_hash;
    renderer->report.build_seconds += slot->program.build_seconds;
    renderer->report.build_from_cache &= slot->program.from_cache;
    slot->kernel = program_kernel(renderer->compute, &slot->program, kernel_sources[kind].name);
    for (cl_uint i = 0; i < FLAT_COUNT; i++)
        kernel_argument(renderer->compute, slot->kernel, i, sizeof(cl_mem), &renderer->arrays[i]);
    return slot->kernel;
}

LaunchTime renderer_launch(Renderer *renderer, KernelKind kind, cl_uint dimensions, const size_t *items,
                           const size_t *group)
{
    KernelSlot *slot = &renderer->kernels[kind];
    LaunchTime time = kernel_launch(renderer->compute, slot->kernel, dimensions, items, group);
    array_push(renderer->report.launches, ((NamedLaunch){kernel_sources[kind].name, time}));
    return time;
}

const void *renderer_map(Renderer *renderer, cl_mem buffer, size_t size)
{
    Compute *compute = renderer->compute;
    if (!compute_ok(compute)) return NULL;
    double start = clock_seconds();
    cl_event event = NULL;
    cl_int status;
    const void *mapped =
        clEnqueueMapBuffer(compute->queue, buffer, CL_FALSE, CL_MAP_READ, 0, size, 0, NULL, &event, &status);
    if (!compute_check_object(compute, mapped, status, "clEnqueueMapBuffer")) {
        if (event) clReleaseEvent(event);
        return NULL;
    }
    NamedLaunch read = {"read-back", event_time(compute, event, "clEnqueueMapBuffer", start)};
    array_push(renderer->report.reads, read);
    return mapped;
}

void renderer_unmap(Renderer *renderer, cl_mem buffer, const void *mapped)
{
    if (!mapped) return;
    cl_int status =
        clEnqueueUnmapMemObject(renderer->compute->queue, buffer, (void *)(uintptr_t)mapped, 0, NULL, NULL);
    compute_check(renderer->compute, status, "clEnqueueUnmapMemObject");
}

const RenderReport *renderer_report(const Renderer *renderer)
{
    return &renderer->report;
}

void renderer_report_restart(Renderer *renderer)
{
    RenderReport *report = &renderer->report;
    report->launches.count = report->reads.count = 0;
    memset(report->rays, 0, sizeof report->rays);
}
