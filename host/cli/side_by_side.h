// Compares reports of glint bench from several devices, versions or days, row by row.
#pragma once

#include "host/base/json.h"
#include "host/cli/bench_report.h"
#include "host/measure/baseline.h"

enum { SIDE_REPORTS_MAX = 26 }; // a report is named by a letter

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

// Reads reports, prints their comparison and writes it as a page unless `page` is NULL. Returns the exit
// status.
int side_by_side_run(char *const *paths, size_t count, const char *page);

// Returns the first cell of a row that has one.
const SideCell *side_first(const SideBySide *side, size_t row);
static inline SideCell *side_cell(const SideBySide *side, size_t row, size_t report)
{
    return &side->cells[row * side->report_count + report];
}

void side_by_side_print(const SideBySide *side);
Json *side_by_side_json(const SideBySide *side); // what the page draws; the caller closes it
