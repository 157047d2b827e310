// Measures the difference of an image from a reference.
#pragma once

#include "host/base/message.h"
#include "host/image/image.h"

// Summarizes the differences test - reference of many values. Excludes pairs in which a value is not finite.
typedef struct {
    size_t count;               // values compared
    double largest, rmse, bias; // bias is the mean difference with its sign
    double percentile_999;      // the smallest magnitude that is at least as large as 99.9% of them
    double psnr;                // dB for a peak of 1; infinite if nothing differs
    // The mean of difference^2 / (reference^2 + 0.01) (Rousselle, Knaus, Zwicker: "Adaptive Sampling and
    // Reconstruction using Greedy Error Minimization", 2011)
    double rel_mse;
} ErrorSummary;

// Returns the absolute difference of two values. It is infinite if one is not finite, unless both are NaN or
// the same infinity.
double value_error(double reference, double test);
ErrorSummary error_summarize(const double *reference, const double *test, size_t count);

typedef struct {
    size_t differing_count;                     // values whose bits differ, in the files' type
    size_t nonfinite_reference, nonfinite_test; // pixels
    size_t unmatched_count;    // pairs of values of which one is NaN or infinite and the other differs
    ErrorSummary linear;       // compares linear light, or data as they are
    uint32_t worst_x, worst_y; // the pixel of the largest difference, or of a number that became NaN
    // Only for floats and doubles from EXR and NPY:
    bool has_ulp;
    double largest_ulp; // the largest ulp_distance; infinite if a value is unmatched
    // Only for colors:
    bool has_color;
    double srgb_psnr;             // dB, 8-bit display values
    size_t off_by_1, off_by_more; // 8-bit display values
    double flip_mean, flip_max;
} ImageMetrics;

// Returns the distance in units in the last place of `expected` as a double or as a float. It is at most 0.5
// if `found` is the nearest value of the type. It is 0 if both are NaN or the same infinity, infinite if only
// one is, and otherwise at most DBL_MAX.
double ulp_distance(double expected, double found, bool is_double);

typedef enum { IMAGE_LINEAR, IMAGE_DISPLAY, IMAGE_DATA, IMAGE_CONTENT_COUNT } ImageContent;

// What images contain: "linear light", "display values" or "data".
extern const char *const image_content_names[IMAGE_CONTENT_COUNT];
ImageContent image_content(const Image *image);
// Returns false with an error message if the two images differ in size or content and so cannot be compared.
bool image_comparable(const Image *reference, const Image *test, MessageList *messages);

// Returns the metrics of comparable images. Display values are compared as light, with the sRGB curve undone
// whatever curve they were written with, as on a screen. An image with 1 channel of display values is gray.
ImageMetrics image_metrics(const Image *reference, const Image *test);

// Fills `errors` with the largest value_error among each pixel's channels, as light.
void image_errors(const Image *reference, const Image *test, float *errors);
