#include "host/cli/accuracy_page.h"

#include "host/base/fault.h"
#include "host/cli/accuracy_page_parts.h"
#include "host/cli/html.h"
#include "host/cli/version.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *page_file(const char *name)
{
    const EmbeddedFile *file = page_files;
    while (strcmp(file->name, name) != 0)
        file++;
    return file->text;
}

static void term_write(Text *page, const char *term, const char *words)
{
    text_appendf(page, "    <dt>%s</dt><dd>", term);
    html_text(page, words);
    text_appendf(page, "</dd>\n");
}

static void device_write(Text *page, const AccuracyReport *report)
{
    const Device *device = report->device;
    Text words = {0};
    text_appendf(&words, "%s: %s, %u %s at %u MHz", device->name, device_type_name(device->type),
                 device->compute_units, device->compute_units == 1 ? "unit" : "units", device->clock_mhz);
    term_write(page, "Device", text_c(&words));
    text_free(&words);
    text_appendf(&words, "%s, %s", device->platform_name, device->platform_version);
    term_write(page, "Platform", text_c(&words));
    text_free(&words);
    term_write(page, "Driver", device->driver);
    text_appendf(&words, "glint %s", glint_version());
    term_write(page, "Program", text_c(&words));
    text_free(&words);
    if (report->perturb_seed > 0) {
        text_appendf(&words, "roundings were made to err on purpose, by %u times their size, seed %u",
                     report->perturb_scale, report->perturb_seed);
        term_write(page, "Perturbed", text_c(&words));
        text_free(&words);
    }
}

static void frame_write(Text *page, const AccuracyVariant *variant)
{
    html_number(page, 1e3 * series_summarize(&variant->row->times.frame).median);
    text_appendf(page, "\u00A0ms");
}

static void budget_write(Text *page, size_t budget)
{
    html_power_of_ten(page, (int)lrint(log10(accuracy_budgets[budget])));
}

// A line for each scene: the fastest within each budget.
static void overview_write(Text *page, const AccuracyReport *report)
{
    text_appendf(
        page,
        "  <p>The fastest that is not crossed out and whose error is within a budget. The error is the "
        "RMSE of the shading%s.</p>\n"
        "  <div class=\"table\" role=\"region\" aria-label=\"What to take\" tabindex=\"0\"><table>\n"
        "  <thead><tr><th scope=\"col\">Scene</th>",
        report->scenes[0].reference.file ? ", or against a file of the whole picture" : "");
    for (size_t k = 0; k < BUDGET_COUNT; k++) {
        text_appendf(page, "<th scope=\"col\">at most ");
        budget_write(page, k);
        text_appendf(page, "</th>");
    }
    text_appendf(page, "</tr></thead>\n  <tbody>\n");
    for (size_t i = 0; i < report->scene_count; i++) {
        const AccuracyScene *scene = &report->scenes[i];
        text_appendf(page, "  <tr><th scope=\"row\"><a href=\"#scene-%zu\">", i);
        html_text(page, scene->path);
        text_appendf(page, "</a></th>");
        for (size_t k = 0; k < BUDGET_COUNT; k++) {
            size_t picked = scene->picks[k].variant;
            text_appendf(page, "<td>");
            if (picked == SIZE_MAX) {
                text_appendf(page, "none");
            } else {
                page_variant_name(page, scene, picked);
                text_appendf(page, ", ");
                frame_write(page, &scene->variants[picked]);
            }
            text_appendf(page, "</td>");
        }
        text_appendf(page, "</tr>\n");
    }
    text_appendf(page, "  </tbody></table></div>\n");
}

static void reference_facts(Text *page, const AccuracyScene *scene)
{
    if (scene->reference.file) {
        text_appendf(page, "Held to the picture in <code>");
        html_text(page, scene->reference.file);
        text_appendf(page, "</code>, which has colors only.");
    } else {
        text_appendf(page,
                     "Held to the device’s own picture in %s (%u %s, hierarchy %s, %u %s a pixel, kernel "
                     "<span class=\"hash\">%016llx</span>).",
                     scene->reference.precision, scene->reference.lanes,
                     scene->reference.lanes == 1 ? "lane" : "lanes", scene->reference.bvh,
                     scene->reference.samples, scene->reference.samples == 1 ? "sample" : "samples",
                     (unsigned long long)scene->reference.kernel_hash);
    }
    if (scene->reference.nonfinite + scene->reference.negative > 0)
        text_appendf(page,
                     " <strong>The reference itself has %zu pixels that are not finite and %zu that are "
                     "negative.</strong>",
                     scene->reference.nonfinite, scene->reference.negative);
    if (scene->reference.file) return;
    text_appendf(page, " Of its ");
    html_count(page, (uint64_t)scene->width * scene->height);
    text_appendf(page, " pixels ");
    html_count(page, scene->edges.silhouette_pixels);
    text_appendf(page, " lie at silhouettes, ");
    html_count(page, scene->edges.path_pixels);
    text_appendf(page, " where paths change");
    for (uint32_t i = 0; i < scene->light_count; i++) {
        text_appendf(page, i > 0 ? ", " : "; at edges of the lights’ shadows: ");
        html_count(page, scene->edges.shadow_edge_pixels[i]);
    }
    text_appendf(page, ".");
}

