// glint diff compares two images.
#include "host/base/exit_status.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/format.h"
#include "host/cli/options.h"
#include "host/cli/report_json.h"
#include "host/image/flip.h"
#include "host/image/heatmap.h"
#include "host/image/image_metrics.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { LIMIT_RMSE, LIMIT_FLIP, LIMIT_OFF, LIMIT_ULP, LIMIT_COUNT };

static const struct {
    const char *name, *quantity, *needed; // the option is --max-NAME; `needed` is NULL if any values suit
} limit_types[LIMIT_COUNT] = {
    [LIMIT_RMSE] = {"rmse", "RMSE", NULL},
    [LIMIT_FLIP] = {"flip", "mean FLIP", "colors"},
    [LIMIT_OFF] = {"off", "differing 8-bit values", "colors"},
    [LIMIT_ULP] = {"ulp", "ulp", "floating-point values"},
};

typedef struct {
    CommonOptions common;
    CommandOperands images;
    const char *reference_path, *test_path, *heatmap_path, *layer;
    double limits[LIMIT_COUNT]; // below 0 if not given
} DiffOptions;

static const Option command_options[] = {
    {"max-rmse", "E", "allow this RMSE, in linear light or in the units of other arrays", option_number,
     offsetof(DiffOptions, limits[LIMIT_RMSE]), NUMBERS(0, INFINITY)},
    {"max-flip", "E", "allow this mean FLIP", option_number, offsetof(DiffOptions, limits[LIMIT_FLIP]),
     NUMBERS(0, INFINITY)},
    {"max-off", "N", "allow N differing 8-bit sRGB values; a color pixel has three", option_number,
     offsetof(DiffOptions, limits[LIMIT_OFF]), NUMBERS(0, INFINITY)},
    {"max-ulp", "N", "allow N units in the last place of any value of EXR or NPY, such as distances",
     option_number, offsetof(DiffOptions, limits[LIMIT_ULP]), NUMBERS(0, INFINITY)},
    {"heatmap", "FILE", "write an image of the differences: .png, .ppm, .exr or .npy", option_text,
     offsetof(DiffOptions, heatmap_path)},
    {"layer", "NAME", "compare this layer of EXR files instead of the default", option_text,
     offsetof(DiffOptions, layer)}};

static const ResultTable diff_table = {
    .command = "diff",
    .rows = "",
    .names = {"reference", "image"},
    .values = {"equal", "within limits=met", "differing values=differing_values",
               "largest error=linear.max_abs", "RMSE=linear.rmse", "PSNR dB=linear.psnr",
               "largest ulp=max_ulp", "8-bit off by 1=srgb8.off_by_1", "by more=srgb8.off_by_2_or_more",
               "FLIP mean=flip.mean"},
    .verdicts = {"met", "equal"},
    .failed = "false",
};

static const char *options_check(void *diff_options)
{
    DiffOptions *options = diff_options;
    if (options->images.count != 2) return "takes two images";
    options->reference_path = options->images.items[0];
    options->test_path = options->images.items[1];
    if (options->heatmap_path && image_format_of(options->heatmap_path) == IMAGE_UNKNOWN)
        return "the heat map's name must end in .png, .ppm, .exr or .npy";
    if (options->layer && image_format_of(options->reference_path) != IMAGE_EXR &&
        image_format_of(options->test_path) != IMAGE_EXR)
        return "--layer is for EXR files, but neither name ends in .exr";
    return NULL;
}

static const CommandLine command_line = {
    .command = "diff",
    .usage = "usage: glint diff REFERENCE IMAGE [OPTIONS]\n\n"
             "Compares two images (PNG, JPEG, PPM, EXR or NPY) of the same size and type. Exit status 0: "
             "equal, or within\nall limits that are given; 3: different, or beyond a limit.\n",
    .groups = {OPTIONS(command_options), OPTIONS(max_pixels_option), REPORT_OPTIONS},
    OPERANDS(ANY, DiffOptions, images),
    .check = options_check};

typedef struct {
    Image reference, test;
    ImageMetrics metrics;
    struct {
        bool is_given, is_met;
        double value; // the figure that it bounds
    } limits[LIMIT_COUNT];
    bool has_limits, passes;
} ComparedImages;

// Returns a channel's value at the worst pixel.
static double worst_value(const ComparedImages *comparison, const Image *image, uint32_t channel)
{
    const ImageMetrics *metrics = &comparison->metrics;
    size_t pixel = (size_t)metrics->worst_y * image->width + metrics->worst_x;
    return image_value(image, pixel * image->channels + channel);
}

