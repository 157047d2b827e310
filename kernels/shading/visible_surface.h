// Finds the surface that a ray shows, and the origins of the rays that leave it.
#ifndef VISIBLE_SURFACE_H
#define VISIBLE_SURFACE_H

#include "shading/interaction.h"

// Returns the origin of a secondary ray, on the side that the ray came from or, if `through`, on the other.
// It lies off the surface by twice the bound on the position's error: once for that error and once for the
// new ray's test of the surface.
static inline Vector secondary_ray_origin(const Surface *surface, bool through)
{
    if (IS_CERTIFIED) return surface->position; // the ray knows which object it leaves
    return vector_fma(surface_normal(surface),
                      through ? -surface->refracted_offset : surface->error + surface->error,
                      surface->position);
}

// Returns the origin of a ray to a light.
static inline Vector shadow_ray_origin(const Surface *surface)
{
    Vector origin = secondary_ray_origin(surface, false);
    return HAS_SMOOTH_NORMALS ? vector_add(origin, surface->lift) : origin;
}

// Returns the lanes within `reach` of where a transparent object may touch an opaque one.
static inline mask may_be_in_contact(const Scene *scene, Vector p, real reach)
{
    Vector low = vector_of(scene->header->contact_low), high = vector_of(scene->header->contact_high);
    return (p.x >= low.x - reach) & (p.x <= high.x + reach) & (p.y >= low.y - reach) &
           (p.y <= high.y + reach) & (p.z >= low.z - reach) & (p.z <= high.z + reach);
}

// The line that searches for an opaque surface reaches this many errors of the surface's position to both
// sides of it, and its own start is off by CONTACT_START_ERRORS of them.
#define CONTACT_REACH        ((real)(16))
#define CONTACT_START_ERRORS ((real)(1.5f))

// Returns the lanes of a transparent surface that an opaque one may touch. An opaque surface that lies in it
// would be crossed by a short line along the normal.
static inline mask surface_may_touch_opaque(const Scene *scene, const Surface *surface)
{
    mask transparent = surface_found(surface) & surface_is_transparent(surface);
    real reach = CONTACT_REACH * surface->position_error;
    transparent = transparent & may_be_in_contact(scene, surface->position, reach);
    if (!lanes_any(transparent)) return mask_none();
    Ray inward = ray_make_unit(vector_fma(surface_normal(surface), reach, surface->position),
                               vector_negate(surface_normal(surface)), transparent);
    inward.tmax = reach + reach;
    inward.origin_error = CONTACT_START_ERRORS * surface->position_error;
    Hit opaque = closest_opaque_hit(scene, &inward);
    return transparent & (hit_found(&opaque) | opaque.uncertain);
}

// Searches for opaque surfaces just behind transparent ones, from one error before them up to a gap of 3
// errors, since a refracted ray starts 2 behind and t is off by up to 1. An opaque surface within the error
// coincides with the transparent one and becomes the hit of the lanes returned. If it is farther, the
// refracted ray starts halfway to it.
static inline mask surface_find_opaque(const Scene *scene, Surface *surface, Hit *hit)
{
    mask transparent = surface_found(surface) & surface_is_transparent(surface);
    transparent = transparent & may_be_in_contact(scene, surface->position, (real)(0));
    if (!lanes_any(transparent)) return mask_none();
    real error = surface->error, offset = error + error;
    Ray inward = ray_make_unit(secondary_ray_origin(surface, false), vector_negate(surface_normal(surface)),
                               transparent);
    inward.tmin = error;
    inward.tmax = offset + 3 * error;
    Hit opaque = closest_opaque_hit(scene, &inward);
    mask found = hit_found(&opaque);
    real gap = opaque.t - offset;
    mask touches = found & (gap <= error);
    real_replace(&surface->refracted_offset, found & !touches, 0.5f * gap);
    hit->object = lanes_select(touches, opaque.object, hit->object);
    return touches;
}

// Returns the visible surface. Where a transparent and an opaque one coincide, it is the opaque one, so that
// glass on a floor shows the floor. Secondary rays start beyond both. A second round treats the lanes whose
// hit was replaced. It is a loop, since compilers would inline surface_interaction twice.
static inline Surface visible_surface(const Scene *scene, const Ray *ray, Hit *hit)
{
    real transparent_error = (real)(0), transparent_offset = (real)(LARGEST);
    for (bool replaced = false;; replaced = true) {
        Surface surface = surface_interaction(scene, ray, hit);
        if (!HAS_TRANSMISSION) return surface;
        if (IS_CERTIFIED) {
            surface.uncertain = surface.uncertain | surface_may_touch_opaque(scene, &surface);
            return surface;
        }
        surface.error = real_max(surface.error, transparent_error);
        surface.refracted_offset = real_min(surface.refracted_offset, transparent_offset);
        if (replaced) return surface;
        mask touches = surface_find_opaque(scene, &surface, hit);
        if (!lanes_any(touches)) return surface;
        transparent_error = lanes_select(touches, surface.error, (real)(0));
        transparent_offset = surface.refracted_offset;
    }
}

#endif
