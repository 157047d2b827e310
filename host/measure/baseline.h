// Reads an earlier report of glint bench, to compare a new one with it.
#pragma once

#include "host/base/message.h"
#include "host/measure/bench.h"
#include "host/measure/comparison.h"

typedef struct Baseline Baseline;

enum { BENCH_SCHEMA = 6 }; // the version of the reports' schema

// Reads a file that glint bench --json wrote. Returns NULL with a message if it is not such a report, or was
// calibrated by another workload.
Baseline *baseline_open(const char *path, MessageList *messages);
void baseline_close(Baseline *baseline);
// Return the names of the device, its board and the host, or "" if the report has none.
const char *baseline_device(const Baseline *baseline);
const char *baseline_board(const Baseline *baseline);
const char *baseline_host(const Baseline *baseline);

// Finds the wall and processor times of the row with this key. The scene's path is ignored. Returns false if
// the baseline lacks the row.
bool baseline_find(const Baseline *baseline, const BenchKey *key, ReportTimes *wall, ReportTimes *processor);
