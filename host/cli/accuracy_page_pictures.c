#include "host/cli/accuracy_page_parts.h"

#include "host/base/memory.h"
#include "host/cli/html.h"
#include "host/image/transfer.h"
#include "host/measure/heatmap.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Differences are shown in steps of half a power of ten, the same in every picture of every page, so that
// they can be compared with one another: black up to 1e-7, then 14 colors up to 1 and beyond, and red where
// one is not finite. The darkest color is not black, which nobody could distinguish from the next.
enum { DECADES = 7, STEPS = 2 * DECADES, STEP_NOT_FINITE = STEPS + 1, STEP_COUNT };

static uint8_t difference_step(float difference)
{
    if (!isfinite(difference)) return STEP_NOT_FINITE;
    if (!(difference > 0)) return 0;
    return (uint8_t)fmax(0, fmin(ceil(2 * (log10((double)difference) + DECADES)), STEPS));
}

static void step_colors(uint8_t colors[STEP_COUNT][3])
{
    for (int step = 0; step <= STEPS; step++) {
        float color[3];
        heatmap_color(step == 0 ? 0 : 0.2 + 0.8 * step / STEPS, color);
        for (int i = 0; i < 3; i++)
            colors[step][i] = (uint8_t)lrintf(255 * color[i]);
    }
    memcpy(colors[STEP_NOT_FINITE], (uint8_t[]){255, 0, 0}, 3);
}

// A picture as it is shown.
typedef struct {
    uint32_t width, height;
    uint8_t *colors; // 3 display values a pixel
    uint8_t *steps;  // of the difference from the reference
} Shown;

static Shown shown_open(const AccuracyScene *scene, float *picture)
{
    const size_t pixels = (size_t)scene->width * scene->height;
    Shown shown = {scene->width, scene->height, memory_allocate(pixels, 3), memory_allocate(pixels, 1)};
    transfer_quantize(shown.colors, picture, 3 * pixels,
                      scene->display_values ? TRANSFER_NONE : TRANSFER_SRGB, 8);
    Image reference = {
        .width = scene->width, .height = scene->height, .channels = 3, .values = scene->reference.picture};
    Image test = reference;
    test.values = picture;
    float *differences = memory_allocate(pixels, sizeof *differences);
    image_errors(&reference, &test, differences);
    for (size_t i = 0; i < pixels; i++)
        shown.steps[i] = difference_step(differences[i]);
    free(differences);
    return shown;
}

static void shown_close(Shown *shown)
{
    free(shown->colors);
    free(shown->steps);
    *shown = (Shown){0};
}

typedef struct {
    uint32_t x, y, width, height;
} Window;

// A part of a picture, or of its differences, as an <img>; `attributes` has what else the tag is to have.
static void image_write(Text *page, const Shown *shown, Window window, bool differences,
                        const char *attributes)
{
    const size_t size = differences ? 1 : 3;
    const uint8_t *from = differences ? shown->steps : shown->colors;
    uint8_t *part = memory_allocate((size_t)window.width * window.height, size);
    for (uint32_t row = 0; row < window.height; row++)
        memcpy(part + row * window.width * size,
               from + (((size_t)window.y + row) * shown->width + window.x) * size, window.width * size);
    text_appendf(page, "<img width=\"%u\" height=\"%u\" decoding=\"async\" %s src=\"", window.width,
                 window.height, attributes);
    uint8_t colors[STEP_COUNT][3];
    step_colors(colors);
    html_png_address(page, part, window.width, window.height,
                     differences ? (const uint8_t(*)[3])colors : NULL, differences ? STEP_COUNT : 0);
    text_appendf(page, "\">");
    free(part);
}

static void figure_write(Text *page, const Shown *shown, bool differences, const char *key, const char *name)
{
    Text attributes = {0};
    text_appendf(&attributes, "data-picture=\"%s%s\" data-name=\"", differences ? "difference-" : "", key);
    html_text(&attributes, name);
    text_appendf(&attributes, "%s\" alt=\"%s ", differences ? ": difference" : "",
                 differences ? "Differences from the reference of" : "Picture of");
    html_text(&attributes, name);
    text_appendf(&attributes, "\"");
    image_write(page, shown, (Window){0, 0, shown->width, shown->height}, differences, text_c(&attributes));
    text_free(&attributes);
}

static bool same_picture(const AccuracyScene *scene, const float *a, const float *b)
{
    return a && b && memcmp(a, b, (size_t)scene->width * scene->height * 3 * sizeof *a) == 0;
}

