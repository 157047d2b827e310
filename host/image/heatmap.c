#include "host/image/heatmap.h"

#include "host/base/memory.h"
#include "host/image/srgb.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

// Computes cubehelix with the author's standard start, rotations, hue and gamma (Green: "A colour scheme for
// the display of astronomical intensity images", Bulletin of the Astronomical Society of India 39, 2011,
// section 3).
void heatmap_color(double fraction, float color[3])
{
    const double start = 0.5, rotations = -1.5, hue = 1;
    double angle = 2 * M_PI * (start / 3 + 1 + rotations * fraction);
    double amplitude = hue * fraction * (1 - fraction) / 2;
    double c = amplitude * cos(angle), s = amplitude * sin(angle);
    color[0] = (float)fmax(0, fmin(fraction - 0.14861 * c + 1.78277 * s, 1));
    color[1] = (float)fmax(0, fmin(fraction - 0.29227 * c - 0.90649 * s, 1));
    color[2] = (float)fmax(0, fmin(fraction + 1.97294 * c, 1));
}

void heatmap_error_color(double error, double largest, float color[3])
{
    if (!isfinite(error)) {
        color[0] = 1;
        color[1] = color[2] = 0;
        return;
    }
    double fraction = error > 0 ? 1 + log10(error / largest) / HEATMAP_DECADES : 0;
    heatmap_color(fmax(0, fmin(fraction, 1)), color);
}

bool heatmap_write(const char *path, const float *errors, uint32_t width, uint32_t height, double largest,
                   MessageList *messages)
{
    char scale[120];
    snprintf(scale, sizeof scale, "logarithmic; white %.3g, black %.3g or less, red not finite", largest,
             largest * pow(10, -HEATMAP_DECADES));
    ImageHeader header = {
        .format = image_format_of(path),
        .width = width,
        .height = height,
        .channels = 3,
        .transfer = TRANSFER_NONE, // the colors are display values already
        .bits = 8,
        .npy_type = 'f',
        .notes = (const ImageNote[]){{"Title", "heat map of errors"}, {"Scale", scale}, {NULL, NULL}},
    };
    const size_t count = (size_t)width * height;
    OWNED float *colors = memory_allocate(count, 3 * sizeof *colors);
    for (size_t i = 0; i < count; i++)
        heatmap_error_color((double)errors[i], largest, colors + 3 * i);
    for (size_t i = 0; image_format_holds_floats(header.format) && i < 3 * count; i++)
        colors[i] = (float)srgb_decode((double)colors[i]);
    return image_write(path, &header, colors, messages);
}
