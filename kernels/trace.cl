// Explicit rays, each with its closest hit. Scene and rays are taken as they are.
#include "surface.h"

// rays: origin, direction, tmin, tmax of each. results: t and the geometric normal, facing the ray.
kernel void trace(SCENE_ARGUMENTS, global const scalar *rays, uint ray_count, global scalar *results,
                  global int *objects_hit)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first >= ray_count) return;

    RealLanes value[8];
    for (uint lane = 0; lane < LANES; lane++) {
        uint index = min(first + lane, ray_count - 1);
        for (uint i = 0; i < 8; i++)
            value[i].each[lane] = rays[(size_t)index * 8 + i];
    }
    Vector origin = {value[0].all, value[1].all, value[2].all};
    Vector direction = {value[3].all, value[4].all, value[5].all};
    Ray ray = ray_make(origin, direction, value[6].all, value[7].all, mask_all());
    Hit hit = closest_hit(&scene, &ray);
    Surface surface = surface_at(&scene, &ray, &hit);

    RealLanes t = {hit.t};
    RealLanes x = {surface.normal.x}, y = {surface.normal.y}, z = {surface.normal.z};
    IntegerLanes object = {hit.object};
    for (uint lane = 0; lane < LANES && first + lane < ray_count; lane++) {
        size_t index = first + lane;
        results[index * 4] = t.each[lane];
        results[index * 4 + 1] = x.each[lane];
        results[index * 4 + 2] = y.each[lane];
        results[index * 4 + 3] = z.each[lane];
        objects_hit[index] = (int)object.each[lane];
    }
}
