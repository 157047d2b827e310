// Defines the kernel TRACE_KERNEL, which traces explicit rays. It finds the closest hit and, if
// TRACES_BOUNCES, the bounces there and the transmittance along each ray.
#ifndef TRACE_H
#define TRACE_H

#include "shading/bounce.h"

// The bounds are derived for coordinates in this range (host/compile/certified_range.c).
#if IS_DOUBLE
#define ORIGIN_MIN 0x1p-440
#define ORIGIN_MAX 0x1p220
#else
#define ORIGIN_MIN 0x1p-60f
#define ORIGIN_MAX 0x1p48f
#endif

#define RESULTS (TRACES_BOUNCES ? RESULT_SCALARS : CLOSEST_SCALARS)

static inline Vector vector_load(const RealLanes *from)
{
    return (Vector){from[0].all, from[1].all, from[2].all};
}

static inline void vector_store(Vector vector, RealLanes *to)
{
    to[0].all = vector.x;
    to[1].all = vector.y;
    to[2].all = vector.z;
}

// Traces up to LANES rays from `first` on. `rays` has RAY_SCALARS per ray and `results` RESULTS per ray, at
// the offsets RESULT_… (types.h). On a miss only the bounds, RESULT_UNCERTAIN and the transmittance are
// valid. At `certified` the bounds are those of Hit, for rays from tmin = 0 that have no end; otherwise they
// are t. RESULT_UNCERTAIN is 1 if the hit is uncertain.
static OUT_OF_LINE void rays_trace(const Scene *scene, uint first, global const scalar *rays, uint ray_count,
                                   global scalar *results, global int *objects_hit)
{
    RealLanes value[RAY_SCALARS];
    for (uint lane = 0; lane < LANES; lane++) {
        uint index = min(first + lane, ray_count - 1);
        for (uint i = 0; i < RAY_SCALARS; i++)
            value[i].each[lane] = rays[(size_t)index * RAY_SCALARS + i];
    }
    Vector origin = vector_load(value + RAY_ORIGIN), direction = vector_load(value + RAY_DIRECTION);
    Ray ray = ray_make(origin, direction, value[RAY_TMIN].all, value[RAY_TMAX].all, mask_all());
    if (IS_CERTIFIED) { // the host rounded each component once
        ray.origin_error = UNIT_ROUNDOFF * vector_norm1(origin);
        ray.direction_error = (real)(2 * UNIT_ROUNDOFF);
    }
    Hit hit = closest_hit(scene, &ray);
    if (IS_CERTIFIED) {
        const real size = vector_norm1(origin);
        const mask in_range = (size == 0) | ((size >= ORIGIN_MIN) & (size < ORIGIN_MAX));
        hit.uncertain = hit.uncertain | !(ray.active & in_range);
    }
    Surface surface = surface_interaction(scene, &ray, &hit);
    RealLanes result[RESULTS];
    result[RESULT_T].all = hit.t;
    vector_store(surface_normal(&surface), result + RESULT_NORMAL);
    vector_store(surface.position, result + RESULT_POSITION);
    result[RESULT_LOW].all = IS_CERTIFIED ? hit.low : hit.t;
    result[RESULT_HIGH].all = IS_CERTIFIED ? hit.high : hit.t;
    result[RESULT_UNCERTAIN].all =
        IS_CERTIFIED ? lanes_select(hit.uncertain, (real)(1), (real)(0)) : (real)(0);
#if TRACES_BOUNCES
    Bounces bounces = bounces_none(&ray, 1);
    surface_set_bounces(&surface, vector_normalize(direction), color_gray((real)(1)), true, &bounces);
    const Bounce reflected = bounces.reflected, refracted = bounces.refracted;
    vector_store(reflected.origin, result + RESULT_REFLECTED_ORIGIN);
    vector_store(reflected.direction, result + RESULT_REFLECTED_DIRECTION);
    vector_store(refracted.origin, result + RESULT_REFRACTED_ORIGIN);
    vector_store(refracted.direction, result + RESULT_REFRACTED_DIRECTION);
    result[RESULT_REFRACTED_WEIGHT].all = weight_largest(refracted.weight);
    result[RESULT_TRANSMITTANCE].all = transmittance(scene, &ray);
#endif
    IntegerLanes object = {hit.object};
    for (uint lane = 0; lane < LANES && first + lane < ray_count; lane++) {
        size_t index = first + lane;
        for (uint i = 0; i < RESULTS; i++)
            results[index * RESULTS + i] = result[i].each[lane];
        objects_hit[index] = (int)object.each[lane];
    }
}

kernel void TRACE_KERNEL(SCENE_ARGUMENTS, global const scalar *rays, uint ray_count, global scalar *results,
                         global int *objects_hit)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first < ray_count) rays_trace(&scene, first, rays, ray_count, results, objects_hit);
}

#endif
