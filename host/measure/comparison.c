#include "host/measure/comparison.h"

#include <math.h>

const char *const verdict_names[] = {
    [VERDICT_UNDECIDED] = "undecided",
    [VERDICT_SAME] = "same",
    [VERDICT_SLOWER] = "slower",
    [VERDICT_FASTER] = "faster",
};

const double comparison_confidence = 0.99;

// The ratio by which the times of two processes of one build may differ.
static const double process_allowance = 1.03;

// The exponent by which a slower calibration slows a frame. Other work may slow a frame by the square of the
// calibration's slowdown, or not at all.
static const double exponent_max = 2;

// The number of parts of a report whose medians are compared. Consecutive runs are correlated, and these
// medians are less so.
enum { REPORT_BLOCKS = 20 };

typedef struct {
    double low, high;
} RatioInterval;

// Returns the probability that `heads` of `count` fair coins show heads. Uses logarithms, since 2^-count may
// underflow.
static double heads_probability(size_t count, size_t heads)
{
    const double n = (double)count, k = (double)heads;
    return exp(lgamma(n + 1) - lgamma(k + 1) - lgamma(n - k + 1) - n * log(2));
}

// Returns an interval that misses the median with a probability of at most `error`.
static RatioInterval median_interval(const Series *values, double error)
{
    const size_t count = values->count;
    size_t end = 0; // the number of values at either end of the sorted ones beyond which the median may lie
    for (double missed = 0; 2 * end < count; end++) {
        missed += 2 * heads_probability(count, end);
        if (missed > error) break;
    }
    if (end == 0) return (RatioInterval){-INFINITY, INFINITY};
    OwnedSeries sorted = series_sorted(values);
    return (RatioInterval){sorted.items[end - 1], sorted.items[count - end]};
}

// The verdict is slower or faster if the whole interval lies beyond `threshold`, a factor from 1, or its
// inverse.
static Comparison comparison_classify(double log_ratio, RatioInterval interval, double tolerance,
                                      double threshold)
{
    Comparison comparison = {.ratio = exp(log_ratio), .low = exp(interval.low), .high = exp(interval.high)};
    if (comparison.low >= 1 / tolerance && comparison.high <= tolerance)
        comparison.verdict = VERDICT_SAME;
    else if (comparison.low > threshold)
        comparison.verdict = VERDICT_SLOWER;
    else if (comparison.high < 1 / threshold)
        comparison.verdict = VERDICT_FASTER;
    return comparison;
}

static double row_error(size_t row_count)
{
    return (1 - comparison_confidence) / (double)row_count;
}

static double look_error(size_t look, size_t row_count)
{
    return ldexp(row_error(row_count), -1 - (int)look);
}

size_t comparison_pairs_at_look(size_t look, size_t row_count)
{
    size_t first = 1;
    while (2 * heads_probability(first, 0) > look_error(0, row_count))
        first++;
    return first << look;
}

Comparison comparison_of_pairs(Comparison earlier, const Series *log_ratios, size_t look, size_t row_count,
                               double tolerance)
{
    if (earlier.verdict != VERDICT_UNDECIDED) return earlier;
    return comparison_classify(series_summarize(log_ratios).median,
                               median_interval(log_ratios, look_error(look, row_count)), tolerance, 1);
}

double comparison_log_ratio(const Series *new_seconds, const Series *old_seconds)
{
    OwnedSeries ratios = {0};
    for (size_t i = 0; i < new_seconds->count && i < old_seconds->count; i++)
        series_add(&ratios, log(new_seconds->items[i] / old_seconds->items[i]));
    return series_summarize(&ratios).median;
}

// Returns the logarithms of seconds / divisor^exponent, as medians of REPORT_BLOCKS consecutive blocks, or of
// single runs if there are fewer.
static Series ratio_blocks(const Series *seconds, const Series *divisors, double exponent)
{
    const size_t count = seconds->count < divisors->count ? seconds->count : divisors->count;
    const size_t block_count = count < REPORT_BLOCKS ? count : REPORT_BLOCKS;
    Series blocks = {0};
    for (size_t block = 0; block < block_count; block++) {
        OwnedSeries part = {0};
        for (size_t i = block * count / block_count; i < (block + 1) * count / block_count; i++)
            series_add(&part, log(seconds->items[i]) - exponent * log(divisors->items[i]));
        series_add(&blocks, series_summarize(&part).median);
    }
    return blocks;
}

static RatioInterval interval_widen(RatioInterval interval)
{
    return (RatioInterval){interval.low - log(process_allowance), interval.high + log(process_allowance)};
}

Comparison comparison_of_rounds(const Series *new_seconds, const Series *old_seconds, size_t comparison_count,
                                double tolerance)
{
    OwnedSeries blocks = ratio_blocks(new_seconds, old_seconds, 1);
    const RatioInterval interval = interval_widen(median_interval(&blocks, row_error(comparison_count)));
    return comparison_classify(series_summarize(&blocks).median, interval, tolerance, 1);
}

Comparison comparison_of_ends(const Series *seconds, size_t row_count, double tolerance)
{
    const size_t fifth = seconds->count / 5;
    if (fifth == 0) return (Comparison){.ratio = 1, .high = INFINITY};
    const double error = row_error(row_count) / 2; // shared by two medians
    RatioInterval intervals[2];
    double medians[2];
    for (size_t i = 0; i < 2; i++) {
        const Series end = {.items = seconds->items + i * (seconds->count - fifth), .count = fifth};
        OwnedSeries blocks = ratio_blocks(&end, &end, 0);
        intervals[i] = median_interval(&blocks, error);
        medians[i] = series_summarize(&blocks).median;
    }
    const double low = intervals[1].low - intervals[0].high, high = intervals[1].high - intervals[0].low;
    return comparison_classify(medians[1] - medians[0], (RatioInterval){low, high}, tolerance, tolerance);
}

// Returns an interval of the median, unbounded for fewer blocks than REPORT_BLOCKS, since runs of one report
// are correlated.
static RatioInterval blocks_interval(const Series *blocks, double error)
{
    return blocks->count < REPORT_BLOCKS ? (RatioInterval){-INFINITY, INFINITY}
                                         : median_interval(blocks, error);
}

Comparison comparison_of_reports(ReportTimes new_times, ReportTimes old_times, size_t row_count,
                                 double tolerance)
{
    RatioInterval covering = {INFINITY, -INFINITY};
    double log_ratio = 0;
    for (int i = 0; i < 2; i++) {
        const double exponent = i * exponent_max;
        OwnedSeries new_blocks = ratio_blocks(new_times.frame, new_times.calibration, exponent),
                    old_blocks = ratio_blocks(old_times.frame, old_times.calibration, exponent);
        // the right exponent lies between these two, and the error is shared by two medians
        RatioInterval new_median = blocks_interval(&new_blocks, row_error(row_count) / 2),
                      old_median = blocks_interval(&old_blocks, row_error(row_count) / 2);
        covering.low = fmin(covering.low, new_median.low - old_median.high);
        covering.high = fmax(covering.high, new_median.high - old_median.low);
        log_ratio += (series_summarize(&new_blocks).median - series_summarize(&old_blocks).median) / 2;
    }
    return comparison_classify(log_ratio, interval_widen(covering), tolerance, 1);
}

Verdict verdict_of_row(Verdict frame, Verdict processor)
{
    if (frame == VERDICT_SLOWER || processor == VERDICT_SLOWER) return VERDICT_SLOWER;
    if (processor == VERDICT_FASTER) return VERDICT_FASTER;
    return frame == VERDICT_FASTER ? VERDICT_UNDECIDED : frame;
}
