#include "host/render/kernels.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/opencl/capture.h"
#include <string.h>

static const struct {
    const char *file, *name;
} kernel_sources[KERNEL_COUNT] = {
    [KERNEL_RENDER] = {"render.cl", "render"},    [KERNEL_AOV] = {"aov.cl", "aov"},
    [KERNEL_PATH] = {"path.cl", "path"},          [KERNEL_TRACE] = {"trace.cl", "trace"},
    [KERNEL_CLOSEST] = {"closest.cl", "closest"}, [KERNEL_COVERAGE] = {"coverage.cl", "coverage"},
};

static ProgramRequest request_of(const Kernels *kernels, KernelType type)
{
    return (ProgramRequest){
        .root = kernel_sources[type].file,
        .prelude = text_c(&kernels->variant.prelude),
        .out_of_line_prelude = kernels->variant.out_of_line_prelude.items,
        .kernel = kernel_sources[type].name,
        .options = kernels->variant.options,
        .no_cache = kernels->settings->no_cache,
    };
}

char *kernels_text(const Kernels *kernels, KernelType type)
{
    const ProgramRequest request = request_of(kernels, type);
    return program_request_text(&request, false);
}

static void variant_close(KernelVariant *variant, Compute *compute)
{
    for (size_t type = 0; type < KERNEL_COUNT; type++) {
        KernelSlot *slot = &variant->slots[type];
        if (slot->was_launched) program_store(compute, &slot->request, &slot->program);
        program_close(&slot->program);
    }
    text_free(&variant->prelude);
    text_free(&variant->out_of_line_prelude);
    *variant = (KernelVariant){0};
}

void kernels_adopt(Kernels *kernels, Kernels *earlier)
{
    kernels->variant = earlier->variant;
    kernels->other_variant = earlier->other_variant;
    earlier->variant = earlier->other_variant = (KernelVariant){0};
}

void kernels_close(Kernels *kernels)
{
    variant_close(&kernels->variant, kernels->scene->compute);
    variant_close(&kernels->other_variant, kernels->scene->compute);
}

static bool variant_has(const KernelVariant *variant, const Text *prelude)
{
    return strcmp(text_c(prelude), text_c(&variant->prelude)) == 0;
}

void kernels_choose(Kernels *kernels, Text prelude, Text out_of_line_prelude, const char *options)
{
    KernelVariant *variant = &kernels->variant;
    if (!variant_has(variant, &prelude)) {
        const KernelVariant other = kernels->other_variant;
        kernels->other_variant = *variant;
        *variant = other;
        memset(kernels->paces, 0, sizeof kernels->paces);
    }
    if (variant_has(variant, &prelude)) {
        text_free(&prelude);
        text_free(&out_of_line_prelude);
    } else {
        variant_close(variant, kernels->scene->compute);
        *variant = (KernelVariant){prelude, out_of_line_prelude, options, {{.program = {0}}}};
    }
    for (size_t type = 0; type < KERNEL_COUNT; type++)
        if (variant->slots[type].program.kernel)
            device_scene_set_arguments(kernels->scene, variant->slots[type].program.kernel);
}

static void slot_build(Kernels *kernels, KernelSlot *slot, KernelType type)
{
    Compute *compute = kernels->scene->compute;
    RenderReport *report = kernels->report;
    slot->request = request_of(kernels, type);
    stage_begin(kernels->settings->stage, "building the kernel", NULL, 0);
    fault_record_kernel(slot->request.kernel);
    const double start = clock_seconds();
    program_build(compute, &slot->request, &slot->program);
    const HostSpan build = {kernel_sources[type].name, start, clock_seconds()};
    array_push(report->builds, build);
    fault_record_kernel(NULL);
    stage_begin(kernels->settings->stage, "rendering", NULL, 0);
    report->build_seconds += slot->program.build_seconds;
    report->build_from_cache &= slot->program.from_cache;
    report->is_out_of_line |= slot->program.is_out_of_line;
    device_scene_set_arguments(kernels->scene, slot->program.kernel);
}

cl_kernel kernels_get(Kernels *kernels, KernelType type)
{
    KernelSlot *slot = &kernels->variant.slots[type];
    if (!slot->program.kernel && compute_ok(kernels->scene->compute)) slot_build(kernels, slot, type);
    // AOV kernels do not change the hash that identifies an image
    const bool is_of_image = type != KERNEL_AOV && type != KERNEL_PATH && type != KERNEL_COVERAGE;
    if (is_of_image && !kernels->is_rerender) kernels->report->kernel_hash = slot->program.text_hash;
    return slot->program.kernel;
}

double kernels_launch(Kernels *kernels, KernelType type, cl_uint dimensions, const size_t *first,
                      const size_t *items, const size_t *group)
{
    Compute *compute = kernels->scene->compute;
    KernelSlot *slot = &kernels->variant.slots[type];
    const char *name = kernel_sources[type].name;
    fault_record_kernel(name);
    capture_launch(compute, &(Launch){slot->program.kernel, &slot->request, slot->program.is_out_of_line,
                                      dimensions, first, items, group});
    LaunchTime time = kernel_launch(compute, slot->program.kernel, dimensions, first, items, group);
    slot->was_launched = true;
    fault_record_kernel(NULL);
    const bool is_fixed = compute->device->work_group[0] > 0;
    if (is_fixed && memcmp(time.local, group, dimensions * sizeof *group) != 0)
        compute_fail(compute, "clEnqueueNDRangeKernel", CL_INVALID_WORK_GROUP_SIZE,
                     "kernel %s: work-groups of %zu work-items were requested, but at most %zu fit", name,
                     group[0] * (dimensions > 1 ? group[1] : 1),
                     time.local[0] * (dimensions > 1 ? time.local[1] : 1));
    array_push(kernels->report->launches, ((NamedLaunch){kernels->is_rerender ? "re-render" : name, time}));
    return time.fault ? time.host_seconds : time.event_seconds;
}
