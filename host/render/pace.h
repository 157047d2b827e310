// How many samples a launch takes, from the times of earlier launches. Too long a launch is killed by a GPU's
// watchdog, freezes the desktop and delays an interrupt.
#pragma once

#include <stdbool.h>
#include <stdint.h>

// Samples are counted over all pixels of a launch or band. Initially zero but for the target. For each band:
// pace_band_samples, which reads the sums of the band before, then pace_begin_band, which clears them, then
// pace_launch_samples and pace_note_launch for each launch.
typedef struct {
    double target_seconds;                 // of a launch
    double launch_samples, launch_seconds; // of the last launch
    double band_samples, band_seconds;     // of the band so far
    bool begins_band;
} Pace;

// Samples of the next band, over all its pixels: as many as one launch of the target's duration would take,
// at most four times those of the previous band.
uint64_t pace_band_samples(const Pace *pace);
void pace_begin_band(Pace *pace);

// Samples per pixel of the next launch, of the `left` that each pixel of the band still needs; at least 1.
uint32_t pace_launch_samples(const Pace *pace, uint64_t pixels, uint32_t left);
void pace_note_launch(Pace *pace, uint64_t pixels, uint32_t samples, double seconds);
