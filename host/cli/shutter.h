// The shutter of a frame. While it is open, samples show the scene at several times, and their colors
// accumulate to motion blur (Haeberli, Akeley, The accumulation buffer: hardware support for high-quality
// rendering, Computer Graphics 24(4), 1990).
#pragma once

#include "host/cli/progress.h"
#include "host/render/renderer.h"

typedef struct {
    bool is_open;
    double frame, duration;    // in frames
    uint32_t sample_count;     // of a pixel
    uint32_t time, time_count; // a count of 1 means that nothing accumulates
    double *sums;              // the region's colors of the earlier times, summed and divided by sample_count
    RerenderCounts rerenders;  // of the earlier times
    Progress progress;         // over all times
    bool is_estimated;         // whether the render's time was estimated
} Shutter;

// Opens the shutter at its first time. `scene` is the scene at the frame.
Shutter shutter_open(const Scene *scene, uint32_t sample_count);
void shutter_close(Shutter *shutter);

// Returns the time of the scene in frames, which is the middle of its samples' share of the duration.
double shutter_frame(const Shutter *shutter);
// Returns whether the time is the last to be rendered, which is the middle one.
bool shutter_is_last(const Shutter *shutter);
// Sets which of the samples show the scene at this time.
void shutter_choose_samples(Shutter *shutter, RenderSettings *settings);
// Returns the fraction of the image that is done.
double shutter_fraction(const Shutter *shutter, double fraction_of_time);

// Adds the color of a band.
void shutter_add(Shutter *shutter, const Film *band);
// Adds the color of a band of the last time. Returns the band with the mean color, which the caller frees,
// and with the counts of all times.
Film shutter_mean(Shutter *shutter, const Film *band);
