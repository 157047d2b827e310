// How far an image is from a reference, in numbers.
#pragma once

#include "host/base/message.h"
#include "host/image/image.h"

// Of the differences test - reference of many values; those that are not finite in both are left out.
typedef struct {
    size_t count;               // values compared
    double largest, rmse, bias; // bias: the mean with its sign
    double percentile_999;      // 99.9 % of the magnitudes are no larger; the smallest such magnitude
    double psnr;                // dB for a peak of 1; infinite where nothing differs
    // mean of difference^2 / (reference^2 + 0.01) (Rousselle, Knaus, Zwicker: "Adaptive Sampling and
    // Reconstruction using Greedy Error Minimization", 2011)
    double rel_mse;
} ErrorSummary;

ErrorSummary error_summarize(const double *reference, const double *test, size_t count);

typedef struct {
    size_t differing_count;                     // values whose bits differ, at the files' own width
    size_t nonfinite_reference, nonfinite_test; // pixels
    size_t unmatched_count;    // values of which one is NaN or infinite and the other differs
    ErrorSummary linear;       // of light, or of data as they are
    uint32_t worst_x, worst_y; // where the largest difference is, or one of a number to none
    // of floats and doubles from EXR and NPY only
    bool has_ulp;
    double largest_ulp; // see ulp_distance; infinite where a value is unmatched
    // of colors only
    bool has_color;
    double srgb_psnr;             // of 8-bit display values, dB
    size_t off_by_1, off_by_more; // 8-bit display values
    double flip_mean, flip_max;
} ImageMetrics;

// Returns the distance in units in the last place of `expected`, as a double or as a float: 0.5 at most where
// the nearest value of the type was found. 0 if both are NaN or the same infinity; infinite if only one is,
// and else at most DBL_MAX.
double ulp_distance(double expected, double found, bool is_double);

const char *image_kind(const Image *image); // what the values are: "display values", "linear light", "data"
// False, with an error message, where the two differ in size or kind, so that there is nothing to compare.
bool image_comparable(const Image *reference, const Image *test, MessageList *messages);

// Of comparable images. Display values are compared as light: with the sRGB curve undone, whatever curve
// they were written with, because a screen does so. An image of 1 channel of display values is gray.
ImageMetrics image_metrics(const Image *reference, const Image *test);

// The largest difference among each pixel's channels, as light; infinite where one is finite and the other is
// not, 0 where neither is.
void image_errors(const Image *reference, const Image *test, float *errors);
