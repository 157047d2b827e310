// Decides how many samples a launch renders, from the durations of earlier launches. A launch that takes too
// long is killed by a GPU's watchdog, freezes the desktop and delays an interrupt.
#pragma once

#include <stdbool.h>
#include <stdint.h>

// Samples are counted over all pixels of a launch or band. A Pace starts as zero except for its first two
// members. For each band, pace_band_samples reads the sums of the previous band and pace_begin_band clears
// them. A band is rendered in sweeps over its pixels: pace_begin_sweep starts each sweep, and
// pace_launch_samples and pace_record_launch surround each of its launches.
typedef struct {
    double target_seconds;                 // the intended duration of a launch
    double samples_min;                    // a launch with fewer takes the same time
    double launch_samples, launch_seconds; // the last launch
    double sweep_samples, sweep_seconds;   // the current sweep so far
    double band_samples, band_seconds;     // the current band so far
    double samples_per_second;             // in the band's last sweep; 0 in its first
} Pace;

// Returns how many samples the next band has over all its pixels: as many as a launch of the target's
// duration would render, at most four times as many as the previous band.
uint64_t pace_band_samples(const Pace *pace);
void pace_begin_band(Pace *pace);

// Returns how many of the `left` samples that each pixel of the band still needs the next sweep renders; at
// least 1.
uint32_t pace_begin_sweep(Pace *pace, uint64_t pixels, uint32_t left);

// Returns how many samples the next launch of the sweep may have; at least 1. The first launch has 4,096.
// Each later launch has at most the larger of 4,096 and four times the samples of the launch before it.
uint64_t pace_launch_samples(const Pace *pace);
void pace_record_launch(Pace *pace, uint64_t samples, double seconds);
