// Computes the sRGB curve of numbers between 0 and 1 (IEC 61966-2-1:1999), without rounding to steps, and the
// light of an image's pixels.
#pragma once

#include "host/image/image.h"
#include <math.h>

static inline double srgb_decode(double display)
{
    return display <= 0.04045 ? display / 12.92 : pow((display + 0.055) / 1.055, 2.4);
}

static inline double srgb_encode(double linear)
{
    return linear <= 0.0031308 ? linear * 12.92 : 1.055 * pow(linear, 1 / 2.4) - 0.055;
}

// Sets the light of pixel i of an image. With `decodes`, its values are from 0 to 1 and the sRGB curve is
// undone. Otherwise values below 0, which filters of other programs leave, become 0.
static inline void image_light(const Image *image, size_t i, bool decodes, float color[3])
{
    for (size_t channel = 0; channel < 3; channel++) {
        const float value = image->values[i * image->channels + (image->channels < 3 ? 0 : channel)];
        color[channel] = decodes ? (float)srgb_decode((double)value) : fmaxf(value, 0);
    }
}
