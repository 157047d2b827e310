// How much of the picture a launch takes, from how long those before it took. Too long a launch is killed by
// a GPU's watchdog, keeps a desktop waiting, and an interrupt, too.
#pragma once

#include <stdbool.h>
#include <stdint.h>

// Samples are counted over all pixels of a launch or band. Zeroed but for the target, it has seen no launch
// yet.
typedef struct {
    double target_seconds;                 // of a launch
    double launch_samples, launch_seconds; // of the last launch
    double band_samples, band_seconds;     // of the band so far
    bool begins_band;
} Pace;

// How many samples the next band may have, pixels times samples of each: as many as last one launch, should
// all of them go into it, and at most four times those of the band before.
uint64_t pace_band_samples(const Pace *pace);
void pace_begin_band(Pace *pace);

// How many of the samples that each pixel of the band still needs the next launch takes; one at least.
uint32_t pace_launch_samples(const Pace *pace, uint64_t pixels, uint32_t left);
void pace_note_launch(Pace *pace, uint64_t pixels, uint32_t samples, double seconds);
