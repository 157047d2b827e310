// Renders 4x4 pixels at once: camera rays, closest hits, and Phong shading with a shadow ray to each light.
// All 16 rays are shaded together, in loops over lanes that the compiler vectorizes.
#pragma once

#include "description.h"
#include <embree3/rtcore.h>
#include <stdbool.h>

enum { PACKET_SIDE = 4, LANES = PACKET_SIDE * PACKET_SIDE };

#define FOR_LANES _Pragma("omp simd") for (int i = 0; i < LANES; i++)

// Lane i of three arrays, which are called prefix and x, y or z.
#define GET(prefix) ((Vector){prefix##x[i], prefix##y[i], prefix##z[i]})
#define SET(prefix, vector)                                                                                  \
    do {                                                                                                     \
        const Vector set = vector;                                                                           \
        prefix##x[i] = set.x;                                                                                \
        prefix##y[i] = set.y;                                                                                \
        prefix##z[i] = set.z;                                                                                \
    } while (0)

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
    RTCScene scene;
    bool one_by_one; // traces single rays instead of packets of 16
    enum RTCIntersectContextFlags coherence;
    unsigned width, height, samples;
    const float *offsets; // x and y of each sample, from -1 to 1 across the pixel
    float *film;          // height * width * 3, from the top left
} Renderer;

// Geometry IDs are 0 for the spheres, if there are any, followed by those of the meshes and those of the
// instances, mesh by mesh. A mesh with instances keeps its ID in the scene that they share.
static inline unsigned mesh_geometry(const Description *scene, size_t mesh)
{
    return (unsigned)mesh + (scene->sphere_count > 0);
}

static inline unsigned instance_geometry(const Description *scene, const Mesh *mesh, size_t instance)
{
    return mesh_geometry(scene, scene->mesh_count) + (unsigned)(mesh->first_instance + instance);
}

// Renders the pixels from `left` and `top` on that are in the image.
void packet_render(const Renderer *renderer, unsigned left, unsigned top);
