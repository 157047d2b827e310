// Builds and launches the kernels of a renderer. Variants of a kernel differ in the definitions before their
// text and in compiler options.
#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/hash.h"
#include "host/compile/features.h"
#include "host/opencl/capture.h"
#include "host/render/renderer_state.h"
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *file, *name;
} kernel_sources[KERNEL_COUNT] = {
    [KERNEL_RENDER] = {"render.cl", "render"},    [KERNEL_AOV] = {"aov.cl", "aov"},
    [KERNEL_PATH] = {"path.cl", "path"},          [KERNEL_TRACE] = {"trace.cl", "trace"},
    [KERNEL_CLOSEST] = {"closest.cl", "closest"}, [KERNEL_COVERAGE] = {"coverage.cl", "coverage"},
};

// Returns a capacity of at least `count`. There are few different capacities, so that few kernels are built:
// most scenes get `usual`, which is doubled for the others. A kernel with features that its scene does not
// need serves many scenes and gets twice as much from the start.
static uint32_t capacity_for(const Renderer *renderer, uint32_t count, uint32_t usual)
{
    if (renderer->settings.extra_features) usual *= 2;
    while (usual < count)
        usual *= 2;
    return usual;
}

// Returns how many refracted rays may wait while reflected ones are traced: up to one per depth.
static uint32_t pending_max(const Renderer *renderer)
{
    if (!(renderer->report.features & FEATURE_TRANSMISSION)) return 1;
    return capacity_for(renderer, renderer->settings.bounce_count, 8);
}

static void variant_close(Renderer *renderer, KernelVariant *variant)
{
    for (size_t type = 0; type < KERNEL_COUNT; type++) {
        KernelSlot *slot = &variant->kernels[type];
        if (slot->kernel) {
            // since its launch, its program's binary holds finished machine code
            program_store(renderer->compute, &slot->request, &slot->program);
            clReleaseKernel(slot->kernel);
        }
        program_close(&slot->program);
    }
    text_free(&variant->prelude);
    text_free(&variant->easy_prelude);
    *variant = (KernelVariant){0};
}

void renderer_kernels_adopt(Renderer *renderer, Renderer *earlier)
{
    renderer->variant = earlier->variant;
    renderer->other_variant = earlier->other_variant;
    earlier->variant = earlier->other_variant = (KernelVariant){0};
}

void renderer_kernels_close(Renderer *renderer)
{
    variant_close(renderer, &renderer->variant);
    variant_close(renderer, &renderer->other_variant);
}

// Returns whether kernels repair quotients and roots. Injected errors make the device count as not correctly
// rounded, and so does a promise that the passport refutes. If the device does not promise correct rounding,
// no measurement replaces the promise, because there are too many pairs of mantissas to try.
static bool repairs_divide(const Renderer *renderer)
{
    return renderer->settings.precision == PRECISION_STRICT &&
           (renderer->settings.perturb_seed != 0 || !passport_rounds_correctly(renderer->passport));
}

static void prelude_write(Text *text, const Renderer *renderer, bool is_out_of_line)
{
    const RenderSettings *settings = &renderer->settings;
    const Precision precision = settings->precision;
    const uint32_t scale = settings->perturb_scale;
    text_appendf(text, "#define LANES %u\n", renderer->report.lanes);
    text_appendf(text, "#define IS_OUT_OF_LINE %d\n", is_out_of_line);
    text_appendf(text, "#define IS_STRICT %d\n", precision == PRECISION_STRICT);
    text_appendf(text, "#define IS_DOUBLE %d\n", precision == PRECISION_DOUBLE);
    text_appendf(text, "#define IS_CERTIFIED %d\n", renderer_certifies(renderer));
    text_appendf(text, "#define IS_PIXEL_LIST %d\n", renderer->pass != PASS_ALL);
    text_appendf(text, "#define REPAIRS_DIVIDE %d\n", repairs_divide(renderer));
    text_appendf(text, "#define HAS_FMA %d\n", renderer->passport->uses_fma);
    text_appendf(text, "#define PENDING_MAX %u\n", pending_max(renderer));
    // a million primitives in nodes of four children need 34, which a GPU may keep for each of its threads
    text_appendf(text, "#define STACK_CAPACITY %u\n",
                 capacity_for(renderer, renderer->scene.compiled.pending_children_max, 40));
    text_appendf(text, "#define IS_COUNTING %d\n", settings->counting);
    text_appendf(text, "#define PERTURB %d\n", settings->perturb_seed != 0);
    text_appendf(text, "#define PERTURB_SEED %uu\n", settings->perturb_seed);
    text_appendf(text, "#define PERTURB_SCALE %u\n", scale > 0 ? scale : 1);
    features_write_prelude(text, renderer->report.features);
}

static const char *build_options(const Renderer *renderer)
{
    return passport_build_options(renderer->compute->device, renderer->passport->mode);
}

