#include "host/view/views.h"

#include "host/base/memory.h"
#include "host/image/heatmap.h"
#include "host/image/transfer.h"
#include <math.h>

#define VIEW_NAME(NAME, name, aovs) name,
const char *const view_names[VIEW_COUNT] = {VIEW_LIST(VIEW_NAME)};

#define VIEW_AOVS(NAME, name, aovs) aovs,
const unsigned view_aovs[VIEW_COUNT] = {VIEW_LIST(VIEW_AOVS)};

void view_color(uint8_t *pixels, const Film *film, uint32_t sample_count, Transfer transfer)
{
    size_t row = 3 * (size_t)film->width;
    OWNED float *values = memory_allocate(row, sizeof *values);
    for (uint32_t y = 0; y < film->height; y++) {
        for (size_t i = 0; i < row; i++)
            values[i] = (float)(film->color[y * row + i] / sample_count);
        transfer_quantize(pixels + y * row, values, row, transfer, 8);
    }
}

static uint8_t byte_of(double value)
{
    return (uint8_t)image_quantize((float)value, TRANSFER_NONE, 8);
}

static void object_color(uint8_t rgb[3], uint32_t object)
{
    uint32_t bits = (object + 1) * 2654435761U; // Knuth's multiplicative hash
    for (int channel = 0; channel < 3; channel++)
        rgb[channel] = (uint8_t)(64 + (bits >> (8 + 8 * channel) & 0xff) * 3 / 4);
}

static double lit_share(const Film *film, size_t pixel)
{
    uint32_t occluded = 0;
    for (uint32_t i = 0; i < film->light_count; i++)
        occluded += film->shadow[pixel * film->light_count + i];
    return film->light_count > 0 ? 1 - (double)occluded / film->light_count : 1;
}

void view_aov(uint8_t *pixels, const Film *film, View view, double distance_half)
{
    for (size_t i = 0; i < film_pixel_count(film); i++) {
        uint8_t *rgb = pixels + 3 * i;
        bool is_hit = film->object[i] != UINT32_MAX;
        for (int channel = 0; channel < 3; channel++) {
            double value = 0;
            if (view == VIEW_DEPTH) value = 1 / (1 + pow(film->t[i] / distance_half, 2));
            if (view == VIEW_NORMAL && is_hit) value = (film->normal[3 * i + (size_t)channel] + 1) / 2;
            if (view == VIEW_SHADOW && is_hit) value = lit_share(film, i);
            rgb[channel] = byte_of(value);
        }
        if (view == VIEW_OBJECT && is_hit) object_color(rgb, film->object[i]);
    }
}

// Returns the largest difference of a channel. It is infinite if a value is not finite, unless the other one
// equals it.
static double pixel_error(const Film *film, const Film *reference, size_t pixel)
{
    double error = 0;
    for (size_t i = 3 * pixel; i < 3 * pixel + 3; i++) {
        const double difference = fabs(film->color[i] - reference->color[i]);
        if (film->color[i] != reference->color[i])
            error = fmax(error, isnan(difference) ? INFINITY : difference);
    }
    return error;
}

double view_error(uint8_t *pixels, const Film *film, const Film *reference)
{
    double largest = 0;
    for (size_t i = 0; i < film_pixel_count(film); i++) {
        float color[3];
        double error = pixel_error(film, reference, i);
        largest = fmax(largest, error);
        heatmap_error_color(error, VIEW_ERROR_WHITE, color);
        for (size_t channel = 0; channel < 3; channel++)
            pixels[3 * i + channel] = byte_of((double)color[channel]);
    }
    return largest;
}
