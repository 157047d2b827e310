#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/compile/compile.h"
#include "host/render/renderer_state.h"
#include "host/render/sample_pattern.h"
#include <stdlib.h>
#include <string.h>

static bool settings_fit(const RenderSettings *settings, const Device *device, MessageList *messages)
{
    uint32_t lanes = settings->lanes;
    if (lanes != 0 && lanes != 1 && lanes != 4 && lanes != 8 && lanes != 16) {
        message_add(messages, MESSAGE_ERROR, "lanes must be 1, 4, 8 or 16, not %u", lanes);
        return false;
    }
    if (settings->bounce_count > BOUNCES_MAX) {
        message_add(messages, MESSAGE_ERROR, "bounces must be at most %d, not %u", BOUNCES_MAX,
                    settings->bounce_count);
        return false;
    }
    if (settings->perturb_scale > PERTURB_SCALE_MAX) {
        message_add(messages, MESSAGE_ERROR, "errors can be at most %d times as large, not %u",
                    PERTURB_SCALE_MAX, settings->perturb_scale);
        return false;
    }
    if (settings->precision == PRECISION_DOUBLE && !device->fp64) {
        message_add(messages, MESSAGE_ERROR,
                    "precision double: the device \"%s\" has no 64-bit floating point", device->name);
        return false;
    }
    if (settings->precision == PRECISION_CERTIFIED && settings->perturb_scale > 1) {
        message_add(
            messages, MESSAGE_ERROR,
            "precision certified: its bounds cover errors of the size that devices have, not %u times that",
            settings->perturb_scale);
        return false;
    }
    if (settings->precision == PRECISION_CERTIFIED && !device->fp64) {
        message_add(messages, MESSAGE_ERROR,
                    "precision certified needs 64-bit floating point, which the device \"%s\" lacks",
                    device->name);
        return false;
    }
    return true;
}

// False with a message where the arrays exceed the memory that the device reports; if it does not, buffers
// fail when they are created.
static bool device_has_room(const CompiledScene *compiled, const Device *device, bool is_double,
                            MessageList *messages)
{
    size_t sum = 0, largest = 0;
    for (size_t kind = 0; kind < FLAT_COUNT; kind++) {
        size_t size = flat_array_size(&compiled->arrays[kind], is_double);
        sum += size;
        if (size > largest) largest = size;
    }
    bool is_known = device->memory_bytes > 0 && device->largest_buffer_bytes > 0;
    if (!is_known || (sum <= device->memory_bytes && largest <= device->largest_buffer_bytes)) return true;
    const double mebi = 1024.0 * 1024.0;
    message_add(messages, MESSAGE_ERROR,
                "the scene needs %.1f MiB on the device, %.1f MiB of it in one buffer; the device \"%s\" has "
                "%.1f MiB, and at most %.1f MiB in one buffer",
                (double)sum / mebi, (double)largest / mebi, device->name, (double)device->memory_bytes / mebi,
                (double)device->largest_buffer_bytes / mebi);
    return false;
}

// Whether scene_move leaves an array as it is, and does not read it.
static bool is_without_eye(size_t kind)
{
    return kind == FLAT_TRIANGLE_NORMALS || kind == FLAT_TRIANGLE_UVS || kind == FLAT_TEXTURE_LEVELS ||
           kind == FLAT_TEXELS;
}

static void array_upload(Renderer *renderer, size_t kind)
{
    Compute *compute = renderer->compute;
    const FlatArray *array = &renderer->compiled.arrays[kind];
    const bool is_double = renderer->report.is_double;
    const size_t size = flat_array_size(array, is_double);
    if (renderer->arrays[kind] && renderer->array_sizes[kind] == size) {
        void *mapped = buffer_map(compute, renderer->arrays[kind], size);
        if (!mapped) return;
        flat_array_write(array, is_double, mapped);
        buffer_write_mapped(compute, renderer->arrays[kind], mapped);
        return;
    }
    void *bytes = buffer_bytes_allocate(size);
    flat_array_write(array, is_double, bytes);
    if (renderer->settings.hashes_scene && kind != FLAT_NODES)
        renderer->report.scene_hash = hash_bytes(renderer->report.scene_hash, bytes, size);
    buffer_release(renderer->arrays[kind]);
    renderer->arrays[kind] = buffer_take(compute, size, bytes);
    renderer->array_sizes[kind] = size;
}

