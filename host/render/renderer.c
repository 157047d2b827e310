// Opens renderers and gives them scenes. A scene is compiled once for all renderers that read the same
// arrays.
#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/compile/compile.h"
#include "host/render/arithmetic.h"
#include "host/render/renderer_state.h"
#include "host/render/sample_pattern.h"
#include <stdlib.h>
#include <string.h>

static bool settings_fit(const RenderSettings *settings, const Compute *compute, MessageList *messages)
{
    const Device *device = compute->device;
    uint32_t lanes = settings->lanes;
    if (lanes != 0 && lanes != 1 && lanes != 4 && lanes != 8 && lanes != 16)
        return message_error(messages, "lanes must be 1, 4, 8 or 16, not %u", lanes);
    if (settings->bounce_count > BOUNCES_MAX)
        return message_error(messages, "bounces must be at most %d, not %u", BOUNCES_MAX,
                             settings->bounce_count);
    if (settings->perturb_scale > PERTURB_SCALE_MAX)
        return message_error(messages, "errors can be at most %d times as large, not %u", PERTURB_SCALE_MAX,
                             settings->perturb_scale);
    if (device->embedded_profile &&
        (settings->precision == PRECISION_STRICT || settings->precision == PRECISION_CERTIFIED))
        return message_error(messages,
                             "precision %s: the device \"%s\" has the embedded profile, whose divisions and "
                             "square roots may be less exact than the precision assumes",
                             precision_names[settings->precision], device->name);
    if (settings->precision == PRECISION_DOUBLE && !device->fp64)
        return message_error(messages, "precision double: the device \"%s\" has no 64-bit floating point%s",
                             device->name, device_fp64_hint(device));
    if (settings->precision == PRECISION_CERTIFIED && settings->perturb_scale > 1)
        return message_error(
            messages,
            "precision certified: its bounds cover errors of the size that devices have, not %u times that",
            settings->perturb_scale);
    if (settings->precision == PRECISION_CERTIFIED && !device->fp64 && !compute->reference)
        return message_error(
            messages,
            "precision certified needs 64-bit floating point, which the device \"%s\" lacks, and "
            "no other device works in double for it%s",
            device->name, device_fp64_hint(device));
    return true;
}

static void sample_offsets_upload(Renderer *renderer)
{
    const uint32_t count = renderer->settings.sample_count;
    const size_t size = 2 * count * renderer_scalar_size(renderer);
    void *offsets = sample_pattern(count, renderer->report.is_double);
    if (renderer->scene.hashes) renderer->scene.hash = hash_bytes(renderer->scene.hash, offsets, size);
    buffer_release(renderer->sample_offsets);
    renderer->sample_offsets = buffer_create(renderer->compute, size, offsets, CL_MEM_READ_ONLY);
    free(offsets);
}

static CompileSettings compile_settings(const RenderSettings *settings, SceneVariant variant)
{
    return (CompileSettings){
        .width = settings->width,
        .height = settings->height,
        .sample_count = settings->sample_count,
        .bounce_count = settings->bounce_count,
        .min_contribution = settings->min_contribution,
        .precision = settings->precision,
        .certifies = settings->precision == PRECISION_CERTIFIED || variant.pass == PASS_FLAGGED,
        .lanes = variant.lanes,
        .bvh = settings->bvh,
        .instances = settings->instances,
        .extra_features = settings->extra_features,
        .shift_to_eye = settings->shift_to_eye,
        .hashes_primitives = settings->hashes_scene,
        .is_preview = settings->is_preview,
        .stage = settings->stage,
    };
}

// Returns the settings of one pass of an image.
static RenderSettings pass_settings(const RenderSettings *settings, PixelPass pass)
{
    RenderSettings of_pass = *settings;
    if (pass == PASS_ALL) return of_pass;
    of_pass.precision = PRECISION_DOUBLE;
    of_pass.counting = false;
    return of_pass;
}

bool renderer_certifies(const Renderer *renderer)
{
    return renderer->settings.precision == PRECISION_CERTIFIED || renderer->pass == PASS_FLAGGED;
}

