// Compares images in memory.
#include "host/api/handles.h"

#include "host/base/memory.h"
#include "host/image/image_metrics.h"
#include <math.h>
#include <stdlib.h>

// Copies a caller's pair as struct_read does. Returns false with a message if it is invalid.
static bool pair_read(GlintImagePair *own, const GlintImagePair *given, MessageList *messages)
{
    if (!struct_read(own, sizeof *own, given, messages)) return false;
    if (own->real != GLINT_FLOAT32 && own->real != GLINT_FLOAT64)
        return message_error(messages, "images are neither of 32 nor of 64 bits");
    if (own->width == 0 || own->height == 0 || own->channels == 0)
        return message_error(messages, "images to compare have pixels and channels, not %u x %u with %u",
                             own->width, own->height, own->channels);
    if (!own->reference || !own->image)
        return message_error(messages, "a comparison needs a reference and an image");
    return true;
}

// Returns a caller's array as an image, which uses it in place. Only the `values` of doubles are allocated.
static Image image_of_array(const GlintImagePair *pair, const void *array)
{
    Image image = {.width = pair->width, .height = pair->height, .channels = pair->channels};
    if (pair->real == GLINT_FLOAT32) {
        image.values = (float *)(uintptr_t)array; // only read
        return image;
    }
    image.doubles = (double *)(uintptr_t)array;
    const size_t count = (size_t)image.width * image.height * image.channels;
    image.values = memory_allocate(count, sizeof *image.values);
    for (size_t i = 0; i < count; i++)
        image.values[i] = (float)image.doubles[i];
    return image;
}

static GlintImageMetrics metrics_of(const ImageMetrics *found)
{
    return (GlintImageMetrics){
        .differing_values = found->differing_count,
        .unmatched_values = found->unmatched_count,
        .nonfinite_reference = found->nonfinite_reference,
        .nonfinite_image = found->nonfinite_test,
        .compared_values = found->linear.count,
        .max_abs = found->linear.largest,
        .rmse = found->linear.rmse,
        .bias = found->linear.bias,
        .p99_9 = found->linear.percentile_999,
        .psnr = found->linear.psnr,
        .rel_mse = found->linear.rel_mse,
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
    bool is_sound = pair_read(&pair, images, &list);
    if (is_sound && metrics->size < sizeof metrics->size)
        is_sound = message_error(&list, "the size of a GlintImageMetrics is not set");
    if (!is_sound) return call_end(&list, NULL, GLINT_WRONG_INPUT, messages);
    const Image reference = image_of_array(&pair, pair.reference), image = image_of_array(&pair, pair.image);
    const ImageMetrics found = image_metrics(&reference, &image);
    if (pair.real == GLINT_FLOAT64) {
        free(reference.values);
        free(image.values);
    }
    const GlintImageMetrics own = metrics_of(&found);
    struct_write(metrics, &own, sizeof own);
    return call_end(&list, NULL, GLINT_DONE, messages);
}
