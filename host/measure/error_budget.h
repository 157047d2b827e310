// An error that a user allows an image, and what a sample of its pixels says about it.
#pragma once

#include "host/render/film.h"
#include <stdbool.h>
#include <stddef.h>

typedef enum {
    ERROR_RMSE, // of all channels, linear light
    ERROR_MAX,  // of a channel, linear light
    ERROR_FLIP, // mean (flip.h)
    ERROR_METRIC_COUNT
} ErrorMetric;
extern const char *const error_metric_names[ERROR_METRIC_COUNT];

typedef struct {
    double limit; // > 0
    ErrorMetric metric;
} ErrorBudget;

// Upper confidence bound of the mean of values within 0..1: it is below the true mean with a probability of
// at most `risk`, whatever their distribution. They must be independent; those of a stratified sample, one
// from each stratum, need not be distributed alike.
double mean_upper_bound(const double *values, size_t count, double risk);

typedef struct {
    double error; // the sample's own
    // The whole image's is at most this, but for the risk; of ERROR_MAX instead: the share of pixels beyond
    // the limit. Infinite where a pixel is not finite.
    double bound;
    bool keeps; // the bound is within the limit; of ERROR_MAX: no pixel of the sample is beyond it
} SampleVerdict;

// How an image was sampled.
typedef struct {
    size_t drawn;        // the first pixels of the sample: one each from equal parts of the image, at random
    double drawn_share;  // of the image that these parts cover; the other pixels of the sample are the rest
    double color_max;    // no channel of the image is larger, or below 0
    double risk;         // of a bound that does not hold
    bool display_values; // see accuracy_compare
} Sampling;

// Returns the bound of an image's RMSE if all pixels of the sample are alike: no sample shows a lower one.
double sample_rmse_floor(const Sampling *sampling);

// `reference` and `sample` are of the same pixels.
SampleVerdict sample_judge(const ErrorBudget *budget, const Film *reference, const Film *sample,
                           const Sampling *sampling);
