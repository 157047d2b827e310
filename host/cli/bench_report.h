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

void bench_print_text(const BenchReport *report, FILE *stream);
Json *bench_json(const BenchReport *report); // the caller closes it
extern const ResultTable bench_table;        // describes this report and that of --against

// The functions below print parts of a report and are shared with glint bench --against.
Json *bench_json_open(const Device *device); // opens a report with its device, date, host and build
void key_json(Json *json, const BenchKey *key);
void samples_json(Json *json, const char *key, const Series *seconds); // in milliseconds
