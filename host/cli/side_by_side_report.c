// The text of a comparison of reports, and the JSON from which its rows and its page are made.
#include "host/cli/report_json.h"
#include "host/cli/side_by_side.h"

static const ResultTable side_table = {
    .rows = "rows.cells",
    .names = {"scene", "size", "precision", "lanes", "BVH=bvh", "samples", "bounces", "variant", "report"},
    .values = {"frame ms=frame_ms.median", "lower quartile=frame_ms.lower_quartile",
               "upper quartile=frame_ms.upper_quartile", "kernel ms=kernel_ms.median",
               "times A's frame time=comparison", "verdict=comparison.verdict"},
    .is_one_table = true,
};

static char report_letter(size_t report)
{
    return (char)('A' + report);
}

static void report_print(const SideBySide *side, size_t index)
{
    const SideReport *report = &side->reports[index];
    const Baseline *baseline = report->baseline;
    printf("%c  %s: %s, glint %s", report_letter(index), report->path, baseline->date, baseline->version);
    if (baseline->commit[0] != '\0') printf(", commit %.12s", baseline->commit);
    printf("\n   %s%s%s%s, %s %s", baseline->device, baseline->board[0] != '\0' ? " (" : "", baseline->board,
           baseline->board[0] != '\0' ? ")" : "", baseline->platform, baseline->driver);
    if (baseline->host[0] != '\0') printf(", host %s", baseline->host);
    printf("\n   %zu row%s", baseline->count, text_plural(baseline->count));
    if (index > 0) printf(", %zu with times in A and here", report->ratio_count);
    if (report->ratio_count > 0) printf(": %.3g times A's frame time (geometric mean)", report->mean_ratio);
    for (size_t verdict = VERDICT_FASTER + 1; verdict-- > 0;)
        if (report->verdicts[verdict] > 0)
            printf(", %zu %s", report->verdicts[verdict], verdict_names[verdict]);
    putchar('\n');
    if (report->why_not) printf("   no verdicts, since %s\n", report->why_not);
}

static void side_notes(const void *context, size_t index, Text *notes)
{
    const SideBySide *side = context;
    const SideCell *cell = &side->cells[index];
    if (cell->ratio > 0 && cell->comparison.why_not && !side->reports[index % side->report_count].why_not)
        text_appendf(notes, "    no verdict, since %s\n", cell->comparison.why_not);
}

void side_by_side_print(const SideBySide *side)
{
    for (size_t i = 0; i < side->report_count; i++)
        report_print(side, i);
    report_output(side_by_side_json(side), &(ReportOptions){.table = &side_table}, side_notes, side);
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

static void cell_json(Json *json, const SideBySide *side, size_t row, size_t index)
{
    const SideCell *cell = side_cell(side, row, index);
    const RowComparison *comparison = &cell->comparison;
    json_begin_object(json, NULL);
    json_addf(json, "report %s", (char[]){report_letter(index), '\0'});
    if (!cell->row || cell->row->failure[0] != '\0')
        unavailable_json(json, cell->row ? cell->row->failure : "no such row");
    if (cell->row) {
        json_count(json, "lanes", cell->row->key.lanes);
        times_summary_json(json, "frame_ms", &cell->row->frame);
        times_summary_json(json, "kernel_ms", &cell->row->kernel);
        if (cell->row->rays_per_second > 0)
            json_number(json, "mrays_per_s", 1e-6 * cell->row->rays_per_second);
    }
    if (cell->kernel_ratio > 0) json_number(json, "kernel_ratio", cell->kernel_ratio);
    if (cell->ratio > 0 && comparison->why_not)
        json_addf(json, "comparison {ratio %g why_not %s}", cell->ratio, comparison->why_not);
    else if (cell->ratio > 0)
        comparison_json(json, comparison);
    json_end(json);
}

static void row_json(Json *json, const SideBySide *side, size_t row)
{
    json_begin_object(json, NULL);
    key_json(json, &side_first(side, row)->row->key);
    json_begin_array(json, "cells");
    for (size_t i = 0; i < side->report_count; i++)
        cell_json(json, side, row, i);
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
    json_begin_array(json, "rows");
    for (size_t row = 0; row < side->row_count; row++)
        row_json(json, side, row);
    json_end(json);
    return json;
}
