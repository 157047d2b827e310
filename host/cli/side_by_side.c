#include "host/cli/side_by_side.h"

#include "host/base/exit_status.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include "host/cli/page.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

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

const SideCell *side_first(const SideBySide *side, size_t row)
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
        comparison.why_not = "there are too few runs";
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
    Text page = {0};
    page_append(&page, "side.html", side_by_side_json(side), NULL);
    const bool is_written = output_write_file(path, page.items, page.count, messages);
    text_free(&page);
    return is_written;
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
