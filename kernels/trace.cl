// Traces explicit rays and the bounces at their hits.
#define TRACES_BOUNCES 1
#include "trace.h"

kernel void trace(SCENE_ARGUMENTS, global const scalar *rays, uint ray_count, global scalar *results,
                  global int *objects_hit)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first < ray_count) rays_trace(&scene, first, rays, ray_count, results, objects_hit);
}
