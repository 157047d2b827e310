#include "host/cli/band_values.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include <math.h>
#include <stdlib.h>

void *band_scratch_reserve(BandScratch *scratch, size_t size)
{
    if (scratch->capacity < size) {
        scratch->items = memory_resize(scratch->items, size, 1);
        scratch->capacity = size;
    }
    return scratch->items;
}

// Converts positions from relative to the eye to the world, in double so that no bit is lost.
static const double *positions_in_world(BandValues *values, const Film *band)
{
    size_t count = 3 * film_pixel_count(band);
    double *world = band_scratch_reserve(&values->positions, count * sizeof *world);
    numbers_widen(world, band->layers[LAYER_POSITION], count, band->is_double);
    const double axes[3] = {values->eye.x, values->eye.y, values->eye.z};
    for (size_t i = 0; i < count; i++)
        world[i] += axes[i % 3];
    return world;
}

const void *band_layer_values(BandValues *values, const Film *band, Layer layer)
{
    return layer == LAYER_POSITION ? positions_in_world(values, band) : band->layers[layer];
}

const void *band_layer_narrowed(BandValues *values, const Film *band, Layer layer)
{
    const void *wide = band_layer_values(values, band, layer);
    if (layer_types[layer] == LAYER_TYPE_INTEGER || (!band->is_double && layer != LAYER_POSITION))
        return wide;
    const size_t count = film_pixel_count(band) * film_components(band, layer);
    float *narrow = band_scratch_reserve(&values->narrowed[layer], count * sizeof *narrow);
    numbers_narrow(narrow, wide, count);
    return narrow;
}

const float *band_foreground(BandValues *values, const Film *band, bool is_premultiplied)
{
    const size_t count = film_pixel_count(band);
    const float *colors = band_layer_narrowed(values, band, LAYER_COLOR),
                *backdrop = band_layer_narrowed(values, band, LAYER_BACKDROP),
                *coverage = band_layer_narrowed(values, band, LAYER_COVERAGE);
    float *foreground = band_scratch_reserve(&values->foreground, 3 * count * sizeof *foreground);
    for (size_t i = 0; i < count; i++) {
        const float part = is_premultiplied || coverage[i] == 0 ? 1 : coverage[i];
        for (size_t k = 3 * i; k < 3 * i + 3; k++)
            foreground[k] = coverage[i] == 0 ? 0 : fmaxf(colors[k] - backdrop[k], 0) / part;
    }
    return foreground;
}

void band_values_free(BandValues *values)
{
    for (Layer i = 0; i < LAYER_COUNT; i++)
        free(values->narrowed[i].items);
    free(values->positions.items);
    free(values->foreground.items);
}
