// Composes the report of glint bench as a table, or as JSON, from which other formats are made.
#pragma once

#include "host/cli/format.h"
#include "host/cli/variants.h"
#include "host/measure/bench.h"
#include "host/measure/comparison.h"
#include "host/opencl/device.h"

// The comparison of a row, or the reason why there is none.
typedef struct {
    Comparison frame;     // compares frame times
    Comparison processor; // compares the processes' processor times
    bool has_processor;   // true for two reports with a CPU device
    Verdict verdict;      // follows from both
    const char *why_not;  // NULL if there are comparisons
} RowComparison;

// The times that a report has for a row.
typedef struct {
    ReportTimes wall, processor;
} RowTimes;

// Compares a row of two reports, one of `row_count` that are compared. `is_cpu` is whether the device is one,
// so that the process's processor time counts.
RowComparison row_compare(const RowTimes *newer, const RowTimes *older, bool is_cpu, size_t row_count,
                          double tolerance);

typedef struct {
    const Device *device;
    const VariantSet *set;
    bool lists_launches;
    const RowComparison *comparisons; // of the rows with the baseline, or NULL
} BenchReport;

void bench_print_text(const BenchReport *report, FILE *stream);
Json *bench_json(const BenchReport *report); // the caller closes it
extern const ResultTable bench_table;        // describes this report and that of --against

// The functions below print parts of a report and are shared with glint bench --against.
Json *bench_json_open(const Device *device); // opens a report with its device, date, host and build
void key_json(Json *json, const BenchKey *key);
void samples_json(Json *json, const char *key, const Series *seconds); // in milliseconds
void comparison_json(Json *json, const RowComparison *comparison);
void comparison_print(const RowComparison *comparison, FILE *stream);

// Returns the exit status that follows from the comparisons, and prints a message unless nothing is slower.
// `other` names what the rows were compared with.
int comparisons_status(const RowComparison *comparisons, size_t count, const char *other);