// Compares the figures with the limits, or without limits the images for equality. Figures exclude values
// that are finite in only one of the images, so such values exceed every limit. Returns false with a message
// if the images lack a limit's figure.
static bool limits_compare(const DiffOptions *options, ComparedImages *comparison, MessageList *messages)
{
    const ImageMetrics *metrics = &comparison->metrics;
    const struct {
        double value;
        bool exists;
    } figures[LIMIT_COUNT] = {
        [LIMIT_RMSE] = {metrics->linear.rmse, true},
        [LIMIT_FLIP] = {metrics->flip_mean, metrics->has_color},
        [LIMIT_OFF] = {(double)(metrics->off_by_1 + metrics->off_by_more), metrics->has_color},
        [LIMIT_ULP] = {metrics->largest_ulp, metrics->has_ulp},
    };
    bool are_met = true;
    for (size_t i = 0; i < LIMIT_COUNT; i++) {
        if (options->limits[i] < 0) continue;
        if (!figures[i].exists)
            return message_error(messages, "--max-%s: \"%s\" and \"%s\" do not both have %s",
                                 limit_types[i].name, options->reference_path, options->test_path,
                                 limit_types[i].needed);
        comparison->has_limits = comparison->limits[i].is_given = true;
        comparison->limits[i].value = figures[i].value;
        comparison->limits[i].is_met =
            metrics->unmatched_count == 0 && figures[i].value <= options->limits[i];
        are_met = are_met && comparison->limits[i].is_met;
    }
    comparison->passes = comparison->has_limits ? are_met : metrics->differing_count == 0;
    return true;
}

static void limits_json(Json *json, const DiffOptions *options, const ComparedImages *comparison)
{
    if (!comparison->has_limits) return;
    json_begin_object(json, "limits");
    for (size_t i = 0; i < LIMIT_COUNT; i++) {
        if (!comparison->limits[i].is_given) continue;
        json_begin_object(json, limit_types[i].name);
        json_addf(json, "limit %g value %g met %d", options->limits[i], comparison->limits[i].value,
                  comparison->limits[i].is_met);
        json_end(json);
    }
    json_end(json);
    json_bool(json, "met", comparison->passes);
}

static void limits_print(const DiffOptions *options, const ComparedImages *comparison)
{
    const size_t unmatched = comparison->metrics.unmatched_count;
    for (size_t i = 0; i < LIMIT_COUNT; i++)
        if (comparison->limits[i].is_given)
            printf("  %-10s --max-%s %.6g: %s %.6g\n", comparison->limits[i].is_met ? "met" : "exceeded",
                   limit_types[i].name, options->limits[i], limit_types[i].quantity,
                   comparison->limits[i].value);
    if (comparison->has_limits && unmatched > 0)
        printf("  exceeded   every limit: %zu %s not finite and not the same in both\n", unmatched,
               unmatched == 1 ? "value is" : "values are");
}

// Adds the values of the worst pixel.
static void worst_json(Json *json, const char *key, const ComparedImages *comparison, const Image *image)
{
    json_begin_array(json, key);
    for (uint32_t channel = 0; channel < image->channels; channel++)
        json_number(json, NULL, worst_value(comparison, image, channel));
    json_end(json);
}

static Json *diff_json(const DiffOptions *options, const ComparedImages *comparison)
{
    const ImageMetrics *metrics = &comparison->metrics;
    const ErrorSummary *linear = &metrics->linear;
    const Image *reference = &comparison->reference;
    static const char *const contents[IMAGE_CONTENT_COUNT] = {"linear", "display", "data"};
    Json *json = report_json_open(2, NULL);
    json_addf(json, "reference %s image %s size [%u %u] channels %u kind %s equal %d differing_values %zu",
              options->reference_path, options->test_path, reference->width, reference->height,
              reference->channels, contents[image_content(reference)], metrics->differing_count == 0,
              metrics->differing_count);
    json_addf(json, "nonfinite_pixels {reference %zu image %zu} unmatched_values %zu",
              metrics->nonfinite_reference, metrics->nonfinite_test, metrics->unmatched_count);
    json_addf(json, "linear {values %zu max_abs %g rmse %g bias %g p99_9 %g psnr %g rel_mse %g}",
              linear->count, linear->largest, linear->rmse, linear->bias, linear->percentile_999,
              linear->psnr, linear->rel_mse);
    if (metrics->has_ulp) json_number(json, "max_ulp", metrics->largest_ulp);
    if (metrics->has_color)
        json_addf(
            json,
            "srgb8 {psnr %g off_by_1 %zu off_by_2_or_more %zu} flip {mean %g max %g pixels_per_degree %u}",
            metrics->srgb_psnr, metrics->off_by_1, metrics->off_by_more, metrics->flip_mean,
            metrics->flip_max, (unsigned)FLIP_PIXELS_PER_DEGREE);
    json_begin_object(json, "worst");
    json_addf(json, "x %u y %u", metrics->worst_x, metrics->worst_y);
    worst_json(json, "reference", comparison, reference);
    worst_json(json, "image", comparison, &comparison->test);
    json_end(json);
    if (options->heatmap_path)
        json_addf(json, "heatmap {file %s white %g black %g}", options->heatmap_path, linear->largest,
                  linear->largest * pow(10, -HEATMAP_DECADES));
    limits_json(json, options, comparison);
    return json;
}