// "; equal to it as 32-bit floats: single with 1 lane, strict": those whose picture is this one.
static void same_write(Text *page, const AccuracyScene *scene, const float *picture)
{
    size_t count = 0;
    for (size_t i = 0; i < scene->variant_count; i++) {
        const AccuracyVariant *variant = &scene->variants[i];
        if (variant->picture == picture || !same_picture(scene, variant->picture, picture)) continue;
        text_appendf(page, count++ ? ", " : "; equal to it as 32-bit floats: ");
        page_variant_name(page, scene, i);
    }
}

void page_reference(Text *page, const AccuracyScene *scene)
{
    Shown shown = shown_open(scene, scene->reference.picture);
    text_appendf(page, "<figure>");
    figure_write(page, &shown, false, "reference", "the reference");
    text_appendf(page, "<figcaption>The reference");
    same_write(page, scene, scene->reference.picture);
    text_appendf(page, ".</figcaption></figure>\n");
    shown_close(&shown);
}

static const char *const kind_titles[ACCURACY_FLIP] = {
    [ACCURACY_OBJECT] = "Wrong object", [ACCURACY_SHADOW] = "Wrong shadow", [ACCURACY_PATH] = "Wrong path",
    [ACCURACY_SHADING] = "Shading",     [ACCURACY_T] = "Distance",          [ACCURACY_NORMAL] = "Normal",
    [ACCURACY_IMAGE] = "Whole picture",
};

static const char *const value_headings[ACCURACY_FLIP] = {
    [ACCURACY_OBJECT] = "Object",
    [ACCURACY_SHADOW] = "Light",
    [ACCURACY_PATH] = "Signature of the path",
    [ACCURACY_T] = "Distance",
};

static void value_write(Text *page, AccuracyKind kind, double value)
{
    if (kind == ACCURACY_SHADOW)
        text_appendf(page, "%s", value != 0 ? "blocked" : "reaches it");
    else if (kind == ACCURACY_OBJECT && value == UINT32_MAX)
        text_appendf(page, "none");
    else if (kind == ACCURACY_PATH)
        text_appendf(page, "%08x", (unsigned)value);
    else
        text_appendf(page, "%.9g", value);
}

static void values_row(Text *page, const char *name, AccuracyKind kind, double value, const double color[3])
{
    text_appendf(page, "<tr><th scope=\"row\">%s</th>", name);
    if (value_headings[kind]) {
        text_appendf(page, "<td>");
        value_write(page, kind, value);
        text_appendf(page, "</td>");
    }
    int digits = value_headings[kind] ? 5 : 8;
    text_appendf(page, "<td>%.*g %.*g %.*g</td></tr>", digits, color[0], digits, color[1], digits, color[2]);
}

static void crop_write(Text *page, const Shown *shown, bool differences, Window window,
                       const AccuracyWorst *worst, const char *title)
{
    text_appendf(page, "<div><div class=\"crop\">");
    image_write(page, shown, window, differences, "alt=\"\"");
    text_appendf(page, "<i style=\"left:%.4g%%;top:%.4g%%;width:%.4g%%;height:%.4g%%\"></i></div>%s</div>",
                 100.0 * (worst->x - window.x) / window.width, 100.0 * (worst->y - window.y) / window.height,
                 100.0 / window.width, 100.0 / window.height, title);
}

static uint32_t window_start(uint32_t center, uint32_t side, uint32_t size)
{
    uint32_t start = center < side / 2 ? 0 : center - side / 2;
    return start > size - side ? size - side : start;
}

static void worst_write(Text *page, const Shown *reference, const Shown *shown, AccuracyKind kind,
                        const AccuracyWorst *worst, size_t variant)
{
    enum { SIDE = 15 };
    Window window = {.width = reference->width < SIDE ? reference->width : SIDE,
                     .height = reference->height < SIDE ? reference->height : SIDE};
    window.x = window_start(worst->x, window.width, reference->width);
    window.y = window_start(worst->y, window.height, reference->height);

    text_appendf(page, "<figure data-picture=\"%zu\" data-x=\"%u\" data-y=\"%u\"><h4>%s", variant, worst->x,
                 worst->y, kind_titles[kind]);
    if (kind <= ACCURACY_PATH) text_appendf(page, ", %s", worst->away ? "away from edges" : "at an edge");
    text_appendf(page, "</h4>\n<div class=\"crops\">");
    crop_write(page, reference, false, window, worst, "reference");
    crop_write(page, shown, false, window, worst, "this variant");
    crop_write(page, shown, true, window, worst, "difference");
    text_appendf(page, "</div><figcaption>Pixel %u, %u: %s ", worst->x, worst->y,
                 kind == ACCURACY_T        ? "relative error"
                 : kind == ACCURACY_NORMAL ? "angle in radians"
                 : kind <= ACCURACY_PATH   ? "color off by"
                                           : "off by");
    html_number(page, worst->error);
    text_appendf(page, "\n<table class=\"values\"><tr><td></td>");
    if (kind == ACCURACY_SHADOW)
        text_appendf(page, "<th scope=\"col\">Light %u</th>", worst->light);
    else if (value_headings[kind])
        text_appendf(page, "<th scope=\"col\">%s</th>", value_headings[kind]);
    text_appendf(page, "<th scope=\"col\">Color, linear</th></tr>");
    values_row(page, "reference", kind, worst->reference, worst->reference_color);
    values_row(page, "variant", kind, worst->variant, worst->variant_color);
    text_appendf(page, "</table></figcaption></figure>\n");
}