// The arrays that have changed. Frees each host array after its upload, so that the scene is never in memory
// twice, unless the renderer moves.
static void upload(Renderer *renderer)
{
    CompiledScene *compiled = &renderer->compiled;
    if (renderer->settings.hashes_scene) // lengths are restored with it
        renderer->report.scene_hash =
            hash_bytes(renderer->report.scene_hash, &compiled->unit, sizeof compiled->unit);
    for (size_t kind = 0; kind < FLAT_COUNT; kind++) {
        if (compiled->changed[kind]) array_upload(renderer, kind);
        compiled->changed[kind] = false;
        if (renderer->settings.moves && !is_without_eye(kind)) continue;
        free(compiled->arrays[kind].items);
        compiled->arrays[kind].items = NULL;
    }
}

static void offsets_upload(Renderer *renderer)
{
    const uint32_t count = renderer->settings.sample_count;
    const size_t size = 2 * count * renderer_scalar_size(renderer);
    void *offsets = sample_pattern(count, renderer->report.is_double);
    if (renderer->settings.hashes_scene)
        renderer->report.scene_hash = hash_bytes(renderer->report.scene_hash, offsets, size);
    buffer_release(renderer->offsets);
    renderer->offsets = buffer_create(renderer->compute, size, offsets, CL_MEM_READ_ONLY);
    free(offsets);
}

bool renderer_certifies(const Renderer *renderer, const RenderSettings *settings)
{
    return settings->precision == PRECISION_CERTIFIED || renderer->repeats == REPEATS_IN_DOUBT;
}

static CompileSettings compile_settings(const RenderSettings *settings, uint32_t lanes)
{
    return (CompileSettings){
        .width = settings->width,
        .height = settings->height,
        .sample_count = settings->sample_count,
        .bounce_count = settings->bounce_count,
        .precision = settings->precision,
        .certifies = settings->precision == PRECISION_CERTIFIED,
        .lanes = lanes,
        .bvh = settings->bvh,
        .extra_features = settings->extra_features,
        .shift_to_eye = settings->shift_to_eye,
        .is_preview = settings->is_preview,
        .stage = settings->stage,
    };
}

bool renderer_compile(CompiledScene *compiled, const Scene *scene, const RenderSettings *settings,
                      MessageList *messages)
{
    const CompileSettings compile = compile_settings(settings, settings->lanes);
    return scene_compile(compiled, scene, &compile, messages);
}

// Takes a compiled scene if the device has room for it; else frees it. False with a message.
static bool compiled_take(Renderer *renderer, CompiledScene *fresh, bool is_double, MessageList *messages)
{
    CompiledScene *compiled = &renderer->compiled;
    const bool has_room = device_has_room(fresh, renderer->compute->device, is_double, messages);
    compiled_scene_free(has_room ? compiled : fresh);
    if (has_room) *compiled = *fresh;
    return has_room;
}

// For the first time, or for another camera. False with a message.
static bool compile(Renderer *renderer, const Scene *scene, const CompileSettings *settings,
                    MessageList *messages)
{
    if (renderer->settings.moves) return scene_move(&renderer->compiled, scene, settings, messages);
    CompiledScene fresh;
    return scene_compile(&fresh, scene, settings, messages) &&
           compiled_take(renderer, &fresh, settings->precision == PRECISION_DOUBLE, messages);
}

// Uploads the compiled scene. False: the device failed.
static bool compiled_upload(Renderer *renderer, const RenderSettings *settings, uint32_t lanes,
                            size_t light_count)
{
    const CompiledScene *compiled = &renderer->compiled;
    renderer->settings = *settings;
    renderer->light_count = light_count;
    renderer->report.features = compiled->features;
    renderer->report.lanes = lanes;
    renderer->report.is_double = settings->precision == PRECISION_DOUBLE;
    renderer->report.flatten_seconds = compiled->flatten_seconds;
    renderer->report.bvh_seconds = compiled->bvh_seconds;
    double start = clock_seconds();
    stage_begin(settings->stage, "uploading the scene", NULL, 0);
    upload(renderer);
    offsets_upload(renderer);
    renderer->report.upload_seconds = clock_seconds() - start;
    return compute_ok(renderer->compute);
}

// Compiles and uploads the scene. False as renderer_open, with nothing changed that kernels read.
static bool scene_assign(Renderer *renderer, const Scene *scene, const RenderSettings *settings,
                         MessageList *messages)
{
    const bool is_double = settings->precision == PRECISION_DOUBLE;
    const uint32_t lanes =
        settings->lanes ? settings->lanes : device_lanes(renderer->compute->device, is_double);
    CompileSettings compiling = compile_settings(settings, lanes);
    compiling.certifies = renderer_certifies(renderer, settings);
    compiling.textures = renderer->compiled.textures;
    return compile(renderer, scene, &compiling, messages) &&
           compiled_upload(renderer, settings, lanes, scene->lights.count);
}

