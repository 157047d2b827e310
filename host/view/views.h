// Converts an image to what the window shows.
#pragma once

#include "host/image/image.h"
#include "host/render/film.h"

// VIEW(NAME, name, aovs), whose `aovs` are those that it shows in addition to the color.
#define VIEW_LIST(VIEW)                                                                                      \
    VIEW(COLOR, "color", 0)                                                                                  \
    VIEW(DEPTH, "depth", AOV_T | AOV_OBJECT)                                                                 \
    VIEW(NORMAL, "normal", AOV_NORMAL | AOV_OBJECT)                                                          \
    VIEW(OBJECT, "object", AOV_OBJECT)                                                                       \
    VIEW(SHADOW, "shadow", AOV_OBJECT | AOV_SHADOW)                                                          \
    VIEW(ERROR, "error against double", 0)

#define VIEW_NUMBER(NAME, name, aovs) VIEW_##NAME,
typedef enum { VIEW_LIST(VIEW_NUMBER) VIEW_COUNT } View;

extern const char *const view_names[VIEW_COUNT];
extern const unsigned view_aovs[VIEW_COUNT];

// Sets display values (RGB) from a film's color, which is the sum of `sample_count` samples.
void view_color(uint8_t *pixels, const Film *film, uint32_t sample_count, Transfer transfer);

// Sets display values of the view's AOVs. Depth is shown as 1 / (1 + (t / distance_half)^2), a normal as
// 0..1 for -1..1 per axis, an object as a random color, and shadows as the share of lights that are not
// occluded. A miss is black.
void view_aov(uint8_t *pixels, const Film *film, View view, double distance_half);

// The error that is white in the heat map of errors.
#define VIEW_ERROR_WHITE 1e-3

// Sets a heat map of each pixel's largest difference of a channel, on a logarithmic scale, which is black up
// to HEATMAP_DECADES powers of ten below white. A pixel with a value that is not finite is red, unless the
// reference has that same infinity. Returns the largest difference of the image.
double view_error(uint8_t *pixels, const Film *film, const Film *reference);
