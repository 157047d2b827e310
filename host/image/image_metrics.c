#include "host/image/image_metrics.h"

#include "host/base/memory.h"
#include "host/base/percentile.h"
#include "host/base/text.h"
#include "host/image/flip.h"
#include "host/image/srgb.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static size_t pixel_count(const Image *image)
{
    return (size_t)image->width * image->height;
}

static size_t value_count(const Image *image)
{
    return pixel_count(image) * image->channels;
}

static bool is_same_number(double a, double b)
{
    return a == b || (isnan(a) && isnan(b));
}

double value_error(double reference, double test)
{
    if (isfinite(reference) && isfinite(test)) return fabs(test - reference);
    return is_same_number(reference, test) ? 0 : INFINITY;
}

ErrorSummary error_summarize(const double *reference, const double *test, size_t count)
{
    ErrorSummary summary = {.psnr = INFINITY};
    OWNED float *magnitudes = memory_allocate(count, sizeof *magnitudes);
    double sum = 0, square_sum = 0, relative_sum = 0;
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(reference[i]) || !isfinite(test[i])) continue;
        double expected = reference[i], difference = test[i] - expected;
        double square = difference * difference;
        sum += difference;
        square_sum += square;
        relative_sum += square / (expected * expected + 0.01);
        summary.largest = fmax(summary.largest, fabs(difference));
        magnitudes[summary.count++] = (float)fabs(difference);
    }
    if (summary.count == 0) return summary;
    const double compared = (double)summary.count;
    summary.bias = sum / compared;
    summary.rmse = sqrt(square_sum / compared);
    summary.rel_mse = relative_sum / compared;
    summary.psnr = -20 * log10(summary.rmse);
    summary.percentile_999 = percentile_999(magnitudes, summary.count);
    return summary;
}

const char *const image_content_names[IMAGE_CONTENT_COUNT] = {"linear light", "display values", "data"};

ImageContent image_content(const Image *image)
{
    return image->data ? IMAGE_DATA : image->display ? IMAGE_DISPLAY : IMAGE_LINEAR;
}

bool image_comparable(const Image *reference, const Image *test, MessageList *messages)
{
    if (reference->width != test->width || reference->height != test->height ||
        reference->channels != test->channels)
        return message_error(messages,
                             "the images differ in size: %ux%u with %u channel%s, and %ux%u with %u",
                             reference->width, reference->height, reference->channels,
                             text_plural(reference->channels), test->width, test->height, test->channels);
    const ImageContent first = image_content(reference), second = image_content(test);
    if (first != second)
        return message_error(messages, "the first image holds %s, the second %s", image_content_names[first],
                             image_content_names[second]);
    return true;
}

// Returns the image's values as linear light. The caller frees them.
static double *linear_values(const Image *image)
{
    size_t count = value_count(image);
    double *values = memory_allocate(count, sizeof *values);
    for (size_t i = 0; i < count; i++)
        values[i] = image->display ? srgb_decode((double)image->values[i]) : image_value(image, i);
    return values;
}

static float largest_channel_error(const double *expected, const double *found, uint32_t channels)
{
    float error = 0;
    for (uint32_t i = 0; i < channels; i++)
        error = fmaxf(error, (float)value_error(expected[i], found[i]));
    return error;
}

void image_errors(const Image *reference, const Image *test, float *errors)
{
    const uint32_t channels = reference->channels;
    OWNED double *expected = linear_values(reference), *found = linear_values(test);
    for (size_t i = 0; i < pixel_count(reference); i++)
        errors[i] = largest_channel_error(expected + i * channels, found + i * channels, channels);
}

static uint32_t display_step(const Image *image, size_t i)
{
    return image_quantize(image->values[i], image->display ? TRANSFER_NONE : TRANSFER_SRGB, 8);
}

static void steps_compare(ImageMetrics *metrics, const Image *reference, const Image *test)
{
    double square_sum = 0;
    for (size_t i = 0; i < value_count(reference); i++) {
        double difference = (double)display_step(test, i) - (double)display_step(reference, i);
        metrics->off_by_1 += fabs(difference) == 1;
        metrics->off_by_more += fabs(difference) > 1;
        square_sum += difference * difference;
    }
    metrics->srgb_psnr = -10 * log10(square_sum / (double)value_count(reference) / (255 * 255));
}

