// Repeated measurements of one thing, and what can be said of them without supposing a distribution.
#pragma once

#include <stddef.h>

typedef struct {
    double *items;
    size_t count, capacity;
} Series;

typedef struct {
    double min, median, max;
    double quartile_range; // upper quartile - lower quartile
    size_t count;          // 0: the others are 0, too
} Summary;

void series_add(Series *series, double value);
Series series_sorted(const Series *series); // a copy, ascending
Summary series_summarize(const Series *series);
void series_free(Series *series); // and zeroes
