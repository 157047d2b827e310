// What glint bench reports: a table for people, or JSON.
#pragma once

#include "host/measure/baseline.h"
#include "host/measure/bench.h"
#include "host/opencl/device.h"
#include "host/render/renderer.h"

typedef struct {
    const Device *device;
    const Peak *peak;
    const BenchRow *rows;
    const RenderReport *const *reports; // of each row's last run, to list its launches; or NULL
    size_t count;
    const Baseline *baseline; // or NULL
    double tolerance;
} BenchReport;

void bench_print_text(const BenchReport *report, FILE *stream);
void bench_print_json(const BenchReport *report);
// Rows that are slower than the baseline by more than the tolerance, and whether it has any of the rows.
size_t bench_slower_count(const BenchReport *report, bool *any_common);
