#include "host/measure/series.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include <stdlib.h>
#include <string.h>

void series_add(Series *series, double value)
{
    array_push(*series, value);
}

static int number_compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Returns a quantile, interpolated linearly between neighbors (Hyndman, Fan: "Sample Quantiles in Statistical
// Packages", 1996, definition 7).
static double sorted_quantile(const double *sorted, size_t count, double fraction)
{
    double place = fraction * (double)(count - 1);
    size_t below = (size_t)place;
    if (below + 1 == count) return sorted[below];
    return sorted[below] + (place - (double)below) * (sorted[below + 1] - sorted[below]);
}

Series series_sorted(const Series *series)
{
    Series copy = {.count = series->count, .capacity = series->count};
    if (series->count == 0) return copy;
    copy.items = memory_allocate(series->count, sizeof *copy.items);
    memcpy(copy.items, series->items, series->count * sizeof *copy.items);
    qsort(copy.items, copy.count, sizeof *copy.items, number_compare);
    return copy;
}

Summary series_summarize(const Series *series)
{
    size_t count = series->count;
    if (count == 0) return (Summary){0};
    OwnedSeries copy = series_sorted(series);
    const double *sorted = copy.items;
    return (Summary){
        .min = sorted[0],
        .lower_quartile = sorted_quantile(sorted, count, 0.25),
        .median = sorted_quantile(sorted, count, 0.5),
        .upper_quartile = sorted_quantile(sorted, count, 0.75),
        .max = sorted[count - 1],
        .count = count,
    };
}

void series_free(Series *series)
{
    free(series->items);
    *series = (Series){0};
}
