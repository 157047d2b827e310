// Intersects ovals, which are unit shapes (types.h) under an affine map; an ellipsoid is a mapped sphere. A
// ray is mapped to the unit shape's space, where it has the same t. docs/numerics.md has the bounds.
#ifndef OVAL_H
#define OVAL_H

#include "shapes/affine.h"
#include "shapes/certain_torus.h"
#include "shapes/disc.h"
#include "shapes/paraboloid.h"
#include "shapes/revolution.h"
#include "shapes/sphere.h"

// Runs STATEMENT(name) for the unit shape that the oval maps, declared as `shape`.
#define OVAL_SWITCH(STATEMENT)                                                                               \
    OVAL_CASE(SPHERES, Sphere, sphere, STATEMENT)                                                            \
    OVAL_CASE(DISCS, Disc, disc, STATEMENT)                                                                  \
    OVAL_CASE(CYLINDERS, Cylinder, cylinder, STATEMENT)                                                      \
    OVAL_CASE(CONES, Cone, cone, STATEMENT)                                                                  \
    OVAL_CASE(TORI, Torus, torus, STATEMENT)                                                                 \
    OVAL_CASE(PARABOLOIDS, Paraboloid, paraboloid, STATEMENT)
#define OVAL_CASE(feature, Type, name, STATEMENT)                                                            \
    if (HAS_##feature && oval->id.z == TYPE_##feature) {                                                     \
        const Type shape = oval_##name(oval);                                                                \
        STATEMENT(name);                                                                                     \
    }

static inline uint4 oval_unit_id(const Oval *oval)
{
    return (uint4)(oval->id.x, oval->id.y, 0, 0);
}

static inline Sphere oval_sphere(const Oval *oval)
{
    return (Sphere){(scalar4)(0, 0, 0, oval->sizes.x), oval_unit_id(oval)};
}

static inline Disc oval_disc(const Oval *oval)
{
    const scalar4 none = (scalar4)(0);
    return (Disc){
        (scalar4)(0, 0, 0, oval->sizes.x), (scalar4)(0, 0, 1, 1), none, none, none, oval_unit_id(oval)};
}

static inline Revolution oval_revolution(const Oval *oval, scalar radius, scalar slope)
{
    const scalar height = oval->sizes.w;
    return (Revolution){(scalar4)(0, 0, -height, radius), (scalar4)(0, 0, 1, slope),
                        (scalar4)(2 * height, 1, 1, 0), oval_unit_id(oval)};
}

static inline Cylinder oval_cylinder(const Oval *oval)
{
    return oval_revolution(oval, oval->sizes.x, 0);
}

static inline Cone oval_cone(const Oval *oval)
{
    return oval_revolution(oval, oval->sizes.y, oval->sizes.z);
}

static inline Torus oval_torus(const Oval *oval)
{
    const scalar4 none = (scalar4)(0);
    return (Torus){(scalar4)(0, 0, 0, oval->sizes.y), (scalar4)(0, 0, 1, oval->sizes.z), none, none,
                   oval_unit_id(oval)};
}

static inline Paraboloid oval_paraboloid(const Oval *oval)
{
    const scalar height = oval->sizes.w;
    return (Paraboloid){(scalar4)(0, 0, -height, oval->sizes.y), (scalar4)(0, 0, 1, 2 * height), (scalar4)(0),
                        oval_unit_id(oval)};
}

// The ray in the unit shape's space. Its t is the given ray's, less `shift`.
typedef struct {
    Ray ray;
    real shift;
} OvalRay;

// Bounds the mapped ray's distance from the mapped exact ray. The roundings of 0's image, of the map, of
// differences and of products add up to 6 u of the mapped vector.
static inline void oval_ray_set_errors(Ray *mapped, const Oval *oval, const Ray *ray, Vector from)
{
    const real norm = (real)(oval->inverses[0].w), few = (real)(8 * UNIT_ROUNDOFF);
    mapped->origin_error = norm * real_fma((real)(2 * UNIT_ROUNDOFF),
                                           vector_norm1(affine_translation(oval->rows)), ray->origin_error) +
                           few * vector_norm1(affine_reach(oval->inverses, from));
    mapped->direction_error = (norm * (ray->length * ray->direction_error) +
                               few * vector_norm1(affine_reach(oval->inverses, ray->direction))) *
                              ray_inverse_length(mapped) * BOUND_SLACK;
    mapped->origin_object = ray->origin_object;
    mapped->leaves_outward = ray->leaves_outward;
}

