// Chooses how coarse the frames of a moving camera are, so that each takes at most PREVIEW_SECONDS by the
// medians of the last three. The median ignores one that something else delayed.
#pragma once

#include <stdint.h>

// The duration of a frame. It leaves part of 33 ms to the display, and to a launch that the frame had to
// wait for.
#define PREVIEW_SECONDS 0.022

// Initially zero.
typedef struct {
    double fixed_seconds[3];    // of the last frames, independent of their size
    double seconds_of_pixel[3]; // beyond them
    uint32_t divisor;           // of the last frame
} Preview;

// Returns the factor, 1 to 16, by which both sides of the next frame are smaller than the image's.
uint32_t preview_divisor(const Preview *preview, uint32_t width, uint32_t height);

// Records the times that a frame of this divisor took to move the camera and to render its pixels.
void preview_record(Preview *preview, uint32_t divisor, double move_seconds, double render_seconds,
                    double pixels);
