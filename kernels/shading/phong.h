// Implements Phong's reflection (Phong, Illumination for computer generated pictures, CACM 18(6), 1975).
#ifndef PHONG_H
#define PHONG_H

#include "shading/light.h"

// Returns max(0, 1 - s)^shininess for the lanes in `wanted`; a shininess of 0 gives 1.
static inline real highlight_power(mask wanted, real s, real shininess)
{
    mask nonzero = real_complement_power_is_nonzero(s, shininess);
    real highlight = (real)(0);
    if (lanes_any(wanted & nonzero))
        highlight = lanes_select(
            nonzero, real_complement_power(lanes_select(nonzero, s, (real)(0.5f)), shininess), highlight);
    return lanes_select(shininess == 0, (real)(1), highlight);
}

// Returns the light's direction mirrored by the shading normal.
static inline Vector light_mirrored(const Surface *surface, const LightRay *light)
{
    return vector_fma(surface->shading_normal, light->facing + light->facing,
                      vector_negate(light->direction));
}

// Returns the factor by which the surface reflects a light, in the lanes that the light reaches.
static inline Color3 phong_reflect(const Surface *surface, const LightRay *to_light, mask lit)
{
    Color3 color = vector_scale(surface->diffuse, to_light->facing);
    mask glossy = lit & (surface->specular > 0);
    if (!lanes_any(glossy)) return color;
    // s is 1 minus the cosine between the mirrored light and the eye's direction
    const real s = cosine_complement(light_mirrored(surface, to_light), surface->to_eye);
    real highlight = surface->specular * highlight_power(glossy, s, surface->shininess);
    if (HAS_TINTS) return vector_fma(surface->specular_tint, highlight, color);
    return (Color3){color.x + highlight, color.y + highlight, color.z + highlight};
}

#endif