static Renderer *prepare(Compute *compute, const RenderSettings *settings, PixelPass pass, Renderer *earlier)
{
    Renderer *renderer = memory_allocate_zeroed(1, sizeof *renderer);
    renderer->compute = compute;
    renderer->pass = pass;
    renderer->settings = pass_settings(settings, pass);
    RenderReport *report = &renderer->report;
    report->build_from_cache = true;
    if (earlier && settings->first_sample > 0) { // it rendered earlier samples of the image
        *report = earlier->report;
        earlier->report = (RenderReport){0};
    }
    report->device = compute->device;
    report->reference_device = compute->reference ? compute->reference->device : NULL;
    report->is_double = renderer->settings.precision == PRECISION_DOUBLE;
    report->lanes = device_lanes(compute->device, report->is_double, settings->lanes);
    renderer->scene = (DeviceScene){.compute = compute,
                                    .is_double = report->is_double,
                                    .moves = settings->moves,
                                    .hashes = settings->hashes_scene,
                                    .hash = HASH_START};
    renderer->passport =
        arithmetic_passport(compute, renderer->settings.precision, report->lanes, settings->no_cache);
    if (earlier) renderer_kernels_adopt(renderer, earlier);
    if (renderer_certifies(renderer))
        renderer->next_pass =
            prepare(compute_in_double(compute), settings, pass + 1, earlier ? earlier->next_pass : NULL);
    return renderer;
}

Renderer *renderer_open_empty(Compute *compute, const RenderSettings *settings, Renderer *earlier,
                              MessageList *messages)
{
    Renderer *renderer = NULL;
    stage_begin(settings->stage, "measuring the device's arithmetic", NULL, 0);
    if (compute_ok(compute) && settings_fit(settings, compute, messages) &&
        arithmetic_suits(compute, settings, messages))
        renderer = prepare(compute, settings, PASS_ALL, earlier);
    renderer_close(earlier);
    return renderer;
}

// Returns the renderer of a pass, or NULL if there is no such pass.
static Renderer *of_pass(Renderer *renderer, PixelPass pass)
{
    while (renderer && renderer->pass != pass)
        renderer = renderer->next_pass;
    return renderer;
}

uint32_t renderer_lanes(Renderer *renderer, PixelPass pass)
{
    renderer = of_pass(renderer, pass);
    return renderer ? renderer->report.lanes : 0;
}

// Updates everything that depends on the compiled scene.
static void scene_changed(Renderer *renderer)
{
    const CompiledScene *compiled = &renderer->scene.compiled;
    renderer->report.features = compiled->features;
    renderer->report.flatten_seconds += compiled->flatten_seconds;
    renderer->report.bvh_seconds += compiled->bvh_seconds;
    renderer->report.upload_seconds += renderer->scene.upload_seconds;
    sample_offsets_upload(renderer);
    renderer_kernels_choose(renderer);
}

// Uploads the scene to the renderers of its variant, on whose devices it fits, and takes ownership of it.
static void scene_upload(Renderer *const *renderers, size_t count, CompiledScene *compiled)
{
    DeviceScene **scenes = memory_allocate(count, sizeof *scenes);
    for (size_t i = 0; i < count; i++)
        scenes[i] = &renderers[i]->scene;
    if (count > 0) stage_begin(renderers[0]->settings.stage, "uploading the scene", NULL, 0);
    device_scenes_receive(scenes, count, compiled);
    for (size_t i = 0; i < count; i++)
        scene_changed(renderers[i]);
    free(scenes);
}

bool renderer_receive_scene(Renderer *renderer, PixelPass pass, CompiledScene *compiled,
                            MessageList *messages)
{
    Renderer *receiver = of_pass(renderer, pass);
    const bool has_room = device_scene_has_room(&receiver->scene, compiled, messages);
    scene_upload(&receiver, has_room, compiled);
    return has_room && compute_check_reference(renderer->compute);
}