static Renderer *renderer_make(Compute *compute, PixelRepeats repeats)
{
    Renderer *renderer = memory_allocate_zeroed(1, sizeof *renderer);
    renderer->compute = compute;
    renderer->repeats = repeats;
    renderer->report.device = compute->device;
    renderer->report.build_from_cache = true;
    renderer->report.scene_hash = HASH_START;
    return renderer;
}

// The renderer where its scene is on the device, else NULL.
static Renderer *renderer_finish(Renderer *renderer, bool is_ready)
{
    if (!is_ready) {
        renderer_close(renderer);
        return NULL;
    }
    renderer_kernels_choose(renderer);
    return renderer;
}

// Those of the renderer that repeats pixels for one of `settings`.
static RenderSettings repeat_settings(const RenderSettings *settings)
{
    RenderSettings repeat = *settings;
    repeat.precision = PRECISION_DOUBLE;
    repeat.counting = false;
    return repeat;
}

// As renderer_open; with the renderer that repeats what this one leaves in doubt.
static Renderer *renderer_open_for(Compute *compute, const Scene *scene, const RenderSettings *settings,
                                   PixelRepeats repeats, MessageList *messages)
{
    if (!compute_ok(compute) || !settings_fit(settings, compute->device, messages)) return NULL;
    Renderer *renderer = renderer_make(compute, repeats);
    bool is_ready = scene_assign(renderer, scene, settings, messages);
    if (is_ready && renderer_certifies(renderer, settings)) {
        const RenderSettings repeat = repeat_settings(settings);
        renderer->repeat = renderer_open_for(compute, scene, &repeat, repeats + 1, messages);
        is_ready = renderer->repeat != NULL;
        if (is_ready) // a scene may differ in what floats do not show
            renderer->report.scene_hash = hash_bytes(renderer->report.scene_hash,
                                                     &renderer->repeat->report.scene_hash, sizeof(uint64_t));
    }
    return renderer_finish(renderer, is_ready);
}

Renderer *renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                        MessageList *messages)
{
    return renderer_open_for(compute, scene, settings, REPEATS_NONE, messages);
}

Renderer *renderer_open_compiled(Compute *compute, CompiledScene *compiled, size_t light_count,
                                 const RenderSettings *settings, MessageList *messages)
{
    if (!compute_ok(compute) || !settings_fit(settings, compute->device, messages)) {
        compiled_scene_free(compiled);
        return NULL;
    }
    if (settings->precision == PRECISION_CERTIFIED) {
        message_add(messages, MESSAGE_ERROR, "glint-mpi does not support precision certified");
        compiled_scene_free(compiled);
        return NULL;
    }
    Renderer *renderer = renderer_make(compute, REPEATS_NONE);
    const bool is_double = settings->precision == PRECISION_DOUBLE;
    return renderer_finish(renderer, compiled_take(renderer, compiled, is_double, messages) &&
                                         compiled_upload(renderer, settings, settings->lanes, light_count));
}

bool renderer_move(Renderer *renderer, const Scene *scene, const RenderSettings *settings,
                   MessageList *messages)
{
    if (!compute_ok(renderer->compute) || !settings_fit(settings, renderer->compute->device, messages) ||
        !scene_assign(renderer, scene, settings, messages))
        return false;
    if (renderer->repeat) {
        const RenderSettings repeat = repeat_settings(settings);
        if (!renderer_move(renderer->repeat, scene, &repeat, messages)) return false;
    }
    renderer_kernels_choose(renderer); // another eye may need another feature, or a deeper stack
    return true;
}

void renderer_close(Renderer *renderer)
{
    if (!renderer) return;
    renderer_close(renderer->repeat);
    renderer_kernels_close(renderer);
    for (size_t kind = 0; kind < FLAT_COUNT; kind++)
        buffer_release(renderer->arrays[kind]);
    buffer_release(renderer->offsets);
    compiled_scene_free(&renderer->compiled);
    free(renderer->report.launches.items);
    free(renderer->report.reads.items);
    free(renderer);
}

size_t renderer_scalar_size(const Renderer *renderer)
{
    return renderer->report.is_double ? sizeof(double) : sizeof(float);
}

void *renderer_map(Renderer *renderer, cl_mem buffer, size_t size)
{
    Compute *compute = renderer->compute;
    if (!compute_ok(compute)) return NULL;
    double start = clock_seconds();
    cl_event event = NULL;
    cl_int status;
    fault_note_call("clEnqueueMapBuffer");
    void *mapped =
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
    if (mapped) compute_unmap(renderer->compute, buffer, mapped);
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