static bool variant_has(const KernelVariant *variant, const Text *prelude)
{
    return strcmp(text_c(prelude), text_c(&variant->prelude)) == 0;
}

enum { FEATURES_MANY = 8 };

// Returns whether kernels are built with large functions out of line from the start. With every feature
// inlined, a kernel for NVIDIA has 4 MB of PTX, and its compiler takes ten times as long as with them out of
// line (clang 15 and ptxas 12.9: 53 s and 6 s).
static bool starts_out_of_line(const Renderer *renderer)
{
    return __builtin_popcountll(renderer->settings.extra_features) >= FEATURES_MANY &&
           renderer->report.lanes == 1 && (renderer->compute->device->type & CL_DEVICE_TYPE_GPU);
}

void renderer_kernels_choose(Renderer *renderer)
{
    const bool is_out_of_line = starts_out_of_line(renderer);
    Text prelude = {0};
    prelude_write(&prelude, renderer, is_out_of_line);
    if (!variant_has(&renderer->variant, &prelude)) {
        const KernelVariant variant = renderer->variant;
        renderer->variant = renderer->other_variant;
        renderer->other_variant = variant;
    }
    if (variant_has(&renderer->variant, &prelude)) {
        text_free(&prelude);
    } else {
        variant_close(renderer, &renderer->variant);
        renderer->variant = (KernelVariant){.prelude = prelude, .options = build_options(renderer)};
        if (renderer->report.lanes == 1 && !is_out_of_line)
            prelude_write(&renderer->variant.easy_prelude, renderer, true);
        memset(renderer->paces, 0, sizeof renderer->paces);
    }
    renderer->report.build_options = renderer->variant.options;
    for (size_t type = 0; type < KERNEL_COUNT; type++)
        if (renderer->variant.kernels[type].kernel)
            device_scene_set_arguments(&renderer->scene, renderer->variant.kernels[type].kernel);
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

cl_kernel renderer_kernel(Renderer *renderer, KernelType type)
{
    KernelSlot *slot = &renderer->variant.kernels[type];
    // AOV kernels do not change the hash that identifies an image
    const bool is_of_image = type != KERNEL_AOV && type != KERNEL_PATH && type != KERNEL_COVERAGE;
    if (slot->kernel) {
        if (is_of_image) renderer->report.kernel_hash = slot->program.text_hash;
        return slot->kernel;
    }
    slot->request = (ProgramRequest){
        .root = kernel_sources[type].file,
        .prelude = text_c(&renderer->variant.prelude),
        .easy_prelude = renderer->variant.easy_prelude.items,
        .kernel = kernel_sources[type].name,
        .options = renderer->variant.options,
        .no_cache = renderer->settings.no_cache,
    };
    stage_begin(renderer->settings.stage, "building the kernel", NULL, 0);
    fault_record_kernel(slot->request.kernel);
    const double start = clock_seconds();
    program_build(renderer->compute, &slot->request, &slot->program);
    const HostSpan build = {kernel_sources[type].name, start, clock_seconds()};
    array_push(renderer->report.builds, build);
    fault_record_kernel(NULL);
    stage_begin(renderer->settings.stage, "rendering", NULL, 0);
    if (is_of_image) renderer->report.kernel_hash = slot->program.text_hash;
    renderer->report.build_seconds += slot->program.build_seconds;
    renderer->report.build_from_cache &= slot->program.from_cache;
    renderer->report.is_out_of_line |= slot->program.is_easy;
    slot->kernel = slot->program.kernel;
    slot->program.kernel = NULL;
    device_scene_set_arguments(&renderer->scene, slot->kernel);
    return slot->kernel;
}

double renderer_launch(Renderer *renderer, KernelType type, cl_uint dimensions, const size_t *first,
                       const size_t *items, const size_t *group)
{
    KernelSlot *slot = &renderer->variant.kernels[type];
    fault_record_kernel(kernel_sources[type].name);
    capture_launch(renderer->compute, &(Launch){slot->kernel, &slot->request, slot->program.is_easy,
                                                dimensions, first, items, group});
    LaunchTime time = kernel_launch_from(renderer->compute, slot->kernel, dimensions, first, items, group);
    fault_record_kernel(NULL);
    const bool is_fixed = renderer->compute->device->work_group[0] > 0;
    if (is_fixed && memcmp(time.local, group, dimensions * sizeof *group) != 0)
        compute_fail(renderer->compute, "clEnqueueNDRangeKernel", CL_INVALID_WORK_GROUP_SIZE,
                     "kernel %s: work-groups of %zu work-items were requested, but at most %zu fit",
                     kernel_sources[type].name, group[0] * (dimensions > 1 ? group[1] : 1),
                     time.local[0] * (dimensions > 1 ? time.local[1] : 1));
    array_push(renderer->report.launches, ((NamedLaunch){kernel_sources[type].name, time}));
    return time.trusted ? time.event_seconds : time.host_seconds;
}