// Returns three sRGB values per pixel within 0..1; NaN becomes black. The caller frees them.
static float *display_values(const Image *image)
{
    float *values = memory_allocate(pixel_count(image), 3 * sizeof *values);
    for (size_t i = 0; i < 3 * pixel_count(image); i++) {
        double value = (double)image->values[image->channels == 3 ? i : i / 3];
        double clipped = value > 0 ? fmin(value, 1) : 0;
        values[i] = (float)(image->display ? clipped : srgb_encode(clipped));
    }
    return values;
}

static void flip_compare(ImageMetrics *metrics, const Image *reference, const Image *test)
{
    size_t count = pixel_count(reference);
    OWNED float *expected = display_values(reference), *found = display_values(test),
                *map = memory_allocate(count, sizeof *map);
    flip_map(expected, found, reference->width, reference->height, map);
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        sum += (double)map[i];
        metrics->flip_max = fmax(metrics->flip_max, (double)map[i]);
    }
    metrics->flip_mean = sum / (double)count;
}

static bool is_finite_pixel(const double *values, uint32_t channels)
{
    for (uint32_t i = 0; i < channels; i++)
        if (!isfinite(values[i])) return false;
    return true;
}

// Compares linear light, or data as they are.
static void light_compare(ImageMetrics *metrics, const Image *reference, const Image *test)
{
    const uint32_t channels = reference->channels;
    OWNED double *expected = linear_values(reference), *found = linear_values(test);
    metrics->linear = error_summarize(expected, found, value_count(reference));
    size_t worst = 0;
    float worst_error = 0;
    for (size_t i = 0; i < pixel_count(reference); i++) {
        const double *pixel = expected + i * channels, *other = found + i * channels;
        metrics->nonfinite_reference += !is_finite_pixel(pixel, channels);
        metrics->nonfinite_test += !is_finite_pixel(other, channels);
        const float error = largest_channel_error(pixel, other, channels);
        if (error > worst_error) {
            worst = i;
            worst_error = error;
        }
    }
    metrics->worst_x = (uint32_t)(worst % reference->width);
    metrics->worst_y = (uint32_t)(worst / reference->width);
}

double ulp_distance(double expected, double found, bool is_double)
{
    if (is_same_number(expected, found)) return 0;
    if (!isfinite(expected) || !isfinite(found)) return INFINITY;
    const int digits = is_double ? DBL_MANT_DIG : FLT_MANT_DIG,
              exponent_min = is_double ? DBL_MIN_EXP : FLT_MIN_EXP;
    int exponent;
    if (frexp(expected, &exponent) == 0 || exponent < exponent_min) exponent = exponent_min;
    return fmin(ldexp(fabs(found - expected), digits - exponent), DBL_MAX);
}

static void values_compare(ImageMetrics *metrics, const Image *reference, const Image *test)
{
    const bool is_double = reference->doubles && test->doubles;
    metrics->has_ulp = !reference->display && !reference->integers && !test->integers;
    for (size_t i = 0; i < value_count(reference); i++) {
        const double expected = image_value(reference, i), found = image_value(test, i);
        if (memcmp(&expected, &found, sizeof expected) == 0) continue;
        metrics->differing_count++;
        if ((!isfinite(expected) || !isfinite(found)) && !is_same_number(expected, found))
            metrics->unmatched_count++;
        if (metrics->has_ulp)
            metrics->largest_ulp = fmax(metrics->largest_ulp, ulp_distance(expected, found, is_double));
    }
}

ImageMetrics image_metrics(const Image *reference, const Image *test)
{
    ImageMetrics metrics = {
        .has_color = !reference->data &&
                     (reference->channels == 3 || (reference->channels == 1 && reference->display))};
    values_compare(&metrics, reference, test);
    light_compare(&metrics, reference, test);
    if (metrics.has_color) {
        steps_compare(&metrics, reference, test);
        flip_compare(&metrics, reference, test);
    }
    return metrics;
}
