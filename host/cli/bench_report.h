// The report of glint bench: a table or JSON.
#pragma once

#include "host/measure/baseline.h"
#include "host/measure/bench.h"
#include "host/opencl/device.h"
#include "host/render/renderer.h"

typedef struct {
    const Device *device;
    const Peak *peak;
    const BenchRow *rows;
    const RenderReport *const *reports; // of each row's last run, for --launches; or NULL
    size_t count;
    const Baseline *baseline; // or NULL
    double tolerance;
} BenchReport;

void bench_print_text(const BenchReport *report, FILE *stream);
void bench_print_json(const BenchReport *report);
// Number of rows slower than the baseline by more than the tolerance, and whether any row is in the baseline.
size_t bench_slower_count(const BenchReport *report, bool *any_common);
