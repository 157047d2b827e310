// Answers of the reference that only tests need, for scenes without meshes.
#pragma once

#include "host/verify/reference_shading.h"

// Returns the length of a - b. The difference is not rounded.
static inline double reference_distance(Vector3 a, Quad3 b)
{
    return (double)quad3_length(quad3_subtract(quad3(a), b));
}

// Returns the nearest hit of a scene. Among equal distances the lowest index counts.
static inline ReferenceHit reference_hit(const Scene *scene, const ReferenceRay *ray)
{
    return reference_scene_hit(&(ReferenceScene){*scene, NULL}, ray, UINT32_MAX);
}

// Returns the color seen along a ray without reflection and refraction, which is the background, or ambient
// light and Phong's with shadows. A transparent object passes its part of the light undeflected, once per
// object.
static inline ReferenceColor reference_color(const Scene *scene, const ReferenceRay *ray)
{
    ReferenceHit hit = reference_hit(scene, ray);
    if (!hit.found) return (ReferenceColor){reference_background(scene, ray->direction), (double)hit.margin};
    const ReferenceScene world = {*scene, NULL};
    const ShadedPoint surface = shaded_point(&world, ray, &hit, 0, NULL);
    return shaded_color(&world, &surface, (double)hit.margin, NULL);
}
