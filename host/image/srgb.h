// Computes the sRGB curve of single numbers between 0 and 1 (IEC 61966-2-1:1999), without rounding to steps.
#pragma once

#include <math.h>

static inline double srgb_decode(double display)
{
    return display <= 0.04045 ? display / 12.92 : pow((display + 0.055) / 1.055, 2.4);
}

static inline double srgb_encode(double linear)
{
    return linear <= 0.0031308 ? linear * 12.92 : 1.055 * pow(linear, 1 / 2.4) - 0.055;
}
