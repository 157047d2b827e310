// The text of a comparison of reports, and the JSON that its page draws.
#include "host/cli/report_json.h"
#include "host/cli/side_by_side.h"
#include "host/cli/table.h"
#include <string.h>

static char report_letter(size_t report)
{
    return (char)('A' + report);
}

// Returns the columns in which rows do not differ, such as "size 160x90, precision single".
static Text constants_text(const SideBySide *side)
{
    Text text = {0};
    for (size_t column = 0; column < SIDE_COLUMNS; column++) {
        if (side->is_shown[column]) continue;
        Text value = side_column_text(&side_first(side, 0)->row->key, column);
        if (value.count > 0)
            text_appendf(&text, "%s%s %s", text.count > 0 ? ", " : "",
                         column_heading(bench_table.names[column]).text, text_c(&value));
        text_free(&value);
    }
    return text;
}

// Returns milliseconds with about four digits.
static ShortText milliseconds(double seconds)
{
    const double value = 1e3 * seconds;
    ShortText text;
    snprintf(text.text, sizeof text.text, "%.*f",
             value < 10     ? 4
             : value < 100  ? 3
             : value < 1000 ? 2
                            : 1,
             value);
    return text;
}

static void report_print(const SideBySide *side, size_t index, FILE *stream)
{
    const SideReport *report = &side->reports[index];
    const Baseline *baseline = report->baseline;
    fprintf(stream, "%c  %s: %s, glint %s", report_letter(index), report->path, baseline->date,
            baseline->version);
    if (baseline->commit[0] != '\0') fprintf(stream, ", commit %.12s", baseline->commit);
    fprintf(stream, "\n   %s%s%s%s, %s %s", baseline->device, baseline->board[0] != '\0' ? " (" : "",
            baseline->board, baseline->board[0] != '\0' ? ")" : "", baseline->platform, baseline->driver);
    if (baseline->host[0] != '\0') fprintf(stream, ", host %s", baseline->host);
    fprintf(stream, "\n   %zu row%s", baseline->count, text_plural(baseline->count));
    if (index > 0) fprintf(stream, ", %zu with times in A and here", report->ratio_count);
    if (report->ratio_count > 0)
        fprintf(stream, ": %.3g times A's frame time (geometric mean)", report->mean_ratio);
    for (size_t verdict = VERDICT_FASTER + 1; verdict-- > 0;)
        if (report->verdicts[verdict] > 0)
            fprintf(stream, ", %zu %s", report->verdicts[verdict], verdict_names[verdict]);
    fputc('\n', stream);
    if (report->why_not) fprintf(stream, "   no verdicts, since %s\n", report->why_not);
}

static void ratio_append(Text *rows, const SideCell *cell, const SideReport *report)
{
    const RowComparison *comparison = &cell->comparison;
    text_appendf(rows, "%.*f", cell->ratio < 0.01 ? 5 : cell->ratio < 0.1 ? 4 : 3, cell->ratio);
    if (comparison->why_not && !report->why_not)
        text_appendf(rows, ", no verdict since %s", comparison->why_not);
    if (!comparison->why_not)
        text_appendf(rows, " (%.3f to %.3f) %s", comparison->frame.low, comparison->frame.high,
                     verdict_names[comparison->verdict]);
}

static void cell_append(Text *rows, const SideCell *cell, const SideReport *report)
{
    if (!cell->row || cell->row->frame.count == 0) {
        text_appendf(rows, "-\t");
        if (cell->row)
            text_appendf(rows, "%s", cell->row->failure[0] != '\0' ? cell->row->failure : "no times");
        return;
    }
    const Summary *frame = &cell->row->frame, *kernel = &cell->row->kernel;
    text_appendf(rows, "%s\t", milliseconds(frame->median).text);
    if (frame->lower_quartile > 0)
        text_appendf(rows, "%s to %s\t", milliseconds(frame->lower_quartile).text,
                     milliseconds(frame->upper_quartile).text);
    else
        text_appendf(rows, "-\t");
    text_appendf(rows, "%s\t", kernel->count > 0 ? milliseconds(kernel->median).text : "-");
    if (cell->ratio > 0) ratio_append(rows, cell, report);
}

// Appends the name of a row before its first report. Before the others, only columns that differ from it are
// filled, which are lanes.
static void name_append(Text *rows, const SideBySide *side, const BenchKey *key, const BenchKey *above)
{
    for (size_t column = 0; column < SIDE_COLUMNS; column++) {
        if (!side->is_shown[column]) continue;
        Text text = side_column_text(key, column);
        Text text_above = above ? side_column_text(above, column) : (Text){0};
        const bool is_repeated = above && (column == 0 || strcmp(text_c(&text), text_c(&text_above)) == 0);
        text_appendf(rows, "%s\t", is_repeated ? "" : text_c(&text));
        text_free(&text);
        text_free(&text_above);
    }
}

static void row_append(Text *rows, const SideBySide *side, size_t row)
{
    const BenchKey *first = &side_first(side, row)->row->key;
    for (size_t i = 0; i < side->report_count; i++) {
        const SideCell *cell = side_cell(side, row, i);
        name_append(rows, side, cell->row ? &cell->row->key : first, i > 0 ? first : NULL);
        text_appendf(rows, "%c\t", report_letter(i));
        cell_append(rows, cell, &side->reports[i]);
        text_appendf(rows, "\n");
    }
}

