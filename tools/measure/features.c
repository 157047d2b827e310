// Measures what each part of the kernel costs a scene that does not use it. Prints a table in Markdown with
// the processor times of a frame and of a build, for the kernel with the scene's own features, with one more
// and with all.
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/cli/open_device.h"
#include "host/render/renderer.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

enum {
    VARIANT_COUNT = FEATURE_COUNT + 2, // the scene's own, each feature, all
    BUILDS = 4,                        // per variant; the shortest counts
    ROUNDS = 25                        // one frame of each variant in turn; the shortest counts
};

typedef struct {
    char name[32];
    FeatureSet extra;
    Renderer *renderer;
    double first_seconds, frame_seconds; // the first includes the build
} FeatureVariant;

// Returns the processor time of all threads, and of the linkers that a driver started.
static double processor_seconds(void)
{
    struct rusage linkers;
    getrusage(RUSAGE_CHILDREN, &linkers);
    return clock_processor_seconds() + (double)(linkers.ru_utime.tv_sec + linkers.ru_stime.tv_sec) +
           1e-6 * (double)(linkers.ru_utime.tv_usec + linkers.ru_stime.tv_usec);
}

static bool band_drop(void *context, const Film *band)
{
    (void)context, (void)band;
    return true;
}

static double frame_seconds(Renderer *renderer)
{
    double start = processor_seconds();
    if (!renderer_render(renderer, 0, band_drop, NULL)) fault("the device failed");
    return processor_seconds() - start;
}

static void variant_build(FeatureVariant *variant, Compute *compute, const Scene *scene)
{
    RenderSettings settings = settings_of_image(1920, 1080, PRECISION_SINGLE);
    settings.bounce_count = 5;
    settings.extra_features = variant->extra;
    settings.shift_to_eye = settings.no_cache = true;
    MessageList messages = {0};
    renderer_close(variant->renderer);
    variant->renderer = renderer_open(compute, scene, &settings, &messages);
    messages_print(&messages, NULL);
    if (!variant->renderer) exit(EXIT_FAILURE);
    variant->first_seconds = fmin(variant->first_seconds, frame_seconds(variant->renderer));
}

static size_t variants_list(FeatureVariant *variants, FeatureSet own)
{
    size_t count = 0;
    variants[count++] = (FeatureVariant){.name = "the scene's own"};
    for (size_t i = 0; i < FEATURE_COUNT; i++) {
        if (own >> i & 1) continue;
        variants[count].extra = 1u << i;
        snprintf(variants[count++].name, sizeof variants->name, "and %s", feature_names[i]);
    }
    variants[count++] = (FeatureVariant){.name = "all", .extra = FEATURE_ALL};
    for (size_t i = 0; i < count; i++)
        variants[i].first_seconds = variants[i].frame_seconds = INFINITY;
    return count;
}

static void table_print(const FeatureVariant *variants, size_t count, double opening)
{
    const FeatureVariant *own = variants;
    printf("| kernel | frame ms | ratio | build ms |\n|---|---|---|---|\n");
    for (size_t i = 0; i < count; i++)
        printf("| %s | %.1f | %.2f | %.0f |\n", variants[i].name, 1e3 * variants[i].frame_seconds,
               variants[i].frame_seconds / own->frame_seconds,
               1e3 * (variants[i].first_seconds - variants[i].frame_seconds));
    printf("\nA process's first build takes %.0f ms more.\n", 1e3 * opening);
}

int main(int argument_count, char **arguments)
{
    if (argument_count != 2) {
        fputs("usage: features SCENE\n", stderr);
        return EXIT_FAILURE;
    }
    Scene scene;
    OpenDevice open;
    if (!scene_open(&scene, arguments[1], &(CommonOptions){0}) || !device_open(&open, &(CommonOptions){0}))
        return EXIT_FAILURE;
    FeatureVariant variants[VARIANT_COUNT] = {0};
    size_t count = variants_list(variants, features_of(&scene));
    variant_build(&variants[0], &open.compute, &scene);
    double first = variants[0].first_seconds;
    variants[0].first_seconds = INFINITY;
    for (int round = 0; round < BUILDS; round++)
        for (size_t i = 0; i < count; i++)
            variant_build(&variants[i], &open.compute, &scene);
    for (int round = 0; round < ROUNDS; round++)
        for (size_t i = 0; i < count; i++)
            variants[i].frame_seconds = fmin(variants[i].frame_seconds, frame_seconds(variants[i].renderer));
    table_print(variants, count, first - variants[0].first_seconds);

    for (size_t i = 0; i < count; i++)
        renderer_close(variants[i].renderer);
    scene_free(&scene);
    return device_close(&open, EXIT_SUCCESS);
}
