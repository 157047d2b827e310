// Compares images in memory.
#include "host/api/handles.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include "host/image/image_metrics.h"
#include <math.h>
#include <stdlib.h>

// Copies a caller's pair, of any version of the interface. Returns false with a message if it is invalid.
static bool pair_read(GlintImagePair *read, const GlintImagePair *given, MessageList *messages)
{
    if (!struct_read(read, sizeof *read, given, "GlintImagePair", messages)) return false;
    if (!real_is_known(read->real, messages)) return false;
    const size_t channels_max =
        SIZE_MAX / sizeof(double) / (read->width ? read->width : 1) / (read->height ? read->height : 1);
    if (read->width == 0 || read->height == 0 || read->channels == 0 || read->channels > channels_max)
        return message_error(messages,
                             "the images have %u x %u pixels of %u channels; expected at least 1 each, and "
                             "at most the values that fit in memory",
                             read->width, read->height, read->channels);
    if (!read->reference || !read->image)
        return message_error(messages, "a comparison needs a reference and an image");
    return true;
}

// Returns a caller's array as an image, which uses it in place. Only the `values` of doubles are allocated.
static Image image_of_array(const GlintImagePair *pair, const void *array)
{
    Image image = {
        .width = pair->width, .height = pair->height, .channels = pair->channels, .data = pair->is_data != 0};
    if (pair->real == GLINT_FLOAT32) {
        image.values = (float *)(uintptr_t)array; // only read
        return image;
    }
    image.doubles = (double *)(uintptr_t)array;
    const size_t count = (size_t)image.width * image.height * image.channels;
    image.values = memory_allocate(count, sizeof *image.values);
    numbers_narrow(image.values, image.doubles, count);
    return image;
}

static GlintImageMetrics metrics_of(const ImageMetrics *found)
{
    const double none = found->linear.count > 0 ? 0 : (double)NAN; // NaN if no values were compared
    return (GlintImageMetrics){
        .differing_values = found->differing_count,
        .unmatched_values = found->unmatched_count,
        .nonfinite_reference = found->nonfinite_reference,
        .nonfinite_image = found->nonfinite_test,
        .compared_values = found->linear.count,
        .max_abs = none + found->linear.largest,
        .rmse = none + found->linear.rmse,
        .bias = none + found->linear.bias,
        .p99_9 = none + found->linear.percentile_999,
        .psnr = none + found->linear.psnr,
        .rel_mse = none + found->linear.rel_mse,
        .max_ulp = found->largest_ulp,
        .worst_x = found->worst_x,
        .worst_y = found->worst_y,
        .srgb8_off_by_1 = found->off_by_1,
        .srgb8_off_by_2_or_more = found->off_by_more,
        .srgb8_psnr = found->has_color ? found->srgb_psnr : (double)NAN,
        .flip_mean = found->has_color ? found->flip_mean : (double)NAN,
        .flip_max = found->has_color ? found->flip_max : (double)NAN,
    };
}

GlintStatus glint_images_compare(const GlintImagePair *images, GlintImageMetrics *metrics, char **messages)
{
    MessageList list = {0};
    GlintImagePair pair;
    if (!pair_read(&pair, images, &list) ||
        !struct_has_size(metrics, sizeof metrics->size, "GlintImageMetrics", &list))
        return call_end(&list, NULL, GLINT_WRONG_INPUT, messages);
    const Image reference = image_of_array(&pair, pair.reference), image = image_of_array(&pair, pair.image);
    const ImageMetrics found = image_metrics(&reference, &image);
    if (pair.real == GLINT_FLOAT64) {
        free(reference.values);
        free(image.values);
    }
    const GlintImageMetrics full = metrics_of(&found);
    struct_write(metrics, &full, sizeof full);
    return call_end(&list, NULL, GLINT_DONE, messages);
}
