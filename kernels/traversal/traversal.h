// Closest hits and shadows. All queries share one traversal, and with it each shape's test, so that they can
// never disagree.
#ifndef TRAVERSAL_H
#define TRAVERSAL_H

#include "traversal/packet.h"
#include "traversal/single.h"

static OUT_OF_LINE Traversal scene_traverse(const Scene *scene, Ray *ray, Query query)
{
    Traversal traversal = {query, ray->active, {ray->tmax, (integer)(-1)}, (integer)(0)};
    intersect_outside_bvh(&traversal, scene, ray);
    if (HAS_BVH) {
        global const CullSphere *cull_spheres = ray_cull_spheres(scene, ray);
        if (!cull_spheres || cull_spheres_missed(cull_spheres, 1, ray) == 0)
            traverse_bvh(&traversal, scene, ray);
    }
    return traversal;
}

static inline Hit closest_hit(const Scene *scene, Ray *ray)
{
    return scene_traverse(scene, ray, CLOSEST_HIT).hit;
}

static inline Hit closest_opaque_hit(const Scene *scene, Ray *ray)
{
    return scene_traverse(scene, ray, CLOSEST_OPAQUE_HIT).hit;
}

// The fraction of light that passes along each active ray between tmin and tmax: 1 if it is free, 0 behind an
// opaque object. Each transparent object transmits its fraction, without bending the ray.
static inline real transmittance(const Scene *scene, Ray *ray)
{
    Traversal traversal = scene_traverse(scene, ray, OCCLUSION);
    const real none = (real)(0), all = (real)(1);
    if (!HAS_TRANSMISSION) return lanes_select(traversal.active, all, none);
    const real ln2_of_step = (real)(-LN_2 / OPTICAL_DEPTH_STEPS);
    real passed = real_exp_negative(real_from_integer(traversal.optical_depth) * ln2_of_step);
    return lanes_select(traversal.active, passed, none);
}

#endif
