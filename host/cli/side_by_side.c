#include "host/cli/side_by_side.h"

#include "host/base/exit_status.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include "host/cli/bench_report.h"
#include "host/cli/page.h"
#include "host/cli/report_json.h"
#include "host/measure/baseline.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// A report, and the summary of its comparison with the first.
typedef struct {
    const char *path;
    Baseline *baseline;
    const char *why_not;                 // why none of its rows has a verdict, or NULL
    double mean_ratio;                   // the geometric mean of the ratios of frame times
    size_t ratio_count;                  // how many rows both have
    size_t verdicts[VERDICT_FASTER + 1]; // rows by verdict
} SideReport;

// A report's times of a row next to those of the first report.
typedef struct {
    const BaselineRow *row; // NULL if the report does not have the row
    double ratio; // of frame times to the first report's, by calibrations where `comparison` has an interval,
                  // else of medians; 0 if either has none
    double kernel_ratio;      // of kernel times, or 0
    RowComparison comparison; // if there is a ratio; `why_not` states why it has neither interval nor verdict
} SideCell;

typedef struct {
    SideReport reports[SIDE_REPORTS_MAX];
    size_t report_count;
    SideCell *cells; // row by row, one of each report
    size_t row_count;
} SideBySide;

static SideCell *side_cell(const SideBySide *side, size_t row, size_t report)
{
    return &side->cells[row * side->report_count + report];
}

static bool key_equal_but_lanes(const BenchKey *a, const BenchKey *b)
{
    BenchKey other = *b;
    other.lanes = a->lanes;
    return bench_key_equal(a, &other);
}

// Returns whether a report has several rows with this key that differ only in lanes. Otherwise rows have the
// lanes that suit their devices, and lanes are ignored.
static bool lanes_matter(const SideBySide *side, const BenchKey *key)
{
    for (size_t i = 0; i < side->report_count; i++) {
        const Baseline *report = side->reports[i].baseline;
        size_t count = 0;
        for (size_t k = 0; k < report->count; k++)
            count += key_equal_but_lanes(&report->items[k].key, key);
        if (count > 1) return true;
    }
    return false;
}

// Returns the first cell of a row that has one.
static const SideCell *side_first(const SideBySide *side, size_t row)
{
    const SideCell *cell = side_cell(side, row, 0);
    while (!cell->row)
        cell++;
    return cell;
}

// Places a report's row next to earlier reports' rows with its key, or after all rows.
static void row_place(SideBySide *side, size_t report, const BaselineRow *row)
{
    const bool needs_lanes = lanes_matter(side, &row->key);
    size_t place = 0;
    while (place < side->row_count &&
           (side_cell(side, place, report)->row || !(needs_lanes ? bench_key_equal : key_equal_but_lanes)(
                                                       &side_first(side, place)->row->key, &row->key)))
        place++;
    side_cell(side, place, report)->row = row;
    if (place == side->row_count) side->row_count++;
}

static RowTimes row_times(const SideReport *report, const BaselineRow *row)
{
    const Calibration *calibration = &report->baseline->calibration;
    return (RowTimes){{&row->frame_times, &calibration->wall},
                      {&row->processor_times, &calibration->processor}};
}

static void cell_compare(const SideBySide *side, SideCell *cell, const SideReport *report,
                         const SideCell *first)
{
    const BaselineRow *newer = cell->row, *older = first->row;
    if (!newer || !older || newer->frame.count == 0 || older->frame.count == 0) return;
    cell->ratio = newer->frame.median / older->frame.median;
    if (newer->kernel.count > 0 && older->kernel.count > 0)
        cell->kernel_ratio = newer->kernel.median / older->kernel.median;
    const RowTimes newer_times = row_times(report, newer), older_times = row_times(&side->reports[0], older);
    const bool is_cpu = strcmp(report->baseline->device_type, "cpu") == 0;
    RowComparison comparison = {.why_not = report->why_not};
    if (!comparison.why_not && newer->key.lanes != older->key.lanes)
        comparison.why_not = "their lanes differ";
    if (!comparison.why_not)
        comparison = row_compare(&newer_times, &older_times, is_cpu,
                                 side->row_count * (side->report_count - 1), baseline_tolerance);
    if (!comparison.why_not && !isfinite(comparison.frame.high))
        comparison.why_not = "there are too few runs; measure longer (glint bench --seconds)";
    if (!comparison.why_not) cell->ratio = comparison.frame.ratio;
    cell->comparison = comparison;
}

