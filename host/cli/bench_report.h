// Composes the report of glint bench as a table, or as JSON, from which other formats are made.
#pragma once

#include "host/cli/bench_comparison.h"
#include "host/cli/format.h"
#include "host/cli/variants.h"
#include "host/measure/bench.h"
#include "host/opencl/device.h"

typedef struct {
    const Device *device;
    const VariantSet *set;
    bool lists_launches;
    const RowComparison *comparisons; // of the rows with those of the baseline, or NULL
} BenchReport;

// Prints and writes the report as the options ask. Returns false with a message if the file cannot be
// written.
bool bench_print(const BenchReport *report, const ReportOptions *options);
extern const ResultTable bench_table; // describes this report and that of --against

// The functions below print parts of a report and are shared with glint bench --against.
Json *bench_json_open(const Device *device); // opens a report with its device, date, host and build
void key_json(Json *json, const BenchKey *key);
void samples_json(Json *json, const char *key, const Series *seconds); // in milliseconds