static void worsts_write(Text *page, const AccuracyScene *scene, const Shown *reference, const Shown *shown,
                         size_t variant)
{
    text_appendf(page, "<h3>The worst pixels of ");
    page_variant_name(page, scene, variant);
    text_appendf(page, "</h3>\n<div class=\"worst\">\n");
    for (unsigned kind = 0; kind < ACCURACY_FLIP; kind++) {
        const AccuracyWorst *worst = &scene->variants[variant].errors.worst[kind];
        if (worst->found) worst_write(page, reference, shown, (AccuracyKind)kind, worst, variant);
    }
    text_appendf(page, "</div>\n");
}

static void scale_write(Text *page)
{
    uint8_t colors[STEP_COUNT][3];
    step_colors(colors);
    text_appendf(page, "<div class=\"scale\"><ol aria-label=\"Colors of differences\">");
    for (int step = 0; step < STEP_COUNT; step++) {
        text_appendf(page,
                     "<li><svg viewBox=\"0 0 1 1\" preserveAspectRatio=\"none\" aria-hidden=\"true\">"
                     "<rect width=\"1\" height=\"1\" fill=\"#%02x%02x%02x\"/></svg>",
                     colors[step][0], colors[step][1], colors[step][2]);
        if (step == STEP_NOT_FINITE)
            text_appendf(page, "not finite");
        else if (step % 2 == 0) {
            text_appendf(page, step == 0 ? "≤ " : "");
            html_power_of_ten(page, step / 2 - DECADES);
        }
        text_appendf(page, "</li>");
    }
    text_appendf(page, "</ol></div>\n");
}

// Whether the reference or an earlier variant has shown this picture.
static bool is_shown(const AccuracyScene *scene, size_t variant)
{
    const float *picture = scene->variants[variant].picture;
    bool shown = same_picture(scene, scene->reference.picture, picture);
    for (size_t i = 0; i < variant && !shown; i++)
        shown = same_picture(scene, scene->variants[i].picture, picture);
    return shown;
}

void page_pictures(Text *page, const AccuracyScene *scene)
{
    Shown reference = shown_open(scene, scene->reference.picture);
    Text pictures = {0}, worsts = {0};
    for (size_t i = 0; i < scene->variant_count; i++) {
        const AccuracyVariant *variant = &scene->variants[i];
        if (!variant->picture || is_shown(scene, i)) continue;
        Shown shown = shown_open(scene, variant->picture);
        Text name = {0};
        char key[24];
        snprintf(key, sizeof key, "%zu", i);
        accuracy_variant_name(&name, scene, variant);
        text_appendf(&pictures, "<figure>");
        figure_write(&pictures, &shown, false, key, text_c(&name));
        text_appendf(&pictures, "<figcaption>");
        page_variant_name(&pictures, scene, i);
        same_write(&pictures, scene, variant->picture);
        text_appendf(&pictures, "</figcaption></figure>\n<figure>");
        figure_write(&pictures, &shown, true, key, text_c(&name));
        text_appendf(&pictures, "<figcaption>");
        page_variant_name(&pictures, scene, i);
        text_appendf(&pictures, ": difference from the reference</figcaption></figure>\n");
        worsts_write(&worsts, scene, &reference, &shown, i);
        text_free(&name);
        shown_close(&shown);
    }
    shown_close(&reference);
    if (pictures.count > 0) {
        text_appendf(page,
                     "<h3>The pictures, and where they differ</h3>\n"
                     "<p>A pixel’s difference is the largest among its channels, in linear light. A color "
                     "reaches up to its number; the scale is that of every picture here.</p>\n");
        scale_write(page);
        text_appendf(page, "<div class=\"pictures\">\n%s</div>\n%s", text_c(&pictures), text_c(&worsts));
    }
    text_free(&pictures);
    text_free(&worsts);
}
