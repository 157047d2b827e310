// How coarse the frames of a moving camera are, so that each takes at most PREVIEW_SECONDS, judged by the
// medians of the last three: one that something else delayed is ignored.
#pragma once

#include <stdint.h>

// The time of a frame. It leaves some of 33 ms to the display, and to a launch that the frame had to wait
// for.
#define PREVIEW_SECONDS 0.022

// Initially zero.
typedef struct {
    double fixed_seconds[3];    // of the last frames, independent of their size
    double seconds_of_pixel[3]; // beyond them
    uint32_t divisor;           // of the last frame
} Preview;

// The factor by which both sides of the next frame are smaller than the image's: 1 to 16.
uint32_t preview_divisor(const Preview *preview, uint32_t width, uint32_t height);

// Notes the times of a frame of this divisor: to move the camera, and to render its pixels.
void preview_note(Preview *preview, uint32_t divisor, double move_seconds, double render_seconds,
                  double pixels);
