#include "host/cli/shutter.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include <stdlib.h>
#include <string.h>

// Each time leaves an edge along moving objects, whose contrast is 1/256 with 256 times.
enum { TIMES_MAX = 256 };

Shutter shutter_open(const Scene *scene, uint32_t sample_count)
{
    const bool moves = scene->animation.has_keys && scene->animation.shutter > 0;
    return (Shutter){.is_open = moves,
                     .frame = scene->animation.frame,
                     .duration = scene->animation.shutter,
                     .sample_count = sample_count,
                     .time_count = !moves                     ? 1
                                   : sample_count < TIMES_MAX ? sample_count
                                                              : TIMES_MAX};
}

void shutter_close(Shutter *shutter)
{
    free(shutter->sums);
}

bool shutter_is_last(const Shutter *shutter)
{
    return shutter->time + 1 == shutter->time_count;
}

// Returns the index of the time's first sample or, with an `offset` of 1, that of the next time's. Times are
// in order, except that the one in the middle is the last to be rendered.
static uint32_t first_sample(const Shutter *shutter, uint32_t offset)
{
    const uint32_t middle = shutter->time_count / 2;
    const uint32_t index = shutter_is_last(shutter) ? middle : shutter->time + (shutter->time >= middle);
    return (uint32_t)((uint64_t)(index + offset) * shutter->sample_count / shutter->time_count);
}

double shutter_frame(const Shutter *shutter)
{
    const double twice = (double)first_sample(shutter, 0) + first_sample(shutter, 1);
    return shutter->frame + shutter->duration * twice / (2.0 * shutter->sample_count);
}

void shutter_choose_samples(Shutter *shutter, RenderSettings *settings)
{
    settings->first_sample = first_sample(shutter, 0);
    settings->end_sample = first_sample(shutter, 1);
    if (!shutter->sums && shutter->time_count > 1)
        shutter->sums = memory_allocate_zeroed(
            memory_product(settings->region_width, settings->region_height), 3 * sizeof *shutter->sums);
}

double shutter_fraction(const Shutter *shutter, double fraction_of_time)
{
    return (shutter->time + fraction_of_time) / shutter->time_count;
}

// Adds the color of a band and returns the sums of its pixels.
static const double *sums_add(Shutter *shutter, const Film *band)
{
    const size_t count = 3 * film_pixel_count(band);
    const bool is_divided = first_sample(shutter, 1) == shutter->sample_count;
    const double divisor = is_divided ? 1 : shutter->sample_count;
    double *sums = shutter->sums + 3 * (size_t)band->first_row * band->width;
    OWNED double *colors = memory_allocate(count, sizeof *colors);
    numbers_widen(colors, band->layers[LAYER_COLOR], count, band->real_size == sizeof(double));
    for (size_t i = 0; i < count; i++)
        sums[i] += colors[i] / divisor;
    return sums;
}

void shutter_add(Shutter *shutter, const Film *band)
{
    sums_add(shutter, band);
    shutter->rerenders = rerender_counts_add(shutter->rerenders, band->rerenders);
}

Film shutter_mean(Shutter *shutter, const Film *band)
{
    const double *sums = sums_add(shutter, band);
    const size_t size = film_layer_size(band, LAYER_COLOR);
    Film mean = *band;
    mean.layers[LAYER_COLOR] = memory_allocate(size, 1);
    if (band->real_size == sizeof(double))
        memcpy(mean.layers[LAYER_COLOR], sums, size);
    else
        numbers_narrow(mean.layers[LAYER_COLOR], sums, size / sizeof(float));
    mean.rerenders = rerender_counts_add(shutter->rerenders, band->rerenders);
    shutter->rerenders = (RerenderCounts){0};
    return mean;
}
