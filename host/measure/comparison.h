// Whether one build is slower than another: confidence intervals of the ratio of their times, new over old,
// and what they allow to claim.
//
// An interval is that of the sign test for a median (Thompson: "On Confidence Ranges for the Median and Other
// Expectation Distributions for Populations of Unknown Distribution Form", 1936): its ends are order
// statistics, so it supposes no distribution and outliers do not widen it. The independent repeats are pairs
// of processes, not runs, since each process is a little faster or slower throughout (Kalibera, Jones:
// "Rigorous Benchmarking in Reasonable Time", 2013, section 3).
#pragma once

#include "host/measure/series.h"
#include <stdbool.h>

typedef enum {
    VERDICT_UNDECIDED, // too noisy to say
    VERDICT_SAME,      // within the tolerance
    VERDICT_SLOWER,
    VERDICT_FASTER,
} Verdict;

extern const char *const verdict_names[];

typedef struct {
    Verdict verdict;
    double ratio;     // new time over old, estimated
    double low, high; // its interval; 0 and infinity: too few repeats
} Comparison;

// Of all rows and looks together: the probability that any interval misses its ratio is at most
// 1 - confidence.
extern const double comparison_confidence;

// Pairs are added until every row has a verdict, and are looked at only at fixed counts: each look has half
// the error probability of the one before it, so that the sum over all looks stays within the confidence.
size_t comparison_pairs_at_look(size_t look, size_t row_count);
// At that look, of the ratios' logarithms: one for each pair of processes, whose order alternates. A verdict
// of the look before, `earlier`, stays: its interval holds together with those of all looks.
Comparison comparison_of_pairs(Comparison earlier, const Series *log_ratios, size_t look, size_t row_count,
                               double tolerance);

// The logarithm of new over old time of one pair: the median over its rounds, in each of which both ran.
double comparison_log_ratio(const Series *new_seconds, const Series *old_seconds);

// What one report knows of a row, by one clock: run i took frame[i] right after the calibration took
// calibration[i].
typedef struct {
    const Series *frame, *calibration;
} ReportTimes;

// Compares reports that were not measured together. A claim must hold whether the frame's time follows the
// machine's speed, which the calibration measures, even twice as strongly, or not: the interval covers all
// of that. It is wider by an allowance for what differs between two processes, which a report cannot know.
Comparison comparison_of_reports(ReportTimes new_times, ReportTimes old_times, size_t row_count,
                                 double tolerance);

// Compares two rows that one process ran in turn, so that run i of both belongs to one round: the interval is
// that of the median ratio within a round. It is wider by the same allowance. All `comparison_count`
// intervals hold together; with too few rounds for that they are unbounded.
Comparison comparison_of_rounds(const Series *new_seconds, const Series *old_seconds, size_t comparison_count,
                                double tolerance);

// Returns a row's verdict from comparisons of frame times and of processor times: slower if either is, else
// faster if either is, else that of the frame times, since waiting does not show in processor times.
Verdict verdict_of_row(Verdict frame, Verdict processor);
