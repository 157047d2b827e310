// Compares rows of glint bench with those of another report, or of another program.
#pragma once

#include "host/base/json.h"
#include "host/measure/comparison.h"
#include <stdio.h>

// The comparison of a row, or the reason why there is none.
typedef struct {
    Comparison frame;     // compares frame times
    Comparison processor; // compares the processes' CPU times
    bool has_processor;   // whether both reports have a CPU device
    Verdict verdict;      // follows from both
    const char *why_not;  // NULL if there are comparisons
} RowComparison;

// The times that a report has for a row.
typedef struct {
    ReportTimes wall, processor;
} RowTimes;

// Compares a row of two reports. `row_count` rows are compared in total. `is_cpu` tells whether the device is
// a CPU, in which case the process's CPU time is also compared.
RowComparison row_compare(const RowTimes *newer, const RowTimes *older, bool is_cpu, size_t row_count,
                          double tolerance);

// Appends lines with the ratios, or nothing if the row was not compared.
void comparison_append(Text *notes, const RowComparison *comparison);
void comparison_json(Json *json, const RowComparison *comparison); // adds the object "comparison"
// Adds the verdict, the ratio and its interval.
void verdict_json(Json *json, const Comparison *comparison, Verdict verdict);
// Returns the exit status that follows from the comparisons, and prints a message unless nothing is slower.
// `other` names what the rows were compared with.
int comparisons_status(const RowComparison *comparisons, size_t count, const char *other);
