// Decides whether one build is slower than another, from confidence intervals of the ratio of their times,
// new over old.
//
// The intervals are those of the sign test for a median (Thompson: "On Confidence Ranges for the Median and
// Other Expectation Distributions for Populations of Unknown Distribution Form", 1936). Their ends are order
// statistics, so they suppose no distribution and outliers do not widen them. The independent repeats are
// pairs of processes, not runs, since each process is a little faster or slower throughout (Kalibera, Jones:
// "Rigorous Benchmarking in Reasonable Time", 2013, section 3).
#pragma once

#include "host/measure/series.h"
#include <stdbool.h>

typedef enum {
    VERDICT_UNDECIDED, // too noisy to decide
    VERDICT_SAME,      // within the tolerance
    VERDICT_SLOWER,
    VERDICT_FASTER,
} Verdict;

extern const char *const verdict_names[];

typedef struct {
    Verdict verdict;
    double ratio;     // new time over old, estimated
    double low, high; // its interval; 0 and infinity if there are too few repeats
} Comparison;

// The probability that any interval of any row and look misses its ratio is at most 1 - confidence.
extern const double comparison_confidence;

// Returns the number of pairs at a look. Pairs are added until every row has a verdict, and are examined only
// at these fixed counts. Each look has half the error probability of the one before it, so that the sum over
// all looks stays within the confidence.
size_t comparison_pairs_at_look(size_t look, size_t row_count);
// Returns the comparison at a look from the logarithms of the ratios, one per pair of processes, whose order
// alternates. A verdict of the look before, `earlier`, is kept, since the intervals of all looks hold
// together.
Comparison comparison_of_pairs(Comparison earlier, const Series *log_ratios, size_t look, size_t row_count,
                               double tolerance);

// Returns the logarithm of new over old time of one pair, as the median over its rounds, in each of which
// both ran.
double comparison_log_ratio(const Series *new_seconds, const Series *old_seconds);

// The times that one report has for a row, by one clock. Run i took frame[i], immediately after the
// calibration took calibration[i].
typedef struct {
    const Series *frame, *calibration;
} ReportTimes;

// Compares reports that were not measured together. A claim must hold whether or not the frame's time follows
// the machine's speed, which the calibration measures, and even if it follows twice as strongly. The
// interval covers all of that, and an allowance for differences between two processes, which a report
// cannot show.
Comparison comparison_of_reports(ReportTimes new_times, ReportTimes old_times, size_t row_count,
                                 double tolerance);

// Compares two rows that one process ran in turn, so that run i of both belongs to one round. The interval is
// that of the median ratio within a round, wider by an allowance for differences between two processes. All
// `comparison_count` intervals hold together. With too few rounds for that they are unbounded.
Comparison comparison_of_rounds(const Series *new_seconds, const Series *old_seconds, size_t comparison_count,
                                double tolerance);

// Compares the last fifth of a row's runs with the first, each by its median. The verdict is slower or faster
// if the ratio's interval, for which runs are independent, is beyond the tolerance. A single change within
// either fifth may remain undecided.
Comparison comparison_of_ends(const Series *seconds, size_t row_count, double tolerance);

// Returns a row's verdict from comparisons of frame times and of processor times. It is slower if either is,
// else faster if processor times are, else that of the frame times, since waiting does not show in processor
// times. Frame times alone do not make a row faster, because with two processes that worked and paused next
// to other programs, they did in 1 of 43 comparisons of a build with itself.
Verdict verdict_of_row(Verdict frame, Verdict processor);
