// The colors of 4x4 pixels: camera rays, closest hits, Phong's reflection with a shadow ray to each light.
// All 16 rays are shaded at once, in loops over lanes that the compiler makes vector instructions of.
#pragma once

#include "description.h"
#include <embree3/rtcore.h>
#include <stdbool.h>

enum { PACKET_SIDE = 4, LANES = PACKET_SIDE * PACKET_SIDE };

#define FOR_LANES _Pragma("omp simd") for (int i = 0; i < LANES; i++)

static const float far_away = 1e30F;

static inline bool lanes_any(const int *lanes)
{
    int any = 0;
    for (int i = 0; i < LANES; i++)
        any |= lanes[i];
    return any != 0;
}

typedef struct {
    const Description *description;
    RTCScene scene;  // geometry 0 is the spheres, if there are any; then come the meshes
    bool one_by_one; // not in packets of 16
    enum RTCIntersectContextFlags coherence;
    unsigned width, height, samples;
    const float *offsets; // x and y of each sample, from -1 to 1 across the pixel
    float *film;          // height * width * 3, from the top left
} Renderer;

// Renders the pixels from x, y on that are in the image.
void packet_render(const Renderer *renderer, unsigned x, unsigned y);
