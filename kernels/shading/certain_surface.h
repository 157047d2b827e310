// Bounds the errors of the surface at a hit, at `certified` (docs/numerics.md).
#ifndef CERTAIN_SURFACE_H
#define CERTAIN_SURFACE_H

#include "shading/surface.h"
#include "shapes/certain_triangle.h"

// Returns a lower bound on the cosine of the exact ray's incidence on a plane, or 0.
static inline real least_cosine(Vector normal, const Ray *ray)
{
    const real error = ray->direction_error + (128 * UNIT_ROUNDOFF + 2 * TRIANGLE_NORMAL_ERROR);
    return real_max(fabs(vector_dot(normal, ray->direction)) * ray_inverse_length(ray) - error, (real)(0));
}

// Exceeds 1 + 3/2 g for the largest error g of a ray's direction, BOUNCE_ERROR_MAX. The exact ray may be
// turned by g, so that the errors along and across it are not quite at right angles, and the error across
// grows by g times the one along.
#define POSITION_SLACK ((real)(1.04f))
// Exceeds the roundings of a position that is narrowed, whose cosine of incidence is at least
// NARROWED_COSINE_MIN.
#define NARROWED_SLACK      ((real)(1.01f))
#define NARROWED_COSINE_MIN ((real)(0x1p-6f))

// Lowers the bound on the position's error where the surface is flat. The exact hit is where the exact ray,
// line_error off, crosses a plane that the position is `height` above; `cosine` is its least_cosine.
static inline void surface_narrow_position(Surface *surface, mask lanes, real height, real cosine)
{
    const real one = (real)(1), across = surface->line_error;
    lanes = lanes & (cosine > NARROWED_COSINE_MIN);
    const real sine = real_sqrt(real_max(real_fma(-cosine, cosine, one), (real)(0)) + 16 * UNIT_ROUNDOFF);
    const real along = real_divide(real_fma(across, sine, height), lanes_select(lanes, cosine, one));
    const real both = hypotenuse_above(across, along);
    real_replace(&surface->position_error, lanes, real_min(surface->position_error, NARROWED_SLACK * both));
}

// Sets the bounds that follow from the ray and its t. The position may be off across the ray by the ray's
// error, along it by that of t, and by the roundings of ray_point and those of the shape.
static inline void surface_start_errors(Surface *surface, const Ray *ray, const Hit *hit)
{
    surface->eye_error = ray->direction_error + DIRECTION_ROUNDING;
    surface->uncertain = hit->uncertain;
    if (HAS_CHORDS) surface->chord_end = chord_end_none();
    real length = ray->length * BOUND_SLACK, t = fabs(hit->t);
    real rounding = 2 * UNIT_ROUNDOFF * (vector_norm1(ray->origin) + vector_norm1(ray->direction) * t);
    real across = ray_position_error(ray, length * t),
         along = length * real_max(hit->high - hit->t, hit->t - hit->low);
    surface->position_error = real_fma(POSITION_SLACK, hypotenuse_above(across, along), rounding);
    surface->line_error = across * BOUND_SLACK + rounding; // excludes the surface
    surface->start_error = along * BOUND_SLACK + rounding;
}

// Sets the error of a reflected ray's line. A flat mirror that is `height` off moves that line by twice the
// height, and keeps its distance from the exact line. So errors of position add up from mirror to mirror,
// whereas those of points grow by one over the cosine.
static inline void surface_set_line_error(Surface *surface, const SurfacePoint *point)
{
    real line_error = real_fma((real)(2), point->height, surface->line_error);
    mask flat = line_error < surface->position_error;
    surface->line_error = lanes_select(flat, line_error, surface->position_error);
    surface->start_error = lanes_select(flat, surface->start_error, (real)(0));
}

// Sets the bounds of the lanes that hit one object, for their position and for their point's normal.
static inline void surface_set_point_errors(Surface *surface, LaneSurfacePoints *points, const Scene *scene,
                                            const Ray *ray, const Hit *hit)
{
    SurfacePoint *point = &points->point;
    // the exact hit lies within position_error of the ray's own point
    point->position = ray_point(ray, hit->t);
    if (HAS_CHORDS && points->entry.x == TYPE_SPHERES) {
        Sphere sphere = scene->spheres[points->entry.y];
        const ChordEnd end = chord_end(&sphere, ray, hit, point->position, points->lanes);
        real_replace(&surface->position_error, points->lanes,
                     real_min(surface->position_error, end.position));
        surface->chord_end = chord_end_select(points->lanes, end, surface->chord_end);
    }
    shape_set_errors(scene, points, ray, hit->t, surface->position_error);
    if (!HAS_TRIANGLES || points->entry.x != TYPE_TRIANGLES)
        surface_narrow_position(surface, points->lanes & (point->height < NEVER), point->height,
                                least_cosine(point->normal, ray));
}

// Sets the bounds at a hit. Marks the lanes where the side that the ray comes from, or that of the shading
// normal, is uncertain.
static inline void surface_set_errors(Surface *surface, const SurfacePoint *point, const Ray *ray)
{
    surface->normal_error = point_normal_error(point, surface->position_error);
    real geometric_error = surface->normal_error;
    mask is_open = mask_none();
    if (HAS_TRIANGLES) { // triangles with smooth normals
        real shading_cosine = vector_dot(point->shading_normal, point->normal);
        mask flat = shading_cosine == vector_dot(point->normal, point->normal);
        geometric_error = lanes_select(flat, surface->normal_error, point->normal_error + DIRECTION_ROUNDING);
        is_open = fabs(shading_cosine) <= geometric_error + surface->normal_error;
        surface->geometric_error = geometric_error;
    }
    real cosine = fabs(vector_dot(point->normal, ray->direction)); // times the ray's length
    real cosine_error = geometric_error + ray->direction_error + DIRECTION_ROUNDING;
    is_open = is_open | !(cosine > cosine_error * ray->length);
    surface->uncertain = surface->uncertain | (surface_found(surface) & is_open);
    surface_set_line_error(surface, point);
    if (HAS_SMOOTH_NORMALS) surface->lift_error = point->lift_error;
}

#endif