void side_by_side_print(const SideBySide *side, FILE *stream)
{
    Text constants = constants_text(side), rows = {0}, alignment = {0};
    for (size_t i = 0; i < side->report_count; i++)
        report_print(side, i, stream);
    if (constants.count > 0) fprintf(stream, "\n%s\n", text_c(&constants));
    text_free(&constants);
    fputc('\n', stream);
    for (size_t column = 0; column < SIDE_COLUMNS; column++) {
        if (!side->is_shown[column]) continue;
        text_appendf(&rows, "%s\t", column_heading(bench_table.names[column]).text);
        text_appendf(&alignment, "l");
    }
    text_appendf(&rows, "\tframe ms\tquartiles\tkernel ms\t%s\n",
                 side->report_count > 1 ? "times A's frame time" : "");
    text_appendf(&alignment, "lrlr");
    for (size_t row = 0; row < side->row_count; row++)
        row_append(&rows, side, row);
    table_print(text_c(&rows), text_c(&alignment), stream);
    text_free(&alignment);
    text_free(&rows);
}

static void report_json(Json *json, const SideReport *report)
{
    const Baseline *baseline = report->baseline;
    json_begin_object(json, NULL);
    json_addf(json,
              "file %s date %s glint %s commit %s device %s board %s platform %s driver %s host %s rows %zu "
              "common %zu",
              report->path, baseline->date, baseline->version, baseline->commit, baseline->device,
              baseline->board, baseline->platform, baseline->driver, baseline->host, baseline->count,
              report->ratio_count);
    if (report->ratio_count > 0) json_number(json, "mean_ratio", report->mean_ratio);
    if (report->why_not) json_text(json, "why_not", report->why_not);
    for (size_t verdict = 0; verdict <= VERDICT_FASTER; verdict++)
        json_count(json, verdict_names[verdict], report->verdicts[verdict]);
    json_end(json);
}

static void times_summary_json(Json *json, const char *key, const Summary *seconds)
{
    if (seconds->count == 0) return;
    json_begin_object(json, key);
    json_addf(json, "min %g median %g max %g", 1e3 * seconds->min, 1e3 * seconds->median, 1e3 * seconds->max);
    if (seconds->lower_quartile > 0)
        json_addf(json, "lower_quartile %g upper_quartile %g", 1e3 * seconds->lower_quartile,
                  1e3 * seconds->upper_quartile);
    json_count(json, "runs", seconds->count);
    json_end(json);
}

static void cell_json(Json *json, const SideCell *cell)
{
    if (!cell->row) {
        json_none(json, NULL);
        return;
    }
    const RowComparison *comparison = &cell->comparison;
    json_begin_object(json, NULL);
    json_count(json, "lanes", cell->row->key.lanes);
    if (cell->row->failure[0] != '\0') json_text(json, "failure", cell->row->failure);
    times_summary_json(json, "frame_ms", &cell->row->frame);
    times_summary_json(json, "kernel_ms", &cell->row->kernel);
    if (cell->row->rays_per_second > 0) json_number(json, "mrays_per_s", 1e-6 * cell->row->rays_per_second);
    if (cell->ratio > 0) json_number(json, "ratio", cell->ratio);
    if (cell->kernel_ratio > 0) json_number(json, "kernel_ratio", cell->kernel_ratio);
    if (cell->ratio > 0 && comparison->why_not) json_text(json, "why_not", comparison->why_not);
    if (cell->ratio > 0 && !comparison->why_not)
        json_addf(json, "low %g high %g verdict %s", comparison->frame.low, comparison->frame.high,
                  verdict_names[comparison->verdict]);
    json_end(json);
}

static void row_json(Json *json, const SideBySide *side, size_t row)
{
    json_begin_object(json, NULL);
    json_begin_array(json, "name");
    for (size_t column = 0; column < SIDE_COLUMNS; column++) {
        if (side->is_shown[column])
            text_json(json, NULL, side_column_text(&side_first(side, row)->row->key, column));
    }
    json_end(json);
    json_begin_array(json, "cells");
    for (size_t i = 0; i < side->report_count; i++)
        cell_json(json, side_cell(side, row, i));
    json_end(json);
    json_end(json);
}

Json *side_by_side_json(const SideBySide *side)
{
    Json *json = json_open();
    json_addf(json, "confidence %g tolerance %g", comparison_confidence, baseline_tolerance);
    json_begin_array(json, "reports");
    for (size_t i = 0; i < side->report_count; i++)
        report_json(json, &side->reports[i]);
    json_end(json);
    json_begin_array(json, "columns");
    for (size_t column = 0; column < SIDE_COLUMNS; column++)
        if (side->is_shown[column]) json_text(json, NULL, column_heading(bench_table.names[column]).text);
    json_end(json);
    text_json(json, "constants", constants_text(side));
    json_begin_array(json, "rows");
    for (size_t row = 0; row < side->row_count; row++)
        row_json(json, side, row);
    json_end(json);
    return json;
}
