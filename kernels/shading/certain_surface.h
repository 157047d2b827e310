// Bounds the errors of the surface at a hit, at `certified` (docs/numerics.md).
#ifndef CERTAIN_SURFACE_H
#define CERTAIN_SURFACE_H

#include "shading/surface.h"
#include "shapes/certain_triangle.h"

// Returns a lower bound on the cosine of the exact ray's incidence on a plane, or 0.
static inline real least_cosine(Vector normal, const Ray *ray)
{
    const real error = ray->direction_error + (real)(128 * UNIT_ROUNDOFF + 2 * TRIANGLE_NORMAL_ERROR);
    return real_max(fabs(vector_dot(normal, ray->direction)) * ray_inverse_length(ray) - error, (real)(0));
}

// Returns an upper bound on the root of a^2 + b^2, for a, b >= 0.
static inline real hypotenuse_above(real a, real b)
{
    return real_fma((real)(0.4143f), real_min(a, b), real_max(a, b));
}

// Lowers the bound on the position's error where the surface is flat. The exact hit is where the exact ray,
// line_error off, crosses a plane that the position is `height` above; `cosine` is its least_cosine.
static inline void surface_narrow_place(Surface *surface, mask lanes, real height, real cosine)
{
    const real one = (real)(1), across = surface->line_error;
    lanes = lanes & (cosine > (real)(0x1p-6f));
    const real sine =
        real_sqrt(real_max(real_fma(-cosine, cosine, one), (real)(0)) + (real)(16 * UNIT_ROUNDOFF));
    const real along = real_divide(real_fma(across, sine, height), lanes_select(lanes, cosine, one));
    const real both = hypotenuse_above(across, along);
    real_replace(&surface->place_error, lanes, real_min(surface->place_error, (real)(1.01f) * both));
}

// Bounds how far a hit's position may be from the exact one: across the ray by the ray's error, along it by
// that of t, and by the roundings of ray_point and those of the shape.
static inline void surface_set_place_error(Surface *surface, const Ray *ray, const Hit *hit)
{
    real length = ray->length * (real)(1 + 16 * UNIT_ROUNDOFF), t = fabs(hit->t);
    real rounding =
        (real)(2 * UNIT_ROUNDOFF) * (vector_norm1(ray->origin) + vector_norm1(ray->direction) * t);
    real across = ray_place_error(ray, length * t),
         along = length * real_max(hit->high - hit->t, hit->t - hit->low);
    surface->place_error = real_fma((real)(1.04f), hypotenuse_above(across, along), rounding);
    surface->line_error = across * (real)(1 + 16 * UNIT_ROUNDOFF) + rounding; // excludes the surface
    surface->start_error = along * (real)(1 + 16 * UNIT_ROUNDOFF) + rounding;
}

// Sets the error of a reflected ray's line. A flat mirror that is `height` off moves that line by twice the
// height, and keeps its distance from the exact line. So errors of place add up from mirror to mirror,
// whereas those of points grow by one over the cosine.
static inline void surface_set_line_error(Surface *surface, const SurfacePoint *point)
{
    real line_error = real_fma((real)(2), point->height, surface->line_error);
    mask flat = line_error < surface->place_error;
    surface->line_error = lanes_select(flat, line_error, surface->place_error);
    surface->start_error = lanes_select(flat, surface->start_error, (real)(0));
}

// Sets the chord's end where rays hit a sphere.
static inline void surface_set_chord_end(Surface *surface, const Sphere *sphere, const Ray *ray,
                                         const Hit *hit, const LaneSurfacePoints *found)
{
    ChordEnd end = chord_end(sphere, ray, hit, found->point.position, found->lanes);
    real_replace(&surface->place_error, found->lanes, real_min(surface->place_error, end.place));
    surface->chord_end = chord_end_select(found->lanes, end, surface->chord_end);
}

// Sets the bounds at a hit. Marks the lanes where the side that the ray comes from, or that of the shading
// normal, is uncertain.
static inline void surface_set_errors(Surface *surface, const SurfacePoint *point, const Ray *ray)
{
    surface->normal_error = point_normal_error(point, surface->place_error);
    real geometric_error = surface->normal_error;
    mask is_open = mask_none();
    if (HAS_TRIANGLES) { // triangles with smooth normals
        real shading_cosine = vector_dot(point->shading_normal, point->normal);
        mask flat = shading_cosine == vector_dot(point->normal, point->normal);
        geometric_error =
            lanes_select(flat, surface->normal_error, point->normal_error + (real)(16 * UNIT_ROUNDOFF));
        is_open = fabs(shading_cosine) <= geometric_error + surface->normal_error;
        surface->geometric_error = geometric_error;
    }
    real cosine = fabs(vector_dot(point->normal, ray->direction)); // times the ray's length
    real cosine_error = geometric_error + ray->direction_error + (real)(16 * UNIT_ROUNDOFF);
    is_open = is_open | !(cosine > cosine_error * ray->length);
    surface->uncertain = surface->uncertain | (surface_found(surface) & is_open);
}

#endif
