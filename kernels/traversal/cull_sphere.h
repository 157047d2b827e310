// Conservative bounding-sphere culling for packets with a common origin.
#ifndef CULL_SPHERE_H
#define CULL_SPHERE_H

#include "scene.h"
#include "traversal/ray.h"

// The lanes whose lines certainly miss the sphere. A line along d through a common origin misses a sphere
// around v, seen from there, if (v . d)^2 < p d^2 for the origin's power p = v^2 - r^2. The sphere is
// enlarged by 64 u (|v| + |d|), for the error of the shape's own test, the roundings here and the line's
// distance from the common origin: p is lowered by 256 u v^2, on the host, and by 128 u d^2, which times d^2
// is the ray's cull slack. A shadow ray's |d| is the distance to the light; rays from the eye start there and
// need only the former.
static inline mask ray_misses_cull_sphere(const Ray *ray, global const CullSphere *sphere)
{
    global const scalar *center_power = (global const scalar *)sphere;
    real along = real_fma(
        (real)(center_power[0]), ray->direction.x,
        real_fma((real)(center_power[1]), ray->direction.y, (real)(center_power[2]) * ray->direction.z));
    return real_fma(along, along, ray->cull_slack) < ray->squared * (real)(center_power[3]);
}

// The row of cull spheres of the ray's common origin, 0 if there is none: first that of the BVH, then those
// of the primitives outside it.
static inline global const CullSphere *ray_cull_spheres(const Scene *scene, const Ray *ray)
{
    uint count = scene->header->cull_spheres.x;
    if (ray->common_origin == COMMON_ORIGIN_NONE || count == 0) return 0;
    return scene->cull_spheres + (size_t)(ray->common_origin - COMMON_ORIGIN_EYE) * count;
}

// The length of the run of spheres, from the first, up to `count`, that all lanes miss.
static inline uint cull_spheres_missed(global const CullSphere *cull_spheres, uint count, const Ray *ray)
{
    uint missed = 0;
    while (missed < count && lanes_all(ray_misses_cull_sphere(ray, &cull_spheres[missed])))
        missed++;
    return missed;
}

#endif
