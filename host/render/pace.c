// The cost of a band's samples is known only from its own launches: a band of sky costs next to nothing, the
// next, of glass, thousands of times as much. So the time per sample decides the rows of the next band, but
// its first launch has one sample per pixel. Its later launches follow its own time, to which all of its
// pixels have contributed, and may grow faster for that reason.
#include "host/render/pace.h"

#include <math.h>

enum {
    FIRST_LAUNCH_SAMPLES = 1 << 17, // before any time is known
    LAUNCH_SAMPLES_MAX = 1024,      // per pixel
    BAND_GROWTH_MAX = 4,
    LAUNCH_GROWTH_MAX = 16, // within a band
};

uint64_t pace_band_samples(const Pace *pace)
{
    if (pace->band_samples <= 0 || pace->band_seconds <= 0) return FIRST_LAUNCH_SAMPLES;
    double rate = pace->band_samples / pace->band_seconds;
    return (uint64_t)fmin(pace->target_seconds * rate, BAND_GROWTH_MAX * pace->band_samples);
}

void pace_begin_band(Pace *pace)
{
    pace->band_samples = pace->band_seconds = 0;
    pace->begins_band = true;
}

static double samples_wanted(const Pace *pace)
{
    if (pace->launch_samples <= 0 || pace->launch_seconds <= 0) return FIRST_LAUNCH_SAMPLES;
    if (pace->begins_band) return 0; // one per pixel
    double of_target = pace->target_seconds * pace->launch_samples / pace->launch_seconds;
    return fmin(of_target, LAUNCH_GROWTH_MAX * pace->launch_samples);
}

uint32_t pace_launch_samples(const Pace *pace, uint64_t pixels, uint32_t left)
{
    double largest = left < LAUNCH_SAMPLES_MAX ? left : LAUNCH_SAMPLES_MAX;
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
