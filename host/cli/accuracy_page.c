#include "host/cli/accuracy_page.h"

#include "host/base/array.h"
#include "host/base/base64.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/cli/report_json.h"
#include "host/image/heatmap.h"
#include "host/image/transfer.h"
#include <math.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

// Differences are shown in steps of half a power of ten, the same in every report, so that reports can be
// compared.
enum { DECADES = 7, STEPS = 2 * DECADES, STEP_NOT_FINITE, STEP_COUNT };

typedef uint8_t Rgb8[3];

static uint8_t difference_step(float difference)
{
    if (!isfinite(difference)) return STEP_NOT_FINITE;
    if (!(difference > 0)) return 0;
    return (uint8_t)fmax(0, fmin(ceil(2 * (log10((double)difference) + DECADES)), STEPS));
}

// Black, then the heatmap from a color that differs visibly from black. Red, which the heatmap lacks, means
// not finite.
static void step_colors(Rgb8 colors[STEP_COUNT])
{
    for (int step = 0; step <= STEPS; step++) {
        float color[3];
        heatmap_color(step == 0 ? 0 : 0.2 + 0.8 * step / STEPS, color);
        for (int i = 0; i < 3; i++)
            colors[step][i] = (uint8_t)lrintf(255 * color[i]);
    }
    memcpy(colors[STEP_NOT_FINITE], (Rgb8){255, 0, 0}, sizeof(Rgb8));
}

// Appends the image as PNG. `pixels` has 3 sRGB values or a palette index per pixel, with rows from the top.
static void png_bytes_append(Text *png, const uint8_t *pixels, uint32_t width, uint32_t height,
                             const uint8_t (*palette)[3], uint32_t palette_count)
{
    png_image image = {
        .version = PNG_IMAGE_VERSION,
        .width = width,
        .height = height,
        .format = palette ? PNG_FORMAT_RGB_COLORMAP : PNG_FORMAT_RGB,
        .colormap_entries = palette_count,
    };
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    array_reserve(*png, size + 1);
    if (!png_image_write_to_memory(&image, png->items + png->count, &size, 0, pixels, 0, palette))
        fault("libpng cannot write: %s", image.message);
    png->count += size;
    png->items[png->count] = '\0';
}

static void png_json(Json *json, const char *key, const AccuracyScene *scene, const uint8_t *pixels,
                     const Rgb8 *palette)
{
    OwnedText png = {0};
    Text uri = {0};
    png_bytes_append(&png, pixels, scene->width, scene->height, palette, palette ? STEP_COUNT : 0);
    text_appendf(&uri, "data:image/png;base64,");
    base64_append(&uri, (const uint8_t *)png.items, png.count);
    text_json(json, key, uri);
}

static bool same_image(const AccuracyScene *scene, const float *a, const float *b)
{
    return a && b && memcmp(a, b, (size_t)scene->width * scene->height * 3 * sizeof *a) == 0;
}

static void difference_json(Json *json, const AccuracyScene *scene, float *values)
{
    const size_t pixels = (size_t)scene->width * scene->height;
    Image reference = {
        .width = scene->width, .height = scene->height, .channels = 3, .values = scene->reference.image};
    Image image = reference;
    image.values = values;
    OWNED float *differences = memory_allocate(pixels, sizeof *differences);
    image_errors(&reference, &image, differences);
    OWNED uint8_t *steps = memory_allocate(pixels, 1);
    for (size_t i = 0; i < pixels; i++)
        steps[i] = difference_step(differences[i]);
    Rgb8 colors[STEP_COUNT];
    step_colors(colors);
    png_json(json, "difference", scene, steps, (const Rgb8 *)colors);
}

static void image_json(Json *json, const AccuracyScene *scene, float *values)
{
    const size_t count = (size_t)scene->width * scene->height * 3;
    json_begin_object(json, NULL);
    json_begin_array(json, "variants");
    for (size_t i = 0; i < scene->variant_count; i++)
        if (same_image(scene, scene->variants[i].image, values)) json_count(json, NULL, i);
    json_end(json);
    OWNED uint8_t *colors = memory_allocate(count, 1);
    transfer_quantize(colors, values, count, scene->display_values ? TRANSFER_NONE : TRANSFER_SRGB, 8);
    png_json(json, "image", scene, colors, NULL);
    if (values != scene->reference.image) difference_json(json, scene, values);
    json_end(json);
}

// Returns whether the image equals the reference's or that of an earlier variant.
static bool is_repeated(const AccuracyScene *scene, size_t variant)
{
    const float *values = scene->variants[variant].image;
    bool repeated = same_image(scene, scene->reference.image, values);
    for (size_t i = 0; i < variant && !repeated; i++)
        repeated = same_image(scene, scene->variants[i].image, values);
    return repeated;
}

static void scene_json(Json *json, const AccuracyScene *scene)
{
    json_begin_object(json, NULL);
    json_begin_array(json, "names");
    for (size_t i = 0; i < scene->variant_count; i++) {
        Text name = {0};
        accuracy_variant_name(&name, scene, &scene->variants[i]);
        text_json(json, NULL, name);
    }
    json_end(json);
    json_begin_array(json, "images");
    image_json(json, scene, scene->reference.image);
    for (size_t i = 0; i < scene->variant_count; i++)
        if (scene->variants[i].image && !is_repeated(scene, i))
            image_json(json, scene, scene->variants[i].image);
    json_end(json);
    json_end(json);
}

Json *accuracy_page_extras(const AccuracyReport *report)
{
    Json *json = json_open();
    json_count(json, "difference_decades", DECADES);
    json_begin_array(json, "difference_colors");
    Rgb8 colors[STEP_COUNT];
    step_colors(colors);
    for (int step = 0; step < STEP_COUNT; step++) {
        char color[8];
        snprintf(color, sizeof color, "#%02x%02x%02x", colors[step][0], colors[step][1], colors[step][2]);
        json_text(json, NULL, color);
    }
    json_end(json);
    json_begin_array(json, "scenes");
    for (size_t i = 0; i < report->scene_count; i++)
        scene_json(json, &report->scenes[i]);
    json_end(json);
    return json;
}
