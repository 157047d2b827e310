// How many samples a launch takes, from the times of earlier launches. Too long a launch is killed by a GPU's
// watchdog, freezes the desktop and delays an interrupt.
#pragma once

#include <stdbool.h>
#include <stdint.h>

// Samples are counted over all pixels of a launch or band. Initially zero except for the first two members.
// For each band: pace_band_samples, which reads the sums of the band before, and pace_begin_band, which
// clears them. A band is rendered in passes over its pixels: for each pace_begin_pass, then
// pace_launch_samples and pace_note_launch for each launch.
typedef struct {
    double target_seconds;                 // of a launch
    double samples_min;                    // that keep the device busy: fewer take no less time
    double launch_samples, launch_seconds; // of the last launch
    double pass_samples, pass_seconds;     // of the pass so far
    double band_samples, band_seconds;     // of the band so far
    double samples_per_second;             // of the band's last pass; 0: this is its first
} Pace;

// Samples of the next band, over all its pixels: as many as one launch of the target's duration would take,
// at most four times those of the previous band.
uint64_t pace_band_samples(const Pace *pace);
void pace_begin_band(Pace *pace);

// Returns the samples per pixel of the next pass, of the `left` that each pixel of the band still needs; at
// least 1.
uint32_t pace_begin_pass(Pace *pace, uint64_t pixels, uint32_t left);

// Returns at most how many samples the next launch of the pass may have; at least 1. The first launch has
// 4,096, and no launch has more than four times those of the one before, or 4,096.
uint64_t pace_launch_samples(const Pace *pace);
void pace_note_launch(Pace *pace, uint64_t samples, double seconds);
