#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/compile/compile.h"
#include "host/render/renderer_state.h"
#include "host/render/sample_pattern.h"
#include <stdlib.h>
#include <string.h>

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

static void scene_arguments_set(const Renderer *renderer, cl_kernel kernel)
{
    for (cl_uint i = 0; i < FLAT_COUNT; i++)
        kernel_argument(renderer->compute, kernel, i, sizeof(cl_mem), &renderer->arrays[i]);
}

static bool certifies(const Renderer *renderer, const RenderSettings *settings)
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
    compiling.certifies = certifies(renderer, settings);
    compiling.textures = renderer->compiled.textures;
    return compile(renderer, scene, &compiling, messages) &&
           compiled_upload(renderer, settings, lanes, scene->lights.count);
}

// At least `count`: few sizes, so that few kernels are built. Most scenes are served by `usual`, which is
// doubled for the others.
static uint32_t capacity_for(uint32_t count, uint32_t usual)
{
    while (usual < count)
        usual *= 2;
    return usual;
}

// Refracted rays that wait while reflected ones are traced, up to one per depth.
static uint32_t pending_max(const Renderer *renderer)
{
    if (!(renderer->report.features & FEATURE_TRANSMISSION)) return 1;
    return capacity_for(renderer->settings.bounce_count, 8);
}

static void variant_close(Renderer *renderer, KernelVariant *variant)
{
    for (size_t kind = 0; kind < KERNEL_COUNT; kind++) {
        KernelSlot *slot = &variant->kernels[kind];
        if (slot->kernel) {
            // it has been launched: its program's binary holds finished machine code
            program_store(renderer->compute, &slot->request, &slot->program);
            clReleaseKernel(slot->kernel);
        }
        program_close(&slot->program);
    }
    text_free(&variant->prelude);
    *variant = (KernelVariant){0};
}

// The definitions and compiler options that distinguish the variants of the kernels.
static void variant_set(Renderer *renderer)
{
    Precision precision = renderer->settings.precision;
    uint32_t seed = renderer->settings.perturb_seed, scale = renderer->settings.perturb_scale;
    const Device *device = renderer->compute->device;
    // injected errors make the device count as not correctly rounded, so that strict repairs them
    bool correct = device->correctly_rounded && seed == 0;
    // OpenCL requires fma of doubles; Intel's CPU runtime does not report it for floats, but reports native
    // vectors, unlike llvmpipe and Oclgrind
    bool has_fma = renderer->report.is_double || device->fma_in_hardware || device->native_float_width > 1;
    Text prelude = {0}, *text = &prelude;
    text_appendf(text, "#define LANES %u\n", renderer->report.lanes);
    text_appendf(text, "#define IS_FAST %d\n", precision == PRECISION_FAST);
    text_appendf(text, "#define IS_STRICT %d\n", precision == PRECISION_STRICT);
    text_appendf(text, "#define IS_DOUBLE %d\n", precision == PRECISION_DOUBLE);
    text_appendf(text, "#define IS_CERTIFIED %d\n", certifies(renderer, &renderer->settings));
    text_appendf(text, "#define IS_PIXEL_LIST %d\n", renderer->repeats != REPEATS_NONE);
    text_appendf(text, "#define REPAIRS_DIVIDE %d\n", precision == PRECISION_STRICT && !correct);
    text_appendf(text, "#define HAS_FMA %d\n", has_fma);
    text_appendf(text, "#define PENDING_MAX %u\n", pending_max(renderer));
    // a million primitives in nodes of four children need 34: a GPU may keep as many for each of its threads
    text_appendf(text, "#define STACK_CAPACITY %u\n",
                 capacity_for(renderer->compiled.pending_children_max, 40));
    text_appendf(text, "#define IS_COUNTING %d\n", renderer->settings.counting);
    text_appendf(text, "#define PERTURB %d\n", seed != 0);
    text_appendf(text, "#define PERTURB_SEED %uu\n", seed);
    text_appendf(text, "#define PERTURB_SCALE %u\n", scale > 0 ? scale : 1);
    features_write_prelude(text, renderer->report.features);
    if (strcmp(text_c(&prelude), text_c(&renderer->variant.prelude)) != 0) {
        const KernelVariant variant = renderer->variant;
        renderer->variant = renderer->other_variant;
        renderer->other_variant = variant;
    }
    if (strcmp(text_c(&prelude), text_c(&renderer->variant.prelude)) == 0) {
        text_free(&prelude);
    } else {
        variant_close(renderer, &renderer->variant);
        renderer->variant = (KernelVariant){.prelude = prelude, .options = "-cl-std=CL1.2"};
        if (precision == PRECISION_FAST) renderer->variant.options = "-cl-std=CL1.2 -cl-fast-relaxed-math";
        if (precision == PRECISION_STRICT && correct)
            renderer->variant.options = "-cl-std=CL1.2 -cl-fp32-correctly-rounded-divide-sqrt";
    }
    for (size_t kind = 0; kind < KERNEL_COUNT; kind++)
        if (renderer->variant.kernels[kind].kernel)
            scene_arguments_set(renderer, renderer->variant.kernels[kind].kernel);
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
    variant_set(renderer);
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
    if (is_ready && certifies(renderer, settings)) {
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
    variant_set(renderer); // another eye may need another feature, or a deeper stack
    return true;
}

void renderer_close(Renderer *renderer)
{
    if (!renderer) return;
    renderer_close(renderer->repeat);
    variant_close(renderer, &renderer->variant);
    variant_close(renderer, &renderer->other_variant);
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

char *renderer_kernel_text(const Renderer *renderer)
{
    return program_text(kernel_sources[KERNEL_RENDER].file, text_c(&renderer->variant.prelude));
}

uint64_t renderer_kernel_hash(const Renderer *renderer)
{
    char *text = renderer_kernel_text(renderer);
    uint64_t hash = hash_bytes(HASH_START, text, strlen(text));
    free(text);
    return hash;
}

cl_kernel renderer_kernel(Renderer *renderer, KernelKind kind)
{
    KernelSlot *slot = &renderer->variant.kernels[kind];
    // AOV kernels do not change the hash that identifies an image
    const bool is_of_image = kind != KERNEL_AOV && kind != KERNEL_PATH;
    if (slot->kernel) {
        if (is_of_image) renderer->report.kernel_hash = slot->program.text_hash;
        return slot->kernel;
    }
    slot->request = (ProgramRequest){
        .root = kernel_sources[kind].file,
        .prelude = text_c(&renderer->variant.prelude),
        .options = renderer->variant.options,
        .no_cache = renderer->settings.no_cache,
    };
    program_build(renderer->compute, &slot->request, &slot->program);
    if (is_of_image) renderer->report.kernel_hash = slot->program.text_hash;
    renderer->report.build_seconds += slot->program.build_seconds;
    renderer->report.build_from_cache &= slot->program.from_cache;
    slot->kernel = program_kernel(renderer->compute, &slot->program, kernel_sources[kind].name);
    scene_arguments_set(renderer, slot->kernel);
    return slot->kernel;
}

LaunchTime renderer_launch(Renderer *renderer, KernelKind kind, cl_uint dimensions, const size_t *items,
                           const size_t *group)
{
    KernelSlot *slot = &renderer->variant.kernels[kind];
    LaunchTime time = kernel_launch(renderer->compute, slot->kernel, dimensions, items, group);
    array_push(renderer->report.launches, ((NamedLaunch){kernel_sources[kind].name, time}));
    return time;
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
