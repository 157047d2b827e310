// glint bench --against compares two builds, measured interleaved by pairs of processes.
#pragma once

#include "host/cli/format.h"
#include "host/cli/options.h"
#include "host/cli/variants.h"

typedef struct {
    const char *other; // the program to compare with
    double tolerance, seconds;
    ReportOptions report;
    int argument_count; // the arguments of glint bench, for the workers
    char **arguments;
} AgainstOptions;

// Compares each variant's frame time with the other program's, and prints the report. `device` must be the
// device that both programs choose. Returns the exit status.
int bench_against(const AgainstOptions *options, VariantSet *set, const Device *device);

// Runs a worker: for each line of standard input, runs every variant once and prints the seconds of its
// frames. Returns the exit status.
int bench_work(VariantSet *set, Compute *compute);
