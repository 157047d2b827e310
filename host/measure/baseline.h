// An earlier report of glint bench, to compare a new one with.
#pragma once

#include "host/base/message.h"
#include "host/measure/bench.h"

typedef struct Baseline Baseline;

// Reads a file that glint bench --json wrote; NULL with a message where it is none.
Baseline *baseline_open(const char *path, MessageList *messages);
void baseline_close(Baseline *baseline);
const char *baseline_device(const Baseline *baseline); // its name, or "" where the report has none

typedef struct {
    bool found; // the baseline has this row, with times
    // of medians, new over old: above 1 is slower
    double frame, kernel;
} Ratio;

Ratio baseline_ratio(const Baseline *baseline, const BenchRow *row);