// Finds the renderers of a variant. Closes those on whose devices the scene does not fit.
static size_t receivers_find(Renderer **receivers, Renderer **renderers, size_t count, SceneVariant variant,
                             const CompiledScene *compiled, MessageList *of_each)
{
    size_t taker_count = 0;
    for (size_t i = 0; i < count; i++) {
        if (renderer_lanes(renderers[i], variant.pass) != variant.lanes) continue;
        receivers[taker_count] = of_pass(renderers[i], variant.pass);
        if (device_scene_has_room(&receivers[taker_count]->scene, compiled, &of_each[i])) {
            taker_count++;
        } else {
            renderer_close(renderers[i]);
            renderers[i] = NULL;
        }
    }
    return taker_count;
}

static bool variant_is_needed(SceneVariant variant, Renderer *const *renderers, size_t count,
                              const SceneReceivers *others)
{
    bool is_needed = others && others->needs(others->context, variant);
    for (size_t i = 0; i < count; i++)
        is_needed = is_needed || renderer_lanes(renderers[i], variant.pass) == variant.lanes;
    return is_needed;
}

// Compiles the scene for each variant that is needed. Returns false with a message if the scene cannot be
// compiled.
static bool variants_compile(Renderer **renderers, size_t count, const Scene *scene,
                             const RenderSettings *settings, const SceneReceivers *others,
                             MessageList *messages, MessageList *of_each)
{
    Renderer **receivers = memory_allocate(count, sizeof *receivers);
    bool compiles = true;
    for (PixelPass pass = PASS_ALL; pass < PASS_COUNT && compiles; pass++)
        for (uint32_t lanes = 1; lanes <= LANES_MAX && compiles; lanes *= 2) {
            const SceneVariant variant = {pass, lanes};
            if (!variant_is_needed(variant, renderers, count, others)) continue;
            const RenderSettings of_pass = pass_settings(settings, pass);
            const CompileSettings compiling = compile_settings(&of_pass, variant);
            CompiledScene compiled;
            compiles = scene_compile(&compiled, scene, &compiling, messages);
            if (!compiles) break;
            if (others) others->send(others->context, variant, &compiled);
            scene_upload(receivers, receivers_find(receivers, renderers, count, variant, &compiled, of_each),
                         &compiled);
        }
    free(receivers);
    return compiles;
}

bool renderers_open(Renderer **renderers, Compute *const *computes, size_t count, const Scene *scene,
                    const RenderSettings *settings, const SceneReceivers *others, MessageList *messages,
                    MessageList *of_each)
{
    RenderSettings shared = *settings;
    shared.moves = settings->moves && count == 1; // several renderers share the arrays, and none keeps them
    for (size_t i = 0; i < count; i++)
        renderers[i] = renderer_open_empty(computes[i], &shared, renderers[i], &of_each[i]);
    const bool compiles = variants_compile(renderers, count, scene, &shared, others, messages, of_each);
    for (size_t i = 0; i < count; i++) {
        if (compiles && compute_check_reference(computes[i])) continue;
        renderer_close(renderers[i]);
        renderers[i] = NULL;
    }
    return compiles;
}

Renderer *renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                        MessageList *messages)
{
    Renderer *renderer = NULL;
    return renderers_open(&renderer, &compute, 1, scene, settings, NULL, messages, messages) ? renderer
                                                                                             : NULL;
}

// Recompiles the scene or moves it. Returns false with a message, and with nothing changed that kernels read,
// if the scene cannot be compiled or does not fit the device.
static bool scene_assign(Renderer *renderer, const Scene *scene, const RenderSettings *settings,
                         MessageList *messages)
{
    CompiledScene *compiled = &renderer->scene.compiled, fresh;
    CompileSettings compiling =
        compile_settings(settings, (SceneVariant){renderer->pass, renderer->report.lanes});
    compiling.textures = compiled->textures;
    if (renderer->settings.moves) return scene_move(compiled, scene, &compiling, messages);
    if (!scene_compile(&fresh, scene, &compiling, messages)) return false;
    const bool has_room = device_scene_has_room(&renderer->scene, &fresh, messages);
    compiled_scene_free(has_room ? compiled : &fresh);
    if (has_room) *compiled = fresh;
    return has_room;
}