static void report_compare(SideBySide *side, size_t index)
{
    SideReport *report = &side->reports[index];
    double logarithms = 0;
    report->why_not = baselines_why_not_compared(report->baseline, side->reports[0].baseline);
    for (size_t row = 0; row < side->row_count; row++) {
        SideCell *cell = side_cell(side, row, index);
        cell_compare(side, cell, report, side_cell(side, row, 0));
        if (cell->ratio == 0) continue;
        report->ratio_count++;
        logarithms += log(cell->ratio);
        if (!cell->comparison.why_not) report->verdicts[cell->comparison.verdict]++;
    }
    // Fleming, Wallace: "How Not to Lie with Statistics: The Correct Way to Summarize Benchmark Results",
    // 1986
    if (report->ratio_count > 0) report->mean_ratio = exp(logarithms / (double)report->ratio_count);
}

// Adds a message unless the report has rows and each has the hash of its scene.
static void rows_check(const SideReport *report, MessageList *messages)
{
    if (report->baseline->count == 0) message_error(messages, "'%s' has no rows", report->path);
    for (size_t i = 0; i < report->baseline->count; i++) {
        if (report->baseline->items[i].key.scene_hash != 0) continue;
        message_error(messages, "'%s': row %zu has no valid scene_hash", report->path, i + 1);
        return;
    }
}

// Reads and compares reports. Returns false with messages if one cannot be read. side_by_side_close frees
// what was read in either case.
static bool side_by_side_open(SideBySide *side, char *const *paths, size_t count, MessageList *messages)
{
    size_t rows_max = 0;
    *side = (SideBySide){0};
    for (size_t i = 0; i < count; i++) {
        SideReport *report = &side->reports[side->report_count];
        *report = (SideReport){.path = paths[i], .baseline = baseline_open(paths[i], false, messages)};
        if (!report->baseline) continue;
        side->report_count++;
        rows_max += report->baseline->count;
        rows_check(report, messages);
    }
    if (message_count(messages, MESSAGE_ERROR) > 0) return false;
    side->cells = memory_allocate_zeroed(rows_max * count, sizeof *side->cells);
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < side->reports[i].baseline->count; k++)
            row_place(side, i, &side->reports[i].baseline->items[k]);
    for (size_t i = 1; i < count; i++)
        report_compare(side, i);
    return true;
}

static void side_by_side_close(SideBySide *side)
{
    for (size_t i = 0; i < side->report_count; i++)
        baseline_close(side->reports[i].baseline);
    free(side->cells);
}

static const ResultTable side_table = {
    .rows = "rows.cells",
    .names = {"scene", "size", "precision", "lanes", "BVH=bvh", "samples", "bounces", "variant", "report"},
    .values = {"frame ms=frame_ms.median", "lower quartile=frame_ms.lower_quartile",
               "upper quartile=frame_ms.upper_quartile", "kernel ms=kernel_ms.median",
               "ratio to A=comparison", "verdict=comparison.verdict"},
    .is_one_table = true,
};

static char report_letter(size_t report)
{
    return (char)('A' + report);
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

// Returns what the page draws and the text lists. The caller closes it.
static Json *side_by_side_json(const SideBySide *side)
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
    if (index > 0) printf(", %zu of them with times in A", report->ratio_count);
    if (report->ratio_count > 0) printf(": %.3g of A's frame time (geometric mean)", report->mean_ratio);
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

static void side_by_side_print(const SideBySide *side)
{
    for (size_t i = 0; i < side->report_count; i++)
        report_print(side, i);
    report_output(side_by_side_json(side), &(ReportOptions){.table = &side_table}, side_notes, side);
}

// Returns whether the page would replace one of the reports, with a message.
static bool page_overwrites(const char *page, char *const *paths, size_t count, MessageList *messages)
{
    const FileId target = file_id(page);
    for (size_t i = 0; i < count; i++) {
        if (!file_is_same(file_id(paths[i]), target)) continue;
        message_error(messages, "--html would overwrite the report '%s'", paths[i]);
        return true;
    }
    return false;
}

static bool page_write(const SideBySide *side, const char *path, MessageList *messages)
{
    OwnedText page = {0};
    page_append(&page, "side.html", side_by_side_json(side), NULL);
    return output_write_file(path, page.items, page.count, messages);
}

int side_by_side_run(char *const *paths, size_t count, const char *page)
{
    SideBySide side = {0};
    MessageList messages = {0};
    const bool is_done = !(page && page_overwrites(page, paths, count, &messages)) &&
                         side_by_side_open(&side, paths, count, &messages) &&
                         (!page || page_write(&side, page, &messages));
    if (is_done) side_by_side_print(&side);
    messages_print(&messages, NULL);
    side_by_side_close(&side);
    return is_done ? EXIT_DONE : EXIT_USER;
}
