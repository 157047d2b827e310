#include "host/render/pass.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/compile/compile.h"
#include "host/compile/features.h"
#include "host/render/arithmetic.h"
#include "host/render/launch_range.h"
#include "host/render/sample_pattern.h"
#include <stdlib.h>

void pass_open(Pass *pass, PixelPass type, Compute *compute, const RenderSettings *settings,
               RenderReport *report)
{
    const RenderSettings pass_settings = settings_of_pass(settings, type);
    const bool is_double = pass_settings.precision == PRECISION_DOUBLE;
    *pass = (Pass){.type = type, .compute = compute, .settings = pass_settings, .report = report};
    pass->lanes = device_lanes(compute->device, is_double, pass_settings.lanes);
    pass->certifies = pass_settings.precision == PRECISION_CERTIFIED || type == PASS_FLAGGED;
    pass->passport =
        arithmetic_passport(compute, pass_settings.precision, pass->lanes, pass_settings.no_cache);
    pass->scene = (DeviceScene){.compute = compute,
                                .is_double = is_double,
                                .moves = pass_settings.moves,
                                .hashes = pass_settings.hashes_scene,
                                .hash = HASH_START};
    pass->kernels = (Kernels){.scene = &pass->scene,
                              .settings = &pass->settings,
                              .report = report,
                              .is_rerender = type != PASS_ALL};
}

void pass_release_scene(Pass *pass)
{
    device_scene_release(&pass->scene);
    buffer_release(pass->sample_offsets);
    pass->sample_offsets = NULL;
    buffer_pool_free(&pass->pool);
}

void pass_close(Pass *pass)
{
    pass_release_scene(pass);
    kernels_close(&pass->kernels);
}

// Returns a capacity of at least `count`. There are few different capacities, so that few kernels are built:
// most scenes get `usual`, which is doubled for the others. A kernel with features that its scene does not
// need serves many scenes and gets twice as much from the start.
static uint32_t capacity_for(const Pass *pass, uint32_t count, uint32_t usual)
{
    if (pass->settings.extra_features) usual *= 2;
    while (usual < count)
        usual *= 2;
    return usual;
}

// Returns how many refracted rays may wait while reflected ones are traced: up to one per depth.
static uint32_t pending_max(const Pass *pass)
{
    if (!(pass->scene.compiled.features & FEATURE_TRANSMISSION)) return 1;
    return capacity_for(pass, pass->settings.bounce_count, 8);
}

// Returns whether kernels repair quotients and roots. Injected errors make the device count as not correctly
// rounded, and so does a promise that the passport refutes. If the device does not promise correct rounding,
// no measurement replaces the promise, because there are too many pairs of mantissas to try.
static bool repairs_divide(const Pass *pass)
{
    return pass->settings.precision == PRECISION_STRICT &&
           (pass->settings.perturb_seed != 0 || !passport_rounds_correctly(pass->passport));
}

// Returns the definitions before the kernels' text.
static Text prelude_of(const Pass *pass, bool is_out_of_line)
{
    const RenderSettings *settings = &pass->settings;
    const Precision precision = settings->precision;
    const uint32_t scale = settings->perturb_scale;
    Text text = {0};
    text_appendf(&text, "#define LANES %u\n", pass->lanes);
    text_appendf(&text, "#define IS_OUT_OF_LINE %d\n", is_out_of_line);
    text_appendf(&text, "#define IS_STRICT %d\n", precision == PRECISION_STRICT);
    text_appendf(&text, "#define IS_DOUBLE %d\n", precision == PRECISION_DOUBLE);
    text_appendf(&text, "#define IS_CERTIFIED %d\n", pass->certifies);
    text_appendf(&text, "#define IS_PIXEL_LIST %d\n", pass->type != PASS_ALL);
    text_appendf(&text, "#define REPAIRS_DIVIDE %d\n", repairs_divide(pass));
    text_appendf(&text, "#define HAS_FMA %d\n", pass->passport->uses_fma);
    text_appendf(&text, "#define PENDING_MAX %u\n", pending_max(pass));
    // a million primitives in nodes of four children need 34, which a GPU may keep for each of its threads
    text_appendf(&text, "#define STACK_CAPACITY %u\n",
                 capacity_for(pass, pass->scene.compiled.pending_children_max, 40));
    text_appendf(&text, "#define IS_COUNTING %d\n", settings->counting);
    text_appendf(&text, "#define PERTURB %d\n", settings->perturb_seed != 0);
    text_appendf(&text, "#define PERTURB_SEED %uu\n", settings->perturb_seed);
    text_appendf(&text, "#define PERTURB_SCALE %u\n", scale > 0 ? scale : 1);
    features_write_prelude(&text, pass->scene.compiled.features);
    return text;
}

enum { FEATURES_MANY = 8 };

// Returns whether kernels are built with large functions out of line from the start. With every feature
// inlined, a kernel for NVIDIA has 4 MB of PTX, and its compiler takes ten times as long as with them out of
// line (clang 15 and ptxas 12.9: 53 s and 6 s).
static bool starts_out_of_line(const Pass *pass)
{
    return __builtin_popcountll(pass->settings.extra_features) >= FEATURES_MANY && pass->lanes == 1 &&
           (pass->compute->device->type & CL_DEVICE_TYPE_GPU);
}

