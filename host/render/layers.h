// A picture and what lies behind its pixels, in plain arrays.
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// A value, or 3 or light_count of them, for each pixel, row by row from the top left. Numbers are doubles
// whatever precision they were computed in, which changes none of them. NULL: not kept.
typedef struct {
    uint32_t width, height, light_count;
    bool wide;     // computed in double
    double *color; // 3, linear
    // of the ray through the pixel's center
    double *t;                 // infinity where nothing was hit
    double *normal, *position; // 3; 0 where nothing was hit; from the eye
    double *ray;               // 3: the direction that was traced, from the eye
    uint32_t *object;          // UINT32_MAX where nothing was hit
    uint32_t *shadow;          // for each light, 1 where it does not reach what was hit
    uint32_t *path;            // the signature of what the ray met (kernels/types.h)
} PictureLayers;

static inline size_t layers_pixel_count(const PictureLayers *layers)
{
    return (size_t)layers->width * layers->height;
}

// Zeroed arrays of all but position and ray.
PictureLayers layers_allocate(uint32_t width, uint32_t height, uint32_t light_count);
void layers_free(PictureLayers *layers); // and zeroes

float *layers_narrow_color(const PictureLayers *layers); // caller frees