// Maps a ray. If it starts far away, its closest point to the center is mapped instead of its start, so that
// roundings of the map are those of the shape's size and not of the distance.
static inline OvalRay oval_ray(const Oval *oval, const Ray *ray)
{
    const Vector center = affine_translation(oval->rows);
    Vector from = vector_subtract(ray->origin, center);
    OvalRay mapped;
    mapped.shift = (real)(0);
    if (!IS_CERTIFIED) {
        const real reach = (real)(oval->inverses[1].w);
        const mask is_far = vector_dot(from, from) > 4 * reach * reach;
        mapped.shift =
            lanes_select(is_far, -vector_dot(from, ray->direction) * ray->inverse_squared, (real)(0));
        from = ray_point_from(ray, center, mapped.shift);
    }
    mapped.ray = ray_make(affine_vector(oval->inverses, from), affine_vector(oval->inverses, ray->direction),
                          ray->tmin - mapped.shift, ray->tmax - mapped.shift, ray->active);
    if (IS_CERTIFIED) oval_ray_set_errors(&mapped.ray, oval, ray, from);
    return mapped;
}

static OUT_OF_LINE mask oval_hit(const Oval *oval, const Ray *ray, real *t)
{
    OvalRay mapped = oval_ray(oval, ray);
    mask hit = mask_none();
#define OVAL_HIT(name) hit = name##_hit(&shape, &mapped.ray, &unit_t)
    for (;;) {
        real unit_t = mapped.ray.tmax;
        OVAL_SWITCH(OVAL_HIT)
        *t = unit_t + mapped.shift;
        // a ray that starts at a hit, whose t was rounded, hits the shape there once more
        mask passed = hit & !(*t > ray->tmin) & (unit_t > mapped.ray.tmin);
        if (!lanes_any(passed)) break;
        real_replace(&mapped.ray.tmin, passed, unit_t);
    }
    return hit & (*t > ray->tmin) & (*t < LARGEST);
}

static inline SurfacePoint oval_surface_point(const Oval *oval, const Ray *ray, real t)
{
    const OvalRay mapped = oval_ray(oval, ray);
    SurfacePoint unit = surface_point_make(mapped.ray.origin, mapped.ray.direction, (real)(0));
#define OVAL_SURFACE_POINT(name) unit = name##_surface_point(&shape, &mapped.ray, t - mapped.shift)
    OVAL_SWITCH(OVAL_SURFACE_POINT)
    return affine_surface_point(oval->rows, oval->extent.w, unit.position,
                                affine_normal(oval->inverses, unit.normal), unit.position,
                                unit.rounding_scale);
}

static OUT_OF_LINE CertainHit oval_certain_hit(const Oval *oval, const Ray *ray)
{
    const OvalRay mapped = oval_ray(oval, ray);
#define OVAL_CERTAIN_HIT(name) return name##_certain_hit(&shape, &mapped.ray)
    OVAL_SWITCH(OVAL_CERTAIN_HIT)
    return certain_miss();
}

// A normal that is off by e is, mapped to length l and normalized, off by up to x (1 + x) for x = |V| e / l,
// and e itself grows with the second order of the turn (docs/numerics.md). The factor covers both: LOW up to
// an x of LOW_MAX, HIGH up to HIGH_MAX, and ANY_NORMAL, with which every normal is within the error, beyond.
#define MAPPED_NORMAL_LOW      ((real)(1.1f))
#define MAPPED_NORMAL_LOW_MAX  ((real)(0x1p-6f))
#define MAPPED_NORMAL_HIGH     ((real)(1.5f))
#define MAPPED_NORMAL_HIGH_MAX ((real)(0x1p-4f))
#define ANY_NORMAL             ((real)(32))

// Sets the errors of a point.
static inline mask oval_set_errors(const Oval *oval, const Ray *ray, real t, real position_error,
                                   SurfacePoint *point)
{
    const OvalRay mapped = oval_ray(oval, ray);
    const real norm = (real)(oval->inverses[0].w),
               moved = ray_position_error(&mapped.ray, mapped.ray.length * fabs(t)); // the mapped ray itself
    SurfacePoint unit = surface_point_make(mapped.ray.origin, mapped.ray.direction, (real)(0));
    mask at_edge = mask_none();
    const real unit_error = real_fma(norm, position_error, moved);
#define OVAL_SET_ERRORS(name)                                                                                \
    OVAL_SURFACE_POINT(name);                                                                                \
    at_edge = name##_set_errors(&shape, &mapped.ray, t - mapped.shift, unit_error, &unit)
    OVAL_SWITCH(OVAL_SET_ERRORS)
    real growth = divide_or(norm, vector_norm(affine_normal(oval->inverses, unit.normal)), NEVER);
    const real first_order = growth * unit.curvature * unit_error;
    const real factor =
        lanes_select(first_order < MAPPED_NORMAL_LOW_MAX, MAPPED_NORMAL_LOW, MAPPED_NORMAL_HIGH);
    growth = growth * lanes_select(first_order < MAPPED_NORMAL_HIGH_MAX, factor, ANY_NORMAL);
    const real turned = unit.curvature * moved; // with all orders of both turns
    point->curvature = growth * norm * unit.curvature;
    point->normal_error =
        growth *
        (real_fma(turned, real_fma((real)(8), turned, (real)(2)), unit.normal_error) + 32 * UNIT_ROUNDOFF);
    return at_edge;
}

#endif
