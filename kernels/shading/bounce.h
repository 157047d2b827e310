// Mirrors and glass: the rays a surface sends on (Whitted, An improved illumination model for shaded display,
// CACM 23(6), 1980), without recursion.
#ifndef BOUNCE_H
#define BOUNCE_H

#include "shading/surface.h"

// A ray still to be followed, and how much of its color reaches the picture. Weights of 0 carry no ray.
typedef struct {
    Vector origin, direction; // unit
    Color3 weight;
    uint depth;
    real travelled; // from the eye
} Bounce;

static inline mask bounce_counts(const Bounce *bounce)
{
    return (bounce->weight.x > (real)(0)) | (bounce->weight.y > (real)(0)) | (bounce->weight.z > (real)(0));
}

static inline Ray bounce_ray(const Bounce *bounce)
{
    Ray ray = ray_make_unit(bounce->origin, bounce->direction, bounce_counts(bounce));
    ray.travelled = bounce->travelled;
    return ray;
}

static inline Vector reflected_direction(Vector direction, Vector normal)
{
    real away = vector_dot(direction, normal);
    return vector_renormalize(vector_fma(normal, (real)(-2) * away, direction));
}

// Snell's law for a unit direction against a unit normal that faces it; the mask tells where there is total
// reflection instead. With k = (n - 1)(n + 1) and the cosine c the ray into a body of index n runs along
// d + N (c - sqrt(c^2 + k)), the one out of it along n d + N (n c - sqrt((n c)^2 - k)): so written grazing
// rays are not lost where n is near 1, and n = 1 bends nothing however inexact a device's quotients are.
static inline mask refracted_direction(Vector direction, Vector normal, mask entering, real ior,
                                       Vector *refracted)
{
    real scale = lanes_select(entering, (real)(1), ior);
    real above_one = lanes_select(entering, (real)(1) - ior, ior - (real)(1));
    real scaled = scale * -vector_dot(direction, normal);
    real squared = product_difference(scaled, scaled, above_one, ior + (real)(1));
    mask total = squared < (real)(0);
    real cosine = real_sqrt(real_max(squared, (real)(0)));
    *refracted = vector_normalize(vector_fma(normal, scaled - cosine, vector_scale(direction, scale)));
    return total;
}

// Only on a smooth surface are there two normals, and may one send a ray where the other would not.
static inline Vector mirrored_direction(const Surface *surface, Vector direction)
{
    Vector mirrored = reflected_direction(direction, surface->shading_normal);
    if (!HAS_TRIANGLES) return mirrored;
    mask sunk = vector_dot(mirrored, surface->normal) <= (real)(0);
    return vector_select(sunk, reflected_direction(direction, surface->normal), mirrored);
}

static inline mask passed_direction(const Surface *surface, Vector direction, Vector *passed)
{
    mask total =
        refracted_direction(direction, surface->shading_normal, surface->entering, surface->ior, passed);
    if (!HAS_TRIANGLES) return total;
    mask outward = !total & (vector_dot(*passed, surface->normal) >= (real)(0));
    if (!lanes_any(outward)) return total;
    Vector plain;
    mask plain_total =
        refracted_direction(direction, surface->normal, surface->entering, surface->ior, &plain);
    *passed = vector_select(outward, plain, *passed);
    return lanes_select(outward, plain_total, total);
}

// What the surface sends on: the mirrored ray, and the one through it. Where all is reflected the mirrored
// ray carries what would have passed; the mask returned tells where. `direction` is the ray's, unit. A ray
// that carries nothing in any lane is left out, unless all are asked for.
static inline mask surface_bounce(const Surface *surface, Vector direction, Color3 weight, bool all,
                                  Bounce *mirrored, Bounce *passed)
{
    real reflection = surface->reflection;
    mask total = mask_none(), transparent = surface->transmission > (real)(0);
    if (HAS_TRANSMISSION && (all || lanes_any(transparent))) {
        total = passed_direction(surface, direction, &passed->direction);
        real transmission = lanes_select(total, (real)(0), surface->transmission);
        reflection = reflection + lanes_select(total, surface->transmission, (real)(0));
        passed->origin = surface_leave(surface, true);
        passed->weight = vector_scale(weight, transmission);
        total = total & transparent;
    }
    if (all || lanes_any(reflection > (real)(0))) {
        mirrored->direction = mirrored_direction(surface, direction);
        mirrored->origin = surface_leave(surface, false);
        mirrored->weight = vector_scale(weight, reflection);
    }
    mirrored->travelled = passed->travelled = surface->travelled;
    return total;
}

#endif
