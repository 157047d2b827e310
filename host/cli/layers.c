#include "host/cli/layers.h"

#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/progress.h"
#include "host/image/image.h"
#include <stdlib.h>
#include <string.h>

// Copies `count` numbers of the renderer's precision to a place in an array of doubles.
static void numbers_keep(double *target, const void *source, size_t count, bool wide)
{
    if (wide)
        memcpy(target, source, count * sizeof *target);
    else
        for (size_t i = 0; i < count; i++)
            target[i] = (double)((const float *)source)[i];
}

static bool band_keep(void *context, const Band *band, double fraction_done)
{
    (void)fraction_done;
    AccuracyLayers *layers = context;
    const size_t first = (size_t)band->first_row * layers->width;
    const size_t count = (size_t)band->row_count * layers->width;
    const size_t lights = layers->light_count;
    numbers_keep(layers->colors + 3 * first, band->colors, 3 * count, layers->wide);
    numbers_keep(layers->t + first, band->t, count, layers->wide);
    numbers_keep(layers->normal + 3 * first, band->normal, 3 * count, layers->wide);
    memcpy(layers->object + first, band->object, count * sizeof(uint32_t));
    memcpy(layers->path + first, band->path, count * sizeof(uint32_t));
    if (lights > 0) memcpy(layers->shadow + lights * first, band->shadow, lights * count * sizeof(uint32_t));
    return !progress_interrupted();
}

bool layers_render(AccuracyLayers *layers, Renderer *renderer, const RenderSettings *settings,
                   uint32_t light_count)
{
    const size_t pixels = (size_t)settings->width * settings->height;
    *layers = (AccuracyLayers){
        .width = settings->width,
        .height = settings->height,
        .light_count = light_count,
        .wide = renderer_report(renderer)->wide,
        .colors = memory_allocate(3 * pixels, sizeof(double)),
        .t = memory_allocate(pixels, sizeof(double)),
        .normal = memory_allocate(3 * pixels, sizeof(double)),
        .object = memory_allocate(pixels, sizeof(uint32_t)),
        .shadow = memory_allocate(light_count * pixels + 1, sizeof(uint32_t)),
        .path = memory_allocate(pixels, sizeof(uint32_t)),
    };
    const unsigned aovs = AOV_T | AOV_NORMAL | AOV_OBJECT | AOV_SHADOW | AOV_PATH;
    bool whole = renderer_render(renderer, aovs, band_keep, layers);
    if (!whole) accuracy_layers_free(layers);
    return whole;
}

static bool array_save(const AccuracyLayers *layers, const char *prefix, const char *name, char npy_type,
                       uint32_t channels, const void *values, MessageList *messages)
{
    Text path = {0};
    text_appendf(&path, "%s.%s.npy", prefix, name);
    ImageHeader header = {.format = IMAGE_NPY,
                          .width = layers->width,
                          .height = layers->height,
                          .channels = channels,
                          .bits = 8,
                          .npy_type = npy_type};
    ImageWriter *writer = image_writer_open(text_c(&path), &header, messages);
    bool saved = writer != NULL;
    if (writer) {
        saved = image_writer_rows(writer, values, layers->height, messages);
        if (saved)
            saved = image_writer_commit(writer, messages);
        else
            image_writer_abandon(writer);
    }
    text_free(&path);
    return saved;
}

static bool numbers_save(const AccuracyLayers *layers, const char *prefix, const char *name,
                         uint32_t channels, const double *values, MessageList *messages)
{
    if (layers->wide) return array_save(layers, prefix, name, 'd', channels, values, messages);
    const size_t count = (size_t)layers->width * layers->height * channels;
    float *narrow = memory_allocate(count, sizeof *narrow);
    for (size_t i = 0; i < count; i++)
        narrow[i] = (float)values[i];
    bool saved = array_save(layers, prefix, name, 'f', channels, narrow, messages);
    free(narrow);
    return saved;
}

bool layers_save(const AccuracyLayers *layers, const char *prefix, MessageList *messages)
{
    return numbers_save(layers, prefix, "color", 3, layers->colors, messages) &&
           (!layers->t || numbers_save(layers, prefix, "t", 1, layers->t, messages)) &&
           (!layers->normal || numbers_save(layers, prefix, "normal", 3, layers->normal, messages)) &&
           (!layers->object || array_save(layers, prefix, "object", 'u', 1, layers->object, messages)) &&
           (!layers->path || array_save(layers, prefix, "path", 'u', 1, layers->path, messages)) &&
           (!layers->shadow || layers->light_count == 0 ||
            array_save(layers, prefix, "shadow", 'u', layers->light_count, layers->shadow, messages));
}