static void sample_offsets_upload(Pass *pass)
{
    const uint32_t count = pass->settings.sample_count;
    const size_t size = 2 * count * pass_scalar_size(pass);
    OWNED void *offsets = sample_pattern(count, pass->scene.is_double);
    if (pass->scene.hashes) pass->scene.hash = hash_bytes(pass->scene.hash, offsets, size);
    buffer_release(pass->sample_offsets);
    pass->sample_offsets = buffer_create(pass->compute, size, offsets, CL_MEM_READ_ONLY);
}

enum { GROUPS_OF_UNIT_MIN = 4 }; // with fewer, the other compute units would idle while the last group ends

// Sets the target of all paces and the samples with which a launch keeps the device busy.
static void paces_set(Pass *pass)
{
    const double seconds = pass->settings.band_seconds;
    const TileShape group = group_shape(pass);
    for (size_t type = 0; type < KERNEL_COUNT; type++) {
        Pace *pace = &pass->kernels.paces[type];
        pace->target_seconds = seconds > 0 ? seconds : 0.1;
        pace->samples_min =
            (double)GROUPS_OF_UNIT_MIN * pass->compute->device->compute_units * group.width * group.height;
    }
}

// Updates everything that depends on the scene and the settings: another eye may need another feature, or a
// deeper stack.
static void scene_changed(Pass *pass)
{
    const CompiledScene *compiled = &pass->scene.compiled;
    const char *options = passport_build_options(pass->compute->device, pass->passport->mode);
    const bool is_out_of_line = starts_out_of_line(pass), can_be_easier = pass->lanes == 1 && !is_out_of_line;
    sample_offsets_upload(pass);
    kernels_choose(&pass->kernels, prelude_of(pass, is_out_of_line),
                   can_be_easier ? prelude_of(pass, true) : (Text){0}, options);
    paces_set(pass);
    if (pass->type != PASS_ALL) return;
    RenderReport *report = pass->report;
    report->features = compiled->features;
    report->build_options = options;
    report->flatten_seconds += compiled->flatten_seconds;
    report->bvh_seconds += compiled->bvh_seconds;
    report->upload_seconds += pass->scene.upload_seconds;
}

void passes_receive_scene(Pass *const *passes, size_t count, CompiledScene *compiled)
{
    OWNED DeviceScene **scenes = memory_allocate(count, sizeof *scenes);
    for (size_t i = 0; i < count; i++)
        scenes[i] = &passes[i]->scene;
    stage_begin(passes[0]->settings.stage, "uploading the scene", NULL, 0);
    device_scenes_upload(scenes, count, compiled);
    for (size_t i = 0; i < count; i++)
        scene_changed(passes[i]);
}

bool pass_compile(Pass *pass, const Scene *scene, const RenderSettings *settings, CompiledScene *fresh,
                  MessageList *messages)
{
    CompiledScene *compiled = &pass->scene.compiled;
    CompileSettings compiling = settings_of_variant(settings, (SceneVariant){pass->type, pass->lanes});
    compiling.textures = compiled->textures;
    if (pass->scene.moves) return scene_move(compiled, scene, &compiling, messages);
    if (!scene_compile(fresh, scene, &compiling, messages)) return false;
    const bool fits = device_scene_fits(&pass->scene, fresh, messages);
    if (!fits) compiled_scene_free(fresh);
    return fits;
}

void pass_move(Pass *pass, CompiledScene *fresh, const RenderSettings *settings)
{
    RenderReport *report = pass->report;
    if (!pass->scene.moves) {
        compiled_scene_free(&pass->scene.compiled);
        pass->scene.compiled = *fresh;
    }
    pass->settings = settings_of_pass(settings, pass->type);
    if (pass->type == PASS_ALL) report->upload_seconds = report->flatten_seconds = report->bvh_seconds = 0;
    stage_begin(settings->stage, "uploading the scene", NULL, 0);
    device_scenes_upload(&(DeviceScene *){&pass->scene}, 1, &pass->scene.compiled);
    scene_changed(pass);
}

void *pass_map(Pass *pass, cl_mem buffer, size_t begin, size_t size, cl_map_flags access)
{
    Compute *compute = pass->compute;
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
    array_push(pass->report->reads, read);
    return mapped;
}

bool pass_read(Pass *pass, cl_mem buffer, size_t begin, size_t size, void *bytes)
{
    Compute *compute = pass->compute;
    if (!compute_ok(compute)) return false;
    const double start = clock_seconds();
    cl_event event = NULL;
    if (!compute_try(compute, clEnqueueReadBuffer(compute->queue, buffer, CL_FALSE, begin, size, bytes, 0,
                                                  NULL, &event)))
        return false;
    NamedLaunch read = {"read-back", event_time(compute, event, "clEnqueueReadBuffer", start)};
    array_push(pass->report->reads, read);
    return compute_ok(compute);
}
