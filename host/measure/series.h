// Summarizes repeated measurements of one quantity without supposing a distribution.
#pragma once

#include "host/base/array.h"
#include <stddef.h>

typedef ARRAY_OF(double) Series;

typedef struct {
    double min, lower_quartile, median, upper_quartile, max;
    size_t count; // if 0, the other members are 0
} Summary;

void series_add(Series *series, double value);
Series series_sorted(const Series *series); // returns an ascending copy
Summary series_summarize(const Series *series);
// Frees the values and sets the series to zeros.
void series_free(Series *series);
#define OwnedSeries __attribute__((cleanup(series_free))) Series
