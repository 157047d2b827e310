#include "host/cli/layers.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include "host/base/text.h"
#include "host/cli/progress.h"
#include "host/image/image.h"
#include <stdlib.h>
#include <string.h>

static bool band_keep(void *context, const Band *band, double fraction_done)
{
    (void)fraction_done;
    const PictureLayers *layers = context;
    const size_t first = (size_t)band->first_row * layers->width;
    const size_t count = (size_t)band->row_count * layers->width, lights = layers->light_count;
    const struct {
        double *kept;
        const void *values;
        size_t channels;
    } numbers[] = {{layers->color, band->colors, 3},
                   {layers->t, band->t, 1},
                   {layers->normal, band->normal, 3},
                   {layers->position, band->position, 3},
                   {layers->ray, band->ray, 3}};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        if (numbers[i].kept)
            numbers_widen(numbers[i].kept + numbers[i].channels * first, numbers[i].values,
                          numbers[i].channels * count, layers->wide);
    memcpy(layers->object + first, band->object, count * sizeof *layers->object);
    memcpy(layers->path + first, band->path, count * sizeof *layers->path);
    if (lights > 0)
        memcpy(layers->shadow + lights * first, band->shadow, lights * count * sizeof *layers->shadow);
    return !progress_interrupted();
}

bool layers_take(PictureLayers *layers, Renderer *renderer)
{
    const unsigned vectors = (layers->position ? AOV_POSITION : 0u) | (layers->ray ? AOV_RAY : 0u);
    layers->wide = renderer_report(renderer)->wide;
    return renderer_render(renderer, AOV_T | AOV_NORMAL | AOV_OBJECT | AOV_SHADOW | AOV_PATH | vectors,
                           band_keep, layers);
}

bool layers_render(PictureLayers *layers, Renderer *renderer, const RenderSettings *settings,
                   uint32_t light_count)
{
    *layers = layers_allocate(settings->width, settings->height, light_count);
    bool whole = layers_take(layers, renderer);
    if (!whole) layers_free(layers);
    return whole;
}

static bool array_save(const PictureLayers *layers, const char *prefix, const char *name, char npy_type,
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

static bool numbers_save(const PictureLayers *layers, const char *prefix, const char *name, uint32_t channels,
                         const double *values, MessageList *messages)
{
    if (layers->wide) return array_save(layers, prefix, name, 'd', channels, values, messages);
    const size_t count = (size_t)layers->width * layers->height * channels;
    float *narrow = memory_allocate(count, sizeof *narrow);
    numbers_narrow(narrow, values, count);
    bool saved = array_save(layers, prefix, name, 'f', channels, narrow, messages);
    free(narrow);
    return saved;
}

bool layers_save(const PictureLayers *layers, const char *prefix, MessageList *messages)
{
    return numbers_save(layers, prefix, "color", 3, layers->color, messages) &&
           (!layers->t || numbers_save(layers, prefix, "t", 1, layers->t, messages)) &&
           (!layers->normal || numbers_save(layers, prefix, "normal", 3, layers->normal, messages)) &&
           (!layers->object || array_save(layers, prefix, "object", 'u', 1, layers->object, messages)) &&
           (!layers->path || array_save(layers, prefix, "path", 'u', 1, layers->path, messages)) &&
           (!layers->shadow || layers->light_count == 0 ||
            array_save(layers, prefix, "shadow", 'u', layers->light_count, layers->shadow, messages));
}