// Prints the worst pixel with the digits that distinguish any two values of the file.
static void worst_print(const ComparedImages *comparison, const Image *image)
{
    for (uint32_t i = 0; i < image->channels; i++)
        printf(" %.*g", image->doubles ? 17 : 9, worst_value(comparison, image, i));
}

static void differences_print(const DiffOptions *options, const ComparedImages *comparison)
{
    const ImageMetrics *metrics = &comparison->metrics;
    const ErrorSummary *linear = &metrics->linear;
    const Image *reference = &comparison->reference;
    printf("  %-10s max %.4g, RMSE %.4g, bias %+.4g, 99.9%% within %.4g, relMSE %.4g, PSNR %.2f dB\n",
           reference->data ? "data" : "light", linear->largest, linear->rmse, linear->bias,
           linear->percentile_999, linear->rel_mse, linear->psnr);
    if (reference->data && metrics->has_ulp) printf("  ulp        at most %.4g\n", metrics->largest_ulp);
    if (metrics->has_color) {
        printf("  8-bit sRGB %zu %s by 1, %zu by more, PSNR %.2f dB\n", metrics->off_by_1,
               metrics->off_by_1 == 1 ? "value differs" : "values differ", metrics->off_by_more,
               metrics->srgb_psnr);
        printf("  FLIP       mean %.6f, max %.6f at %d pixels per degree\n", metrics->flip_mean,
               metrics->flip_max, FLIP_PIXELS_PER_DEGREE);
    }
    printf("  worst      pixel %u,%u:", metrics->worst_x, metrics->worst_y);
    worst_print(comparison, reference);
    printf(" and");
    worst_print(comparison, &comparison->test);
    printf("\n");
    if (options->heatmap_path)
        printf("  heat map   %s: logarithmic, white %.3g, black %.3g or less, red nonfinite\n",
               options->heatmap_path, linear->largest, linear->largest * pow(10, -HEATMAP_DECADES));
}

static void text_print(const DiffOptions *options, const ComparedImages *comparison)
{
    const ImageMetrics *metrics = &comparison->metrics;
    const Image *reference = &comparison->reference;
    size_t value_count = (size_t)reference->width * reference->height * reference->channels;
    printf("%s, %s: %ux%u, %u channel%s of %s\n", options->reference_path, options->test_path,
           reference->width, reference->height, reference->channels, text_plural(reference->channels),
           image_content_names[image_content(reference)]);
    if (metrics->differing_count == 0)
        printf("  equal, bit for bit\n");
    else
        printf("  %zu of %zu values differ\n", metrics->differing_count, value_count);
    if (metrics->nonfinite_reference + metrics->nonfinite_test > 0)
        printf("  nonfinite pixels: %zu and %zu; excluded from the figures\n", metrics->nonfinite_reference,
               metrics->nonfinite_test);
    if (metrics->differing_count > 0) differences_print(options, comparison);
    limits_print(options, comparison);
}

static bool heatmap_make(const DiffOptions *options, const ComparedImages *comparison, MessageList *messages)
{
    const Image *reference = &comparison->reference;
    OWNED float *errors = memory_allocate((size_t)reference->width * reference->height, sizeof *errors);
    image_errors(reference, &comparison->test, errors);
    return heatmap_write(options->heatmap_path, errors, reference->width, reference->height,
                         comparison->metrics.linear.largest, messages);
}

// Reads an image. --layer applies to EXR files; the other file may be an NPY.
static bool side_read(Image *image, const DiffOptions *options, const char *path, MessageList *messages)
{
    const bool has_layers = image_format_of(path) == IMAGE_EXR;
    const ImageReadOptions reading = {has_layers ? options->layer : NULL, options->common.scene.max_pixels};
    return image_read(image, path, &reading, messages);
}

static bool images_compare(const DiffOptions *options, ComparedImages *comparison, MessageList *messages)
{
    if (!side_read(&comparison->reference, options, options->reference_path, messages) ||
        !side_read(&comparison->test, options, options->test_path, messages) ||
        !image_comparable(&comparison->reference, &comparison->test, messages))
        return false;
    comparison->metrics = image_metrics(&comparison->reference, &comparison->test);
    if (!limits_compare(options, comparison, messages)) return false;
    return !options->heatmap_path || heatmap_make(options, comparison, messages);
}

int command_diff(int argument_count, char **arguments)
{
    DiffOptions options = {.common.report.table = &diff_table, .limits = {-1, -1, -1, -1}};
    const int status = command_line_read(&command_line, &options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;

    ComparedImages comparison = {0};
    MessageList messages = {0};
    bool compared = images_compare(&options, &comparison, &messages);
    messages_print(&messages, NULL);
    const ReportOptions *report = &options.common.report;
    if (compared && report_has_text(report)) text_print(&options, &comparison);
    const bool is_written =
        compared && (!report_has_document(report) || report_write(diff_json(&options, &comparison), report));
    image_free(&comparison.reference);
    image_free(&comparison.test);
    if (!is_written) return EXIT_USER;
    return comparison.passes ? EXIT_DONE : EXIT_CHECK;
}
