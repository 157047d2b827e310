// Whole pictures in memory, with what lies behind each pixel, for the tests that compare them.
#pragma once

#include "host/render/renderer.h"

// Rows from the top; values of float kernels are widened, which is exact.
typedef struct {
    uint32_t width, height, light_count;
    double *colors;                   // 3 per pixel
    double *t, *normal, *position;    // NULL unless asked for; positions are relative to the eye
    double *ray;                      // 3 per pixel, NULL unless asked for
    uint32_t *object, *shadow, *path; // NULL unless asked for
} Frame;

// The whole picture, one sample a pixel, as glint render takes it.
RenderSettings frame_settings(uint32_t width, uint32_t height, Precision precision);

// Renders what the settings say; fails the test where they do not fit the device.
Frame frame_render(Compute *compute, const Scene *scene, const RenderSettings *settings, unsigned aovs);
void frame_free(Frame *frame); // and zeroes

// The part of a frame, without its AOVs, that starts at x, y.
Frame frame_cut(const Frame *frame, uint32_t x, uint32_t y, uint32_t width, uint32_t height);
// Its columns, without its AOVs, from right to left.
Frame frame_flipped(const Frame *frame);

// Colors, and the AOVs that both have, equal in value (hence in their bits, but for the sign of a zero);
// fails the test at the first pixel that differs. Frees neither.
void frame_assert_same(const Frame *frame, const Frame *expected, const char *what);

// So many pixels have a number that is not finite, or a negative color.
size_t frame_count_faulty(const Frame *frame);
