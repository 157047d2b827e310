// Maps between the space of a shared mesh and that of the eye. docs/numerics.md has the bounds.
#ifndef INSTANCE_H
#define INSTANCE_H

#include "scene.h"
#include "shapes/affine.h"
#include "shapes/triangle.h"

// Returns the ray in the mesh's space, with the same t.
static inline Ray instance_ray(const Instance *instance, const Ray *ray)
{
    const Vector from = vector_subtract(ray->origin, affine_translation(instance->rows));
    return ray_make(affine_vector(instance->inverses, from),
                    affine_vector(instance->inverses, ray->direction), ray->tmin, ray->tmax, ray->active);
}

// Maps the unit normals of a triangle's corners; those that are 0 stay 0.
static inline Corners instance_normals(const Instance *instance, Corners normals)
{
    return (Corners){vector_normalize(affine_normal(instance->inverses, normals.a)),
                     vector_normalize(affine_normal(instance->inverses, normals.b)),
                     vector_normalize(affine_normal(instance->inverses, normals.c))};
}

// Returns the factor by which lengths in a triangle's plane grow, the root of its area's.
static inline real instance_stretch(const Instance *instance, Vector normal)
{
    const real mapped = vector_norm(affine_normal(instance->inverses, vector_normalize(normal)));
    return (real)(instance->inverses[0].w) * real_sqrt(mapped);
}

static inline Corners instance_corners(const Instance *instance, Corners corners)
{
    return (Corners){affine_point(instance->rows, corners.a), affine_point(instance->rows, corners.b),
                     affine_point(instance->rows, corners.c)};
}

// Returns the point of a triangle in the mesh's space, mapped to the eye's. The normal may have any length.
static inline SurfacePoint instance_surface_point(const Instance *instance, Corners corners, Vector normal,
                                                  TriangleWeights weights)
{
    const Vector unit = vector_normalize(normal), max_abs = corners_max_abs(corners);
    return affine_surface_point(instance->rows, instance->extent.w, triangle_blend(weights, corners),
                                affine_normal(instance->inverses, unit), max_abs,
                                vector_norm1_along(unit, max_abs));
}

#endif
