#include "host/cli/accuracy_page_parts.h"

#include "host/cli/html.h"
#include <math.h>

// One table: a caption, the headings after that of the variants, and what fills a variant's row.
typedef struct {
    const char *caption;
    const char *headings[12]; // ended by NULL
    void (*cells)(Text *page, const AccuracyVariant *variant);
    bool of_all; // with a verdict in the last column; else of those with errors only
} Table;

void page_variant_name(Text *page, const AccuracyScene *scene, size_t variant)
{
    const char *precision = scene->variants[variant].row->key.precision;
    text_appendf(page,
                 "<svg class=\"mark %s\" viewBox=\"-7 -7 14 14\" aria-hidden=\"true\">"
                 "<use href=\"#mark-%s\"/></svg>",
                 precision, precision);
    Text name = {0};
    accuracy_variant_name(&name, scene, &scene->variants[variant]);
    html_text(page, text_c(&name));
    text_free(&name);
}

// The number itself goes with its cell, for sorting, as JavaScript reads it.
static void cell_number(Text *page, double value)
{
    text_appendf(page, "<td><data value=\"");
    if (isfinite(value))
        text_appendf(page, "%.17g", value);
    else
        text_appendf(page, "%s", isnan(value) ? "NaN" : value > 0 ? "Infinity" : "-Infinity");
    text_appendf(page, "\">");
    html_number(page, value);
    text_appendf(page, "</data></td>");
}

static void cell_count(Text *page, size_t count)
{
    text_appendf(page, "<td><data value=\"%zu\">", count);
    html_count(page, count);
    text_appendf(page, "</data></td>");
}

static void cell_words(Text *page, const char *words)
{
    text_appendf(page, "<td class=\"words\">");
    html_text(page, words);
    text_appendf(page, "</td>");
}

static void cells_missing(Text *page, size_t count)
{
    while (count-- > 0)
        text_appendf(page, "<td class=\"missing\">–</td>");
}

static void cell_verdict(Text *page, const AccuracyVariant *variant)
{
    Text verdict = {0};
    const char *words;
    if (variant->status == ACCURACY_REFERENCE) text_appendf(&verdict, "the reference itself");
    if (variant->crossed_out) text_appendf(&verdict, "crossed out: ");
    for (size_t i = 0; (words = accuracy_crossed_words(variant, i)); i++)
        text_appendf(&verdict, "%s%s", i > 0 ? ", " : "", words);
    cell_words(page, text_c(&verdict));
    text_free(&verdict);
}

static void time_cells(Text *page, const AccuracyVariant *variant)
{
    const BenchRow *row = variant->row;
    if (variant->status == ACCURACY_UNAVAILABLE) {
        cells_missing(page, 8);
        cell_words(page, row->failure);
        return;
    }
    Summary frame = series_summarize(&row->times.frame);
    cell_number(page, 1e3 * frame.median);
    cell_number(page, 1e3 * frame.min);
    cell_number(page, 1e3 * frame.max);
    cell_count(page, frame.count);
    cell_number(page, 1e3 * bench_kernel(&row->times).median);
    text_appendf(page, "<td>%s</td>", bench_doubt(&row->times) ? "host" : "event");
    cell_number(page, bench_rays_per_second(row) / 1e6);
    text_appendf(page, "<td class=\"hash\">%016llx</td>", (unsigned long long)row->kernel_hash);
    cell_verdict(page, variant);
}

static void edge_cells(Text *page, EdgeCount count)
{
    cell_count(page, count.edge);
    cell_count(page, count.away);
}

static void wrong_cells(Text *page, const AccuracyVariant *variant)
{
    const AccuracyErrors *errors = &variant->errors;
    cell_count(page, errors->nonfinite);
    cell_count(page, errors->negative);
    if (errors->why_colors_only) {
        cells_missing(page, 6);
        return;
    }
    edge_cells(page, errors->object);
    edge_cells(page, errors->shadow);
    edge_cells(page, errors->path);
}