bool renderer_move(Renderer *renderer, const Scene *scene, const RenderSettings *settings,
                   MessageList *messages)
{
    const RenderSettings of_pass = pass_settings(settings, renderer->pass);
    if (!compute_ok(renderer->compute) || !settings_fit(&of_pass, renderer->compute, messages) ||
        !scene_assign(renderer, scene, &of_pass, messages))
        return false;
    RenderReport *report = &renderer->report;
    renderer->settings = of_pass;
    report->upload_seconds = report->flatten_seconds = report->bvh_seconds = 0;
    stage_begin(of_pass.stage, "uploading the scene", NULL, 0);
    device_scene_update(&renderer->scene);
    scene_changed(renderer); // another eye may need another feature, or a deeper stack
    return compute_ok(renderer->compute) &&
           (!renderer->next_pass || renderer_move(renderer->next_pass, scene, settings, messages)) &&
           compute_check_reference(renderer->compute);
}

uint64_t renderer_scene_hash(const Renderer *renderer)
{
    uint64_t hash = HASH_START;
    for (; renderer; renderer = renderer->next_pass)
        hash = hash_bytes(hash, &renderer->scene.hash, sizeof renderer->scene.hash);
    return hash;
}

void renderer_release_scene(Renderer *renderer)
{
    for (; renderer; renderer = renderer->next_pass) {
        device_scene_release(&renderer->scene);
        buffer_release(renderer->sample_offsets);
        renderer->sample_offsets = NULL;
        while (renderer->spares.count > 0)
            buffer_release(renderer->spares.items[--renderer->spares.count]);
    }
}

void renderer_close(Renderer *renderer)
{
    if (!renderer) return;
    renderer_release_scene(renderer);
    renderer_close(renderer->next_pass);
    renderer_kernels_close(renderer);
    free(renderer->report.launches.items);
    free(renderer->report.reads.items);
    free(renderer->report.builds.items);
    free(renderer->report.bands.items);
    free(renderer->spares.items);
    free(renderer);
}

double renderer_color_max(const Renderer *renderer, const Scene *scene)
{
    return scene_color_max(&renderer->scene.compiled, scene, renderer->settings.bounce_count);
}

size_t renderer_scalar_size(const Renderer *renderer)
{
    return renderer->report.is_double ? sizeof(double) : sizeof(float);
}

void *renderer_map(Renderer *renderer, cl_mem buffer, size_t begin, size_t size, cl_map_flags access)
{
    Compute *compute = renderer->compute;
    if (!compute_ok(compute)) return NULL;
    double start = clock_seconds();
    cl_event event = NULL;
    cl_int status;
    fault_record_call("clEnqueueMapBuffer");
    void *mapped =
        clEnqueueMapBuffer(compute->queue, buffer, CL_FALSE, access, begin, size, 0, NULL, &event, &status);
    if (!compute_check_object(compute, mapped, status, "clEnqueueMapBuffer")) {
        if (event) clReleaseEvent(event);
        return NULL;
    }
    NamedLaunch read = {"read-back", event_time(compute, event, "clEnqueueMapBuffer", start)};
    array_push(renderer->report.reads, read);
    return mapped;
}

bool renderer_read(Renderer *renderer, cl_mem buffer, size_t begin, size_t size, void *bytes)
{
    Compute *compute = renderer->compute;
    if (!compute_ok(compute)) return false;
    const double start = clock_seconds();
    cl_event event = NULL;
    if (!compute_try(compute, clEnqueueReadBuffer(compute->queue, buffer, CL_FALSE, begin, size, bytes, 0,
                                                  NULL, &event)))
        return false;
    NamedLaunch read = {"read-back", event_time(compute, event, "clEnqueueReadBuffer", start)};
    array_push(renderer->report.reads, read);
    return compute_ok(compute);
}

void renderer_unmap(Renderer *renderer, cl_mem buffer, const void *mapped)
{
    if (mapped) compute_unmap(renderer->compute, buffer, mapped);
}

const RenderReport *renderer_report(const Renderer *renderer)
{
    return &renderer->report;
}

void renderer_report_restart(Renderer *renderer)
{
    RenderReport *report = &renderer->report;
    report->launches.count = report->reads.count = report->bands.count = 0;
    memset(report->rays, 0, sizeof report->rays);
}
