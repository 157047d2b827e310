#include "host/render/layers.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include <stdlib.h>

PictureLayers layers_allocate(uint32_t width, uint32_t height, uint32_t light_count)
{
    PictureLayers layers = {.width = width, .height = height, .light_count = light_count};
    const size_t pixels = layers_pixel_count(&layers);
    layers.color = memory_allocate_zeroed(3 * pixels, sizeof *layers.color);
    layers.t = memory_allocate_zeroed(pixels, sizeof *layers.t);
    layers.normal = memory_allocate_zeroed(3 * pixels, sizeof *layers.normal);
    layers.object = memory_allocate_zeroed(pixels, sizeof *layers.object);
    layers.shadow = memory_allocate_zeroed(light_count * pixels, sizeof *layers.shadow);
    layers.path = memory_allocate_zeroed(pixels, sizeof *layers.path);
    return layers;
}

void layers_free(PictureLayers *layers)
{
    free(layers->color);
    free(layers->t);
    free(layers->normal);
    free(layers->position);
    free(layers->ray);
    free(layers->object);
    free(layers->shadow);
    free(layers->path);
    *layers = (PictureLayers){0};
}

float *layers_narrow_color(const PictureLayers *layers)
{
    const size_t count = 3 * layers_pixel_count(layers);
    float *narrow = memory_allocate(count, sizeof *narrow);
    numbers_narrow(narrow, layers->color, count);
    return narrow;
}
