// Converts the linear values of an image to the bytes of PNG and PPM: exposure, tone curve, transfer, dither.
#pragma once

#include "host/image/image.h"

// Writes a row of the image, the first one being 0.
void display_row(uint8_t *bytes, const float *values, const ImageHeader *header, uint32_t row);

// Returns the displayed fraction of a linear value, which is not limited by TONE_NONE, and from 0 to 1 by
// others.
double tone_apply(double value, Tone tone);
