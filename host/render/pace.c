// The cost of a band's samples is known only from the band's launches. A band of sky costs almost nothing,
// and the next, of glass, may cost a hundred times as much. So a band's first sweep has one sample per pixel,
// in launches whose size follows the duration of the previous launch and which aim at a part of the target.
// The size of a later sweep follows the duration of the previous sweep, to which all pixels of the band
// contributed.
#include "host/render/pace.h"

#include <math.h>

enum {
    FIRST_BAND_SAMPLES = 1 << 17,
    FIRST_LAUNCH_SAMPLES = 1 << 12,
    SWEEP_SAMPLES_MAX = 1024, // per pixel
    BAND_GROWTH_MAX = 4,
    LAUNCH_GROWTH_MAX = 4,
};

static const double first_sweep_share = 0.25; // the part of the target at which a first sweep's launches aim

uint64_t pace_band_samples(const Pace *pace)
{
    if (pace->band_samples <= 0 || pace->band_seconds <= 0) return FIRST_BAND_SAMPLES;
    double rate = pace->band_samples / pace->band_seconds;
    return (uint64_t)fmin(pace->target_seconds * rate, BAND_GROWTH_MAX * pace->band_samples);
}

void pace_begin_band(Pace *pace)
{
    pace->band_samples = pace->band_seconds = 0;
    pace->sweep_samples = pace->sweep_seconds = 0;
    pace->samples_per_second = 0;
}

uint64_t pace_launch_samples(const Pace *pace)
{
    if (pace->launch_seconds <= 0) return FIRST_LAUNCH_SAMPLES;
    const double last_rate = first_sweep_share * pace->launch_samples / pace->launch_seconds;
    const double rate = pace->samples_per_second > 0 ? pace->samples_per_second : last_rate;
    const double largest = fmax(FIRST_LAUNCH_SAMPLES, LAUNCH_GROWTH_MAX * pace->launch_samples);
    return (uint64_t)fmax(1, fmin(fmax(rate * pace->target_seconds, pace->samples_min), largest));
}

uint32_t pace_begin_sweep(Pace *pace, uint64_t pixels, uint32_t left)
{
    if (pace->sweep_seconds > 0) pace->samples_per_second = pace->sweep_samples / pace->sweep_seconds;
    pace->sweep_samples = pace->sweep_seconds = 0;
    if (pace->launch_seconds > 0 && pace->samples_per_second <= 0) return 1;
    const uint32_t largest = left < SWEEP_SAMPLES_MAX ? left : SWEEP_SAMPLES_MAX;
    return (uint32_t)fmax(1, fmin((double)pace_launch_samples(pace) / (double)pixels, largest));
}

void pace_record_launch(Pace *pace, uint64_t samples, double seconds)
{
    pace->launch_samples = (double)samples;
    pace->launch_seconds = seconds;
    pace->sweep_samples += (double)samples;
    pace->sweep_seconds += seconds;
    pace->band_samples += (double)samples;
    pace->band_seconds += seconds;
}
