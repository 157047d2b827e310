// Decides from a sample of an image's pixels whether the image keeps an error that a user allows.
#pragma once

#include "host/render/film.h"
#include <stdbool.h>
#include <stddef.h>

typedef enum {
    ERROR_RMSE, // over all channels, linear light
    ERROR_MAX,  // the largest of any channel, linear light
    ERROR_FLIP, // mean (flip.h)
    ERROR_METRIC_COUNT
} ErrorMetric;
extern const char *const error_metric_names[ERROR_METRIC_COUNT];

typedef struct {
    double limit; // > 0
    ErrorMetric metric;
} ErrorBudget;

// Returns an upper confidence bound on the mean of values within 0..1. It is below the true mean with a
// probability of at most `risk`, whatever their distribution. The values must be independent. Those of a
// stratified sample, one from each stratum, need not have the same distribution.
double mean_upper_bound(const double *values, size_t count, double risk);

typedef struct {
    // The sample's error. Infinite if a pixel or, for ERROR_RMSE, the range of the colors is not finite.
    double error;
    // The bound on the whole image's error, except for the risk. For ERROR_MAX, the bound on the share of
    // pixels beyond the limit. Infinite if a pixel is not finite.
    double bound;
    bool keeps; // the bound is within the limit; for ERROR_MAX, no pixel of the sample is beyond it
} SampleVerdict;

// Describes how an image was sampled.
typedef struct {
    size_t drawn; // the sample's first pixels, drawn at random, one from each of equal parts of the image
    double drawn_share;  // the share of the image that these parts cover; the sample has all other pixels
    double color_max;    // the upper bound of the image's channels, whose lower bound is 0
    double risk;         // the probability that a bound does not hold
    bool display_values; // colors are shown on a screen without the sRGB curve
} Sampling;

// Returns the bound on an image's RMSE if all pixels of the sample equal the reference's. No sample shows a
// lower bound.
double sample_rmse_floor(const Sampling *sampling);

// Classifies a sample. `reference` and `sample` must have the same pixels.
SampleVerdict sample_classify(const ErrorBudget *budget, const Film *reference, const Film *sample,
                              const Sampling *sampling);
