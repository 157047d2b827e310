// Explicit rays, each with its closest hit and what becomes of the ray there. Scene and rays are taken as
// they are.
#include "bounce.h"

enum { RAY_SCALARS = 8, RESULT_SCALARS = 21 };

// rays: origin, direction, tmin, tmax of each. results: t; the geometric normal, facing the ray; the point;
// the mirrored ray's origin and direction; the passed one's; how much of the ray passes; and how much light
// passes along it from tmin to tmax. Behind t all are without meaning where nothing is hit, but for the last.
static KERNEL_BODY void rays_trace(const Scene *scene, uint first, global const scalar *rays, uint ray_count,
                                   global scalar *results, global int *objects_hit)
{
    RealLanes value[RAY_SCALARS];
    for (uint lane = 0; lane < LANES; lane++) {
        uint index = min(first + lane, ray_count - 1);
        for (uint i = 0; i < RAY_SCALARS; i++)
            value[i].each[lane] = rays[(size_t)index * RAY_SCALARS + i];
    }
    Vector origin = {value[0].all, value[1].all, value[2].all};
    Vector direction = {value[3].all, value[4].all, value[5].all};
    Ray ray = ray_make(origin, direction, value[6].all, value[7].all, mask_all());
    Hit hit = closest_hit(scene, &ray);
    Surface surface = surface_at(scene, &ray, &hit);
    const Color3 white = {(real)(1), (real)(1), (real)(1)}, black = {(real)(0), (real)(0), (real)(0)};
    Bounce mirrored = {origin, direction, black}, passed = mirrored;
    surface_bounce(&surface, vector_normalize(direction), white, true, &mirrored, &passed);

    Vector n = surface.normal, p = surface.position;
    Vector mo = mirrored.origin, md = mirrored.direction, po = passed.origin, pd = passed.direction;
    // clang-format off
    RealLanes result[RESULT_SCALARS] = {
        {hit.t}, {n.x}, {n.y}, {n.z}, {p.x}, {p.y}, {p.z},
        {mo.x}, {mo.y}, {mo.z}, {md.x}, {md.y}, {md.z},
        {po.x}, {po.y}, {po.z}, {pd.x}, {pd.y}, {pd.z},
        {passed.weight.x}, {transmittance(scene, &ray)},
    };
    // clang-format on
    IntegerLanes object = {hit.object};
    for (uint lane = 0; lane < LANES && first + lane < ray_count; lane++) {
        size_t index = first + lane;
        for (uint i = 0; i < RESULT_SCALARS; i++)
            results[index * RESULT_SCALARS + i] = result[i].each[lane];
        objects_hit[index] = (int)object.each[lane];
    }
}

kernel void trace(SCENE_ARGUMENTS, global const scalar *rays, uint ray_count, global scalar *results,
                  global int *objects_hit)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first < ray_count) rays_trace(&scene, first, rays, ray_count, results, objects_hit);
}