static void remark_write(Text *page, size_t count, const char *singular, const char *plural)
{
    if (count == 0) return;
    text_appendf(page, "; ");
    html_count(page, count);
    text_appendf(page, " %s", count == 1 ? singular : plural);
}

// One sentence for budgets that the same variant keeps, `first` and on; returns how many.
static size_t pick_write(Text *page, const AccuracyScene *scene, size_t first)
{
    const AccuracyPick *pick = &scene->picks[first];
    size_t count = 1;
    while (first + count < BUDGET_COUNT && scene->picks[first + count].variant == pick->variant)
        count++;
    text_appendf(page, "<li>For an error of at most ");
    for (size_t i = 0; i < count; i++) {
        text_appendf(page, i == 0 ? "" : i + 1 < count ? ", " : " or ");
        budget_write(page, first + i);
    }
    text_appendf(page, ": ");
    if (pick->variant == SIZE_MAX) {
        text_appendf(page, "none of these.</li>\n");
        return count;
    }
    const AccuracyVariant *variant = &scene->variants[pick->variant];
    text_appendf(page, "<strong>");
    page_variant_name(page, scene, pick->variant);
    text_appendf(page, "</strong>, ");
    frame_write(page, variant);
    text_appendf(page, " a frame, ");
    Figure error = accuracy_figure(variant, pick->measure);
    if (error.why_not) {
        text_appendf(page, "the reference itself");
    } else {
        text_appendf(page, "error ");
        html_number(page, error.value);
        remark_write(page, variant->errors.object.edge, "pixel at silhouettes shows another object",
                     "pixels at silhouettes show another object");
        remark_write(page, variant->errors.shadow.edge, "shadow is wrong at its edge",
                     "shadows are wrong at their edges");
    }
    text_appendf(page, ".</li>\n");
    return count;
}

static void scene_write(Text *page, const AccuracyScene *scene, size_t index)
{
    text_appendf(page, "<section class=\"scene\" aria-labelledby=\"scene-%zu\">\n<h2 id=\"scene-%zu\">",
                 index, index);
    html_text(page, scene->path);
    text_appendf(
        page, "</h2>\n<div class=\"lead\"><div>\n<p class=\"facts\">%u × %u pixels, %u %s, at most %u %s. ",
        scene->width, scene->height, scene->light_count, scene->light_count == 1 ? "light" : "lights",
        scene->bounce_count, scene->bounce_count == 1 ? "bounce" : "bounces");
    reference_facts(page, scene);
    text_appendf(page, "</p>\n<ul class=\"picks\">\n");
    for (size_t k = 0; k < BUDGET_COUNT;)
        k += pick_write(page, scene, k);
    text_appendf(page, "</ul>\n</div>\n");
    page_reference(page, scene);
    text_appendf(page,
                 "</div>\n<h3>Error against time</h3>\n<figure class=\"plot\"><figcaption>Both axes are "
                 "logarithmic; down and to the left is better. An error of exactly 0 lies on the dotted line "
                 "below the axis.</figcaption></figure>\n"
                 "<noscript><p class=\"note\">The plot is drawn by a script; the tables have its "
                 "numbers.</p></noscript>\n<h3>The figures</h3>\n");
    page_tables(page, scene);
    text_appendf(page, "<div class=\"comparison\"></div>\n");
    page_pictures(page, scene);
    text_appendf(page, "</section>\n\n");
}

// The figures as --json prints them; but `<`, which would end or confuse a script element, is written \u003c.
static void figures_write(Text *page, const AccuracyReport *report)
{
    char *figures = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&figures, &size);
    if (stream) json_print(accuracy_json(report), stream);
    if (!stream || fclose(stream) != 0) fault("out of memory: the report");
    for (const char *from = figures; *from; from++) {
        if (*from == '<')
            text_appendf(page, "\\u003c");
        else
            text_append(page, from, 1);
    }
    free(figures);
}

static void title_write(Text *page, const AccuracyReport *report)
{
    text_appendf(page, "Speed against error: ");
    for (size_t i = 0; i < report->scene_count; i++) {
        if (i > 0) text_appendf(page, ", ");
        html_text(page, report->scenes[i].path);
    }
}

// What stands in `{{place}}` of page.html.
static void place_fill(Text *page, const AccuracyReport *report, const char *place, size_t length)
{
    if (strncmp(place, "title", length) == 0) {
        title_write(page, report);
    } else if (strncmp(place, "device", length) == 0) {
        device_write(page, report);
    } else if (strncmp(place, "overview", length) == 0) {
        overview_write(page, report);
    } else if (strncmp(place, "scenes", length) == 0) {
        for (size_t i = 0; i < report->scene_count; i++)
            scene_write(page, &report->scenes[i], i);
    } else if (strncmp(place, "style", length) == 0) {
        text_appendf(page, "%s", page_file("page.css"));
    } else if (strncmp(place, "script", length) == 0) {
        text_appendf(page, "%s", page_file("page.js"));
    } else {
        figures_write(page, report);
    }
}

void accuracy_page(Text *page, const AccuracyReport *report)
{
    const char *from = page_file("page.html"), *open;
    while ((open = strstr(from, "{{"))) {
        const char *close = strstr(open, "}}");
        text_append(page, from, (size_t)(open - from));
        place_fill(page, report, open + 2, (size_t)(close - open - 2));
        from = close + 2;
    }
    text_append(page, from, strlen(from));
}
