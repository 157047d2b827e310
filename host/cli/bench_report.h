// The report of glint bench: a table, or JSON, of which other formats are made.
#pragma once

#include "host/cli/format.h"
#include "host/measure/bench.h"
#include "host/measure/calibration.h"
#include "host/measure/comparison.h"
#include "host/opencl/device.h"
#include "host/render/renderer.h"

// A row's comparison, or why there is none.
typedef struct {
    Comparison frame;     // of frame times
    Comparison processor; // of the process's processor times
    bool has_processor;   // with a CPU device, of two reports
    Verdict verdict;      // of both
    const char *why_not;  // NULL: there are comparisons
} RowComparison;

typedef struct {
    const Device *device;
    const BenchRow *rows;
    const RenderReport *const *reports; // of each row's last run; NULL where it was not measured
    size_t count;
    bool lists_launches;
    const Calibration *calibration;
    const RowComparison *comparisons; // of each row with the baseline; or NULL
} BenchReport;

void bench_print_text(const BenchReport *report, FILE *stream);
Json *bench_json(const BenchReport *report); // the caller closes it
extern const ResultTable bench_table;        // of this and of --against

// Parts of a report, shared with glint bench --against.
void report_start_json(Json *json); // schema, version, date, host and build
void key_json(Json *json, const BenchKey *key);
void samples_json(Json *json, const char *key, const Series *seconds); // in milliseconds
void comparison_json(Json *json, const RowComparison *comparison);
void comparison_print(const RowComparison *comparison, FILE *stream);

// The exit status that the comparisons give, with a message unless nothing is slower; `other` is what was
// compared with.
int comparisons_status(const RowComparison *comparisons, size_t count, const char *other);
