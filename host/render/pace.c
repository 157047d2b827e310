// What a band's samples cost is known only from its own launches: one band may be sky, which costs next to
// nothing, and the next glass, thousands of times as dear. So the time that a sample took decides how many
// rows a band gets, but its first launch has one sample a pixel. Its later launches go by its own time, which
// all of its pixels have a part in, and may grow the faster for it.
#include "host/render/pace.h"

#include <math.h>

enum {
    FIRST_LAUNCH_SAMPLES = 1 << 17, // before any time is known
    LAUNCH_SAMPLES_LARGEST = 1024,  // of each pixel
    BAND_GROWTH_LARGEST = 4,
    LAUNCH_GROWTH_LARGEST = 16, // within a band
};

uint64_t pace_band_samples(const Pace *pace)
{
    if (pace->band_samples <= 0 || pace->band_seconds <= 0) return FIRST_LAUNCH_SAMPLES;
    double rate = pace->band_samples / pace->band_seconds;
    return (uint64_t)fmin(pace->target_seconds * rate, BAND_GROWTH_LARGEST * pace->band_samples);
}

void pace_begin_band(Pace *pace)
{
    pace->band_samples = pace->band_seconds = 0;
    pace->begins_band = true;
}

static double samples_wanted(const Pace *pace)
{
    if (pace->launch_samples <= 0 || pace->launch_seconds <= 0) return FIRST_LAUNCH_SAMPLES;
    if (pace->begins_band) return 0; // one a pixel
    double of_target = pace->target_seconds * pace->launch_samples / pace->launch_seconds;
    return fmin(of_target, LAUNCH_GROWTH_LARGEST * pace->launch_samples);
}

uint32_t pace_launch_samples(const Pace *pace, uint64_t pixels, uint32_t left)
{
    double largest = left < LAUNCH_SAMPLES_LARGEST ? left : LAUNCH_SAMPLES_LARGEST;
    return (uint32_t)fmax(1, fmin(samples_wanted(pace) / (double)pixels, largest));
}

void pace_note_launch(Pace *pace, uint64_t pixels, uint32_t samples, double seconds)
{
    pace->launch_samples = (double)pixels * samples;
    pace->launch_seconds = seconds;
    pace->band_samples += pace->launch_samples;
    pace->band_seconds += seconds;
    pace->begins_band = false;
}
