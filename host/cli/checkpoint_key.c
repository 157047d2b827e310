#include "host/cli/checkpoint_key.h"

#include "host/api/version.h"
#include "host/base/hash.h"
#include "host/opencl/compose.h"
#include <stdlib.h>
#include <string.h>

static unsigned long long kernels_hash(void)
{
    uint64_t hash = HASH_START;
    for (const EmbeddedFile *file = kernel_files; file->name; file++)
        hash = hash_bytes(hash, file->text, strlen(file->text) + 1);
    return hash;
}

// Appends each device's model once.
static void model_append(Text *key, const Rank *rank, uint32_t lanes)
{
    char *model = text_format("device: %s, %s, %u lanes\n", rank->device, rank->driver, lanes);
    if (!strstr(text_c(key), model)) text_appendf(key, "%s", model);
    free(model);
}

static void devices_append(Text *key, const ImageOrigin *origin)
{
    const Ranks *ranks = origin->ranks;
    for (size_t i = 0; i < origin->renderer_count; i++) {
        Rank local = {0};
        const RenderReport *report = renderer_report(origin->renderers[i]);
        const Device *reference = report->reference_device;
        rank_set_device(&local, report->device);
        model_append(key, &local, report->lanes);
        if (!reference) continue;
        rank_set_device(&local, reference);
        model_append(key, &local, device_lanes(reference, true, 0));
    }
    for (size_t i = 0; ranks && i < ranks->remote.count; i++)
        if (ranks->items[i].lanes[PASS_ALL] > 0) // otherwise it cannot render
            model_append(key, &ranks->items[i], ranks->items[i].lanes[PASS_ALL]);
}

void checkpoint_key(Text *key, const ImageOrigin *origin, unsigned aovs)
{
    const RenderSettings *settings = origin->settings;
    text_appendf(key, "glint: %s\n", glint_version());
    text_appendf(key, "kernels: %016llx\n", kernels_hash());
    text_appendf(key, "precision: %s\n", precision_names[settings->precision]);
    text_appendf(key, "size: %ux%u\n", settings->width, settings->height);
    text_appendf(key, "region: %u,%u,%u,%u\n", settings->region_x, settings->region_y, settings->region_width,
                 settings->region_height);
    text_appendf(key, "samples: %u\n", settings->sample_count);
    text_appendf(key, "bounces: %u\n", settings->bounce_count);
    text_appendf(key, "least contribution: %.17g\n", settings->min_contribution);
    text_appendf(key, "AOVs:");
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (aovs >> layer & 1) text_appendf(key, " %s", layer_names[layer]);
    text_appendf(key, "\nperturb: %u:%u\n", settings->perturb_seed, settings->perturb_scale);
    text_appendf(key, "BVH: %s\n", bvh_choice_names[settings->bvh]);
    const char *build_options = renderer_report(origin->renderers[0])->device->build_options;
    text_appendf(key, "build options: %s\n", build_options ? build_options : "");
    if (settings->precision != PRECISION_STRICT) devices_append(key, origin);
    text_appendf(key, "scene: %016llx\n", (unsigned long long)renderer_scene_hash(origin->renderers[0]));
}
