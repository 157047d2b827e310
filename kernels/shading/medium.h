// Absorbs light along a ray's way through transparent bodies, by the law of Bouguer, Lambert and Beer. Over
// the length d a fraction exp(-density d) of the light remains (Born, Wolf, Principles of Optics, 1999,
// section 14.1).
#ifndef MEDIUM_H
#define MEDIUM_H

#include "shading/bounce.h"

// Returns the medium up to a hit. A surface that is hit from inside determines it, whichever surface the ray
// entered before.
static inline Medium medium_before(Medium medium, const Surface *surface)
{
    mask inside = surface_found(surface) & !surface->entering & surface_is_transparent(surface);
    vector_replace(&medium.density, inside, surface->absorption);
    return medium;
}

// Returns the medium of a refracted ray. A ray that leaves a body inside another one returns to the outer
// one.
static inline Medium medium_behind(Medium medium, const Surface *surface)
{
    return (Medium){vector_select(surface->entering, surface->absorption, medium.outer),
                    vector_select(surface->entering, medium.density, color_gray((real)(0)))};
}

// The length over which rays that hit nothing are absorbed completely. Its products with densities do not
// overflow, because the host keeps densities in a range (host/compile/materials.c).
#if IS_DOUBLE
#define ABSORBED_LENGTH_MAX ((real)(0x1p500))
#else
#define ABSORBED_LENGTH_MAX ((real)(0x1p60f))
#endif

static inline real part_left(real density, real length)
{
    return real_max(real_exp_negative(-density * length), (real)(SMALLEST_RATIO));
}

// Returns the weight that remains where a ray in this medium ends, at t, or beyond all surfaces. Absorption
// alone never ends a path, so that paths do not depend on the precision.
static inline Color3 weight_absorbed(Color3 weight, const Medium *medium, mask found, real t)
{
    const real zero = (real)(0);
    Color3 density = medium->density;
    if (!lanes_any((density.x > zero) | (density.y > zero) | (density.z > zero))) return weight;
    real length = lanes_select(found, real_min(t, ABSORBED_LENGTH_MAX), ABSORBED_LENGTH_MAX);
    return weight_tinted(weight, (Color3){part_left(density.x, length), part_left(density.y, length),
                                          part_left(density.z, length)});
}

#endif
