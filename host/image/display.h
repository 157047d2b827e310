// Converts the linear values of an image to the bytes of PNG and PPM: exposure, tone curve, transfer, dither.
#pragma once

#include "host/image/image.h"

// Returns the bytes of a converted row.
size_t display_row_size(const ImageHeader *header);

// Converts rows first_row..first_row+row_count-1 of the image, in up to 64 threads.
void display_rows(uint8_t *bytes, const float *values, const ImageHeader *header, uint32_t first_row,
                  uint32_t row_count);

// Returns the displayed fraction of a linear value. It is from 0 to 1 except for TONE_NONE.
double tone_apply(double value, Tone tone);
