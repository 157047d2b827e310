// Shows errors as colors. Larger errors are lighter, so that the order survives gray printing and color
// blindness.
#pragma once

#include "host/base/message.h"
#include <stdint.h>

enum { HEATMAP_DECADES = 4 };

// Returns the color of `fraction` within 0..1 as sRGB display values: from black through blue, green and pink
// to white.
void heatmap_color(double fraction, float color[3]);

// Returns the color of an error on a logarithmic scale whose white is `largest` and whose black is
// HEATMAP_DECADES powers of ten below it or less. An error that is not finite is red.
void heatmap_error_color(double error, double largest, float color[3]);

// Writes an image of the errors in these colors to `path` and records the scale in the file (PNG, EXR).
// Returns false with a message if it cannot be written.
bool heatmap_write(const char *path, const float *errors, uint32_t width, uint32_t height, double largest,
                   MessageList *messages);
