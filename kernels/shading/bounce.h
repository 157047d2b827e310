// Reflected and refracted rays (Whitted, An improved illumination model for shaded display,
// CACM 23(6), 1980), without recursion.
#ifndef BOUNCE_H
#define BOUNCE_H

#include "shading/surface.h"

// A ray to trace, and the weight of its color in the pixel. A weight of 0 is no ray.
typedef struct {
    Vector origin, direction; // unit
    Color3 weight;
    uint depth;
    real travelled; // distance from the eye along the path
} Bounce;

static inline mask bounce_is_active(const Bounce *bounce)
{
    return (bounce->weight.x > (real)(0)) | (bounce->weight.y > (real)(0)) | (bounce->weight.z > (real)(0));
}

static inline Ray bounce_ray(const Bounce *bounce)
{
    Ray ray = ray_make_unit(bounce->origin, bounce->direction, bounce_is_active(bounce));
    ray.travelled = bounce->travelled;
    return ray;
}

static inline Vector vector_reflect(Vector direction, Vector normal)
{
    real away = vector_dot(direction, normal);
    return vector_renormalize(vector_fma(normal, (real)(-2) * away, direction));
}

// Snell's law for a unit direction and a unit normal that faces it; returns the lanes of total internal
// reflection. With k = (n - 1)(n + 1) and the cosine c the ray into a body of index n runs along
// d + N (c - sqrt(c^2 + k)), the ray out of it along n d + N (n c - sqrt((n c)^2 - k)). In this form grazing
// rays survive where n is near 1, and n = 1 bends nothing however inexact a device's division is.
static inline mask vector_refract(Vector direction, Vector normal, mask entering, real ior, Vector *refracted)
{
    real scale = lanes_select(entering, (real)(1), ior);
    real above_one = lanes_select(entering, (real)(1) - ior, ior - (real)(1));
    real scaled = scale * -vector_dot(direction, normal);
    real squared = difference_of_products(scaled, scaled, above_one, ior + (real)(1));
    mask total = squared < (real)(0);
    real cosine = real_sqrt(real_max(squared, (real)(0)));
    *refracted = vector_normalize(vector_fma(normal, scaled - cosine, vector_scale(direction, scale)));
    return total;
}

// By the shading normal, or by the geometric one where that would send the ray through the surface.
static inline Vector surface_reflect(const Surface *surface, Vector direction)
{
    Vector reflected = vector_reflect(direction, surface->shading_normal);
    if (!HAS_TRIANGLES) return reflected;
    mask inward = vector_dot(reflected, surface->normal) <= (real)(0);
    return vector_select(inward, vector_reflect(direction, surface->normal), reflected);
}

// Likewise; returns the lanes of total internal reflection.
static inline mask surface_refract(const Surface *surface, Vector direction, Vector *refracted)
{
    mask total =
        vector_refract(direction, surface->shading_normal, surface->entering, surface->ior, refracted);
    if (!HAS_TRIANGLES) return total;
    mask outward = !total & (vector_dot(*refracted, surface->normal) >= (real)(0));
    if (!lanes_any(outward)) return total;
    Vector plain;
    mask plain_total = vector_refract(direction, surface->normal, surface->entering, surface->ior, &plain);
    *refracted = vector_select(outward, plain, *refracted);
    return lanes_select(outward, plain_total, total);
}

// The reflected and the refracted ray of a surface, for a unit `direction`. Returns the lanes of total
// internal reflection, whose reflected ray carries the transmission as well. Unless `all`, a ray that no lane
// carries is not set.
static inline mask surface_bounce(const Surface *surface, Vector direction, Color3 weight, bool all,
                                  Bounce *reflected, Bounce *refracted)
{
    real reflection = surface->reflection;
    mask total = mask_none(), transparent = surface->transmission > (real)(0);
    if (HAS_TRANSMISSION && (all || lanes_any(transparent))) {
        total = surface_refract(surface, direction, &refracted->direction);
        real transmission = lanes_select(total, (real)(0), surface->transmission);
        reflection = reflection + lanes_select(total, surface->transmission, (real)(0));
        refracted->origin = secondary_ray_origin(surface, true);
        refracted->weight = vector_scale(weight, transmission);
        total = total & transparent;
    }
    if (all || lanes_any(reflection > (real)(0))) {
        reflected->direction = surface_reflect(surface, direction);
        reflected->origin = secondary_ray_origin(surface, false);
        reflected->weight = vector_scale(weight, reflection);
    }
    reflected->travelled = refracted->travelled = surface->travelled;
    return total;
}

#endif