static void amount_cells(Text *page, const AccuracyVariant *variant)
{
    const AccuracyErrors *errors = &variant->errors;
    if (errors->why_colors_only || errors->shading_pixels == 0) {
        cells_missing(page, 4);
    } else {
        cell_number(page, errors->shading.rmse);
        cell_number(page, errors->shading.largest);
        cell_number(page, errors->shading.percentile_999);
        cell_number(page, errors->shading.bias);
    }
    if (errors->why_colors_only || errors->surface_pixels == 0) {
        cells_missing(page, 6);
        return;
    }
    cell_number(page, errors->t_relative.percentile_999);
    cell_number(page, errors->t_relative.largest);
    cell_number(page, errors->t_ulps.percentile_999);
    cell_number(page, errors->t_ulps.largest);
    cell_number(page, errors->normal.percentile_999);
    cell_number(page, errors->normal.largest);
}

static void picture_cells(Text *page, const AccuracyVariant *variant)
{
    const ErrorSummary *image = &variant->errors.image;
    const ImageMetrics *display = &variant->errors.display;
    cell_number(page, image->rmse);
    cell_number(page, image->psnr);
    cell_number(page, image->rel_mse);
    cell_number(page, display->srgb_psnr);
    cell_count(page, display->off_by_1);
    cell_count(page, display->off_by_more);
    cell_number(page, display->flip_mean);
    cell_number(page, display->flip_max);
}

static const Table tables[] = {
    {"Time, and what becomes of it",
     {"Frame, ms", "Shortest", "Longest", "Runs", "Kernels, ms", "Clock", "Million rays a second", "Kernel",
      "Verdict"},
     time_cells,
     true},
    {"Pixels that are wrong: counts",
     {"Not finite", "Negative", "Object, at silhouettes", "Object, away", "Shadow, at edges", "Shadow, away",
      "Path, at edges", "Path, away"},
     wrong_cells,
     false},
    {"Pixels that are right: how far off",
     {"Shading, RMSE", "Shading, largest", "Shading, 99.9 %", "Shading, bias", "Distance, 99.9 %",
      "Distance, largest", "Distance, 99.9 %, ulp", "Distance, largest, ulp", "Normal, 99.9 %",
      "Normal, largest"},
     amount_cells,
     false},
    {"The picture as a whole",
     {"RMSE", "PSNR, dB", "relMSE", "8-bit PSNR, dB", "8-bit values off by 1", "off by more", "FLIP, mean",
      "FLIP, largest"},
     picture_cells,
     false},
};

static void table_write(Text *page, const AccuracyScene *scene, const Table *table)
{
    text_appendf(page,
                 "<div class=\"table\" role=\"region\" aria-label=\"%s\" tabindex=\"0\">\n"
                 "<table class=\"sortable\"><caption>%s</caption>\n"
                 "<thead><tr><th scope=\"col\">Variant</th>",
                 table->caption, table->caption);
    for (const char *const *heading = table->headings; *heading; heading++)
        text_appendf(page, "<th scope=\"col\"%s>%s</th>",
                     table->of_all && !heading[1] ? " class=\"words\"" : "", *heading);
    text_appendf(page, "</tr></thead>\n<tbody>\n");
    for (size_t i = 0; i < scene->variant_count; i++) {
        const AccuracyVariant *variant = &scene->variants[i];
        if (!table->of_all && variant->status != ACCURACY_MEASURED) continue;
        text_appendf(page, "<tr data-variant=\"%zu\"%s><th scope=\"row\">", i,
                     variant->crossed_out ? " class=\"crossed\"" : "");
        page_variant_name(page, scene, i);
        text_appendf(page, "</th>");
        table->cells(page, variant);
        text_appendf(page, "</tr>\n");
    }
    text_appendf(page, "</tbody></table></div>\n");
}

void page_tables(Text *page, const AccuracyScene *scene)
{
    bool any_measured = false;
    const char *why_colors_only = NULL;
    for (size_t i = 0; i < scene->variant_count; i++) {
        if (scene->variants[i].status != ACCURACY_MEASURED) continue;
        any_measured = true;
        why_colors_only = scene->variants[i].errors.why_colors_only;
    }
    for (size_t i = 0; i < sizeof tables / sizeof *tables; i++) {
        bool is_possible = tables[i].cells != amount_cells || !why_colors_only;
        if (tables[i].of_all || (any_measured && is_possible)) table_write(page, scene, &tables[i]);
    }
    if (why_colors_only) {
        text_appendf(page,
                     "<p class=\"note\">Objects, shadows, paths and what follows from them cannot be told: ");
        html_text(page, why_colors_only);
        text_appendf(page, ".</p>\n");
    }
}
