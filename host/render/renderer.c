#include "host/render/renderer.h"

#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/compile/compile.h"
#include "host/render/arithmetic.h"
#include "host/render/render_job.h"
#include "host/render/renderer_state.h"
#include <stdlib.h>
#include <string.h>

Renderer *renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                        MessageList *messages)
{
    return renderer_reopen(NULL, compute, scene, settings, messages);
}

Renderer *renderer_reopen(Renderer *earlier, Compute *compute, const Scene *scene,
                          const RenderSettings *settings, MessageList *messages)
{
    const RendererSet set = {&earlier, &compute, messages, 1};
    renderers_open(&set, scene, settings, NULL, messages);
    return earlier;
}

Renderer *renderer_open_empty(Compute *compute, const RenderSettings *settings, Renderer *earlier,
                              MessageList *messages)
{
    stage_begin(settings->stage, "measuring the device's arithmetic", NULL, 0);
    if (!device_suits(compute, settings, messages)) {
        renderer_close(earlier);
        return NULL;
    }
    Renderer *renderer = memory_allocate_zeroed(1, sizeof *renderer);
    RenderReport *report = &renderer->report;
    report->build_from_cache = true;
    if (earlier && settings->first_sample > 0) { // it rendered earlier samples of the image
        *report = earlier->report;
        earlier->report = (RenderReport){0};
    }
    renderer->pass_count = settings->precision == PRECISION_CERTIFIED ? PASS_COUNT : PASS_ALL + 1;
    for (PixelPass i = PASS_ALL; i < renderer->pass_count; i++) {
        Pass *pass = &renderer->passes[i];
        pass_open(pass, i, i == PASS_ALL ? compute : compute_in_double(compute), settings, report);
        if (earlier && i < earlier->pass_count) kernels_adopt(&pass->kernels, &earlier->passes[i].kernels);
    }
    report->device = compute->device;
    report->reference_device = compute->reference ? compute->reference->device : NULL;
    report->is_double = renderer->passes[PASS_ALL].scene.is_double;
    report->lanes = renderer->passes[PASS_ALL].lanes;
    renderer_close(earlier);
    return renderer;
}

uint32_t renderer_lanes(const Renderer *renderer, PixelPass pass)
{
    return renderer && pass < renderer->pass_count ? renderer->passes[pass].lanes : 0;
}

bool renderer_receive_scene(Renderer *renderer, PixelPass pass, CompiledScene *compiled,
                            MessageList *messages)
{
    Pass *receiver = &renderer->passes[pass];
    const bool fits = device_scene_fits(&receiver->scene, compiled, messages);
    if (fits)
        passes_receive_scene(&receiver, 1, compiled);
    else
        compiled_scene_free(compiled);
    return fits && compute_check_reference(renderer->passes[PASS_ALL].compute);
}

bool renderer_move(Renderer *renderer, const Scene *scene, const RenderSettings *settings,
                   MessageList *messages)
{
    Compute *compute = renderer->passes[PASS_ALL].compute;
    CompiledScene fresh[PASS_COUNT] = {0};
    bool fits = compute_ok(compute) && settings_fit(settings, compute, messages);
    for (PixelPass i = PASS_ALL; i < renderer->pass_count && fits; i++)
        fits = pass_compile(&renderer->passes[i], scene, settings, &fresh[i], messages);
    for (PixelPass i = PASS_ALL; i < renderer->pass_count; i++)
        if (fits)
            pass_move(&renderer->passes[i], &fresh[i], settings);
        else
            compiled_scene_free(&fresh[i]);
    return fits && compute_check_reference(compute);
}

bool renderer_render(Renderer *renderer, unsigned aovs, BandSink sink, void *context)
{
    const RenderJob job = {
        .renderers = &renderer, .count = 1, .aovs = aovs, .sink = sink, .context = context};
    return render_job_run(&job) && compute_ok(renderer->passes[PASS_ALL].compute);
}

uint64_t renderer_scene_hash(const Renderer *renderer)
{
    uint64_t hash = HASH_START;
    for (PixelPass i = PASS_ALL; i < renderer->pass_count; i++)
        hash = hash_bytes(hash, &renderer->passes[i].scene.hash, sizeof renderer->passes[i].scene.hash);
    return hash;
}

void renderer_release_scene(Renderer *renderer)
{
    for (PixelPass i = PASS_ALL; renderer && i < renderer->pass_count; i++)
        pass_release_scene(&renderer->passes[i]);
}

void renderer_close(Renderer *renderer)
{
    if (!renderer) return;
    for (PixelPass i = PASS_ALL; i < renderer->pass_count; i++)
        pass_close(&renderer->passes[i]);
    free(renderer->report.launches.items);
    free(renderer->report.reads.items);
    free(renderer->report.builds.items);
    free(renderer->report.bands.items);
    free(renderer);
}

double renderer_color_max(const Renderer *renderer, const Scene *scene)
{
    const Pass *pass = &renderer->passes[PASS_ALL];
    return scene_color_max(&pass->scene.compiled, scene, pass->settings.bounce_count);
}

char *renderer_kernel_text(const Renderer *renderer)
{
    return kernels_text(&renderer->passes[PASS_ALL].kernels, KERNEL_RENDER);
}

uint64_t renderer_kernel_hash(const Renderer *renderer)
{
    const KernelSlot *slot = &renderer->passes[PASS_ALL].kernels.variant.slots[KERNEL_RENDER];
    if (slot->program.kernel) return slot->program.text_hash;
    OWNED char *text = renderer_kernel_text(renderer);
    return hash_bytes(HASH_START, text, strlen(text));
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
