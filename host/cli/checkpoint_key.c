#include "host/cli/checkpoint_key.h"

#include "host/api/version.h"
#include "host/base/hash.h"
#include "host/opencl/compose.h"
#include <inttypes.h>
#include <string.h>

static uint64_t kernels_hash(void)
{
    uint64_t hash = HASH_START;
    for (const EmbeddedFile *file = kernel_files; file->name; file++)
        hash = hash_bytes(hash, file->text, strlen(file->text) + 1);
    return hash;
}

// Appends a model to a list of them unless it has the model.
static void model_append(Text *models, const char *model)
{
    if (!strstr(text_c(models), model)) text_appendf(models, "%s%s", models->count > 0 ? " + " : "", model);
}

static void rank_append(Text *models, const Rank *rank, uint32_t lanes)
{
    OWNED char *model = rank_model(rank, lanes);
    model_append(models, model);
    if (rank->reference[0] != '\0') model_append(models, rank->reference);
}

static void devices_append(Text *key, const ImageOrigin *origin)
{
    const Ranks *ranks = origin->ranks;
    OwnedText models = {0};
    for (size_t i = 0; i < origin->renderer_count; i++) {
        Rank local = {0};
        const RenderReport *report = renderer_report(origin->renderers[i]);
        rank_set_devices(&local, report->device, report->reference_device);
        rank_append(&models, &local, report->lanes);
    }
    for (size_t i = 0; ranks && i < ranks->remote.count; i++)
        if (ranks->items[i].lanes[PASS_ALL] > 0) // otherwise it cannot render
            rank_append(&models, &ranks->items[i], ranks->items[i].lanes[PASS_ALL]);
    text_appendf(key, "device: %s\n", text_c(&models));
}

void checkpoint_key(Text *key, const ImageOrigin *origin, unsigned aovs)
{
    const RenderSettings *settings = origin->settings;
    text_appendf(key, "glint: %s\n", glint_version());
    text_appendf(key, "kernels: %016" PRIx64 "\n", kernels_hash());
    text_appendf(key, "precision: %s\n", precision_names[settings->precision]);
    text_appendf(key, "size: %ux%u\n", settings->width, settings->height);
    text_appendf(key, "region: %u,%u,%u,%u\n", settings->region_x, settings->region_y, settings->region_width,
                 settings->region_height);
    text_appendf(key, "samples: %u\n", settings->sample_count);
    text_appendf(key, "bounces: %u\n", settings->bounce_count);
    text_appendf(key, "min-contribution: %.17g\n", settings->min_contribution);
    text_appendf(key, "aov:");
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (aovs >> layer & 1) text_appendf(key, " %s", layer_names[layer]);
    text_appendf(key, "\nperturb: %u:%u\n", settings->perturb_seed, settings->perturb_scale);
    text_appendf(key, "bvh: %s\n", bvh_choice_names[settings->bvh]);
    const char *build_options = renderer_report(origin->renderers[0])->device->build_options;
    text_appendf(key, "build-options: %s\n", build_options ? build_options : "");
    if (settings->precision != PRECISION_STRICT) devices_append(key, origin);
    text_appendf(key, "scene: %016" PRIx64 "\n", renderer_scene_hash(origin->renderers[0]));
}
