// Maps between the space of a shared mesh and that of the eye. docs/numerics.md has the bounds.
#ifndef INSTANCE_H
#define INSTANCE_H

#include "scene.h"
#include "shapes/affine.h"
#include "shapes/triangle.h"

// Maps a vector to the mesh's space.
static inline Vector instance_inward(const Instance *instance, Vector v)
{
    return affine_vector(instance->inverses, v);
}

// Returns the ray in the mesh's space, with the same t.
static inline Ray instance_ray(const Instance *instance, const Ray *ray)
{
    return ray_make(instance_inward(instance, vector_subtract(ray->origin, affine_place(instance->rows))),
                    instance_inward(instance, ray->direction), ray->tmin, ray->tmax, ray->active);
}

static inline Vector instance_point(const Instance *instance, Vector p)
{
    return affine_point(instance->rows, p);
}

// Maps a normal of the mesh by the transposed inverse, which changes its length.
static inline Vector instance_normal(const Instance *instance, Vector n)
{
    return affine_normal(instance->inverses, n);
}

// Maps the unit normals of a triangle's corners; those that are 0 stay 0.
static inline Corners instance_normals(const Instance *instance, Corners normals)
{
    return (Corners){vector_normalize(instance_normal(instance, normals.a)),
                     vector_normalize(instance_normal(instance, normals.b)),
                     vector_normalize(instance_normal(instance, normals.c))};
}

// Returns the factor by which lengths in a triangle's plane grow, the root of its area's.
static inline real instance_stretch(const Instance *instance, Vector normal)
{
    const real mapped = vector_norm(instance_normal(instance, vector_normalize(normal)));
    return (real)(instance->inverses[0].w) * real_sqrt(mapped);
}

static inline Corners instance_corners(const Instance *instance, Corners corners)
{
    return (Corners){instance_point(instance, corners.a), instance_point(instance, corners.b),
                     instance_point(instance, corners.c)};
}

// Returns the point of a triangle in the mesh's space, mapped to the eye's. The normal may have any length.
static inline SurfacePoint instance_surface_point(const Instance *instance, Corners corners, Vector normal,
                                                  TriangleWeights weights)
{
    const Vector unit = vector_normalize(normal), max_abs = corners_max_abs(corners);
    return affine_surface_point(instance->rows, instance->extent.w, triangle_blend(weights, corners),
                                instance_normal(instance, unit), max_abs, vector_norm1_along(unit, max_abs));
}

#endif
