// Lights and Phong shading (Phong, Illumination for computer generated pictures, CACM 18(6), 1975).
#ifndef PHONG_H
#define PHONG_H

#include "shading/surface.h"

typedef struct {
    Vector direction; // from the surface to the light, unit
    real strength;    // 0..1: a spotlight's falloff
    Ray shadow_ray;   // ends at the light
} LightRay;

// 1 in a spotlight's full cone, 0 outside it, smooth between. The angle is measured as
// s = 1 - cos = |l - axis|^2 / 2, which is accurate for narrow cones, where the cosine has no bits left.
static inline real spot_strength(const Light *light, Vector from_light)
{
    Vector difference = vector_subtract(from_light, vector_of(light->direction));
    real s = (real)(0.5f) * vector_dot(difference, difference);
    real x = ((real)(light->cone.x) - s) * (real)(light->cone.z);
    x = real_min(real_max(x, (real)(0)), (real)(1));
    real soft = x * x * real_fma((real)(-2), x, (real)(3));
    real hard = lanes_select(s <= (real)(light->cone.x), (real)(1), (real)(0));
    return light->cone.z == 0 ? hard : soft;
}

// The shadow ray to a point or spot light is not normalized: the light is at t = 1. It ends 32 u before, so
// that a surface on which the light lies does not occlude it.
static inline LightRay light_ray(const Light *light, const Surface *surface)
{
    LightRay to_light;
    Vector start = secondary_ray_origin(surface, false);
    to_light.strength = (real)(1);
    bool has_positions = HAS_POINT_LIGHTS || HAS_SPOT_LIGHTS;
    if (HAS_DIRECTIONAL_LIGHTS && (!has_positions || light->kind.x == LIGHT_KIND_DIRECTIONAL)) {
        to_light.direction = vector_negate(vector_of(light->direction));
        to_light.shadow_ray = ray_make(start, to_light.direction, (real)(0), (real)(LARGEST), surface->found);
        return to_light;
    }
    Vector position = vector_of(light->position);
    to_light.direction = vector_normalize(vector_subtract(position, surface->position));
    if (HAS_SPOT_LIGHTS && light->kind.x == LIGHT_KIND_SPOT)
        to_light.strength = spot_strength(light, vector_negate(to_light.direction));
    to_light.shadow_ray = ray_make(start, vector_subtract(position, start), (real)(0),
                                   (real)(1 - 32 * UNIT_ROUNDOFF), surface->found);
    return to_light;
}

// max(0, cos)^shininess of the angle between two unit vectors, for the lanes in `wanted`. Near the
// highlight's center the cosine has no bits left for a high power; its complement s = |a - b|^2 / 2 has. A
// shininess of 0 gives 1.
static inline real phong_highlight(mask wanted, Vector reflected, Vector to_eye, real shininess)
{
    Vector difference = vector_subtract(reflected, to_eye);
    real s = (real)(0.5f) * vector_dot(difference, difference);
    mask nonzero = real_complement_power_is_nonzero(s, shininess);
    real highlight = (real)(0);
    if (lanes_any(wanted & nonzero))
        highlight = lanes_select(
            nonzero, real_complement_power(lanes_select(nonzero, s, (real)(0.5f)), shininess), highlight);
    return lanes_select(shininess == (real)(0), (real)(1), highlight);
}

// How a light reaches the surface.
typedef struct {
    mask lit;         // lanes that it reaches: they face it and are not occluded
    Vector direction; // from the surface to the light, unit
    real facing;      // the cosine between the shading normal and that
    real fraction;    // of the light's color that arrives
} LightVisibility;

// All of that but occlusion, for which the shadow ray is set, active in the lanes that may be lit.
static inline LightVisibility light_reach(const Scene *scene, const Surface *surface, uint index,
                                          Ray *shadow_ray)
{
    Light light = scene->lights[index];
    LightRay to_light = light_ray(&light, surface);
    LightVisibility visibility;
    visibility.direction = to_light.direction;
    visibility.facing = vector_dot(surface->shading_normal, to_light.direction);
    visibility.fraction = to_light.strength;
    visibility.lit = surface->found & (visibility.facing > (real)(0)) & (to_light.strength > (real)(0));
    *shadow_ray = to_light.shadow_ray;
    shadow_ray->active = shadow_ray->active & visibility.lit;
    if (light.kind.x != LIGHT_KIND_DIRECTIONAL)
        ray_set_common_origin(shadow_ray, COMMON_ORIGIN_FIRST_LIGHT + index);
    ray_counter_add(scene, RAYS_SHADOW, shadow_ray->active);
    return visibility;
}

static inline void light_occlude(LightVisibility *visibility, real passing)
{
    visibility->lit = visibility->lit & (passing > (real)(0));
    visibility->fraction = visibility->fraction * passing;
}

static inline LightVisibility light_visibility(const Scene *scene, const Surface *surface, uint index)
{
    Ray shadow_ray;
    LightVisibility visibility = light_reach(scene, surface, index, &shadow_ray);
    if (lanes_any(visibility.lit)) light_occlude(&visibility, transmittance(scene, &shadow_ray));
    return visibility;
}

// One light's contribution; black in lanes that it does not reach.
static inline Color3 phong_shade(const Scene *scene, const Surface *surface, const LightVisibility *light,
                                 uint index)
{
    const Color3 black = {(real)(0), (real)(0), (real)(0)};
    Color3 arriving = vector_scale(vector_of(scene->lights[index].color), light->fraction);
    Color3 color = vector_scale(color_multiply(surface->diffuse, surface->color), light->facing);
    mask glossy = light->lit & (surface->specular > (real)(0));
    if (lanes_any(glossy)) {
        Vector reflected = vector_fma(surface->shading_normal, light->facing + light->facing,
                                      vector_negate(light->direction));
        real highlight =
            surface->specular * phong_highlight(glossy, reflected, surface->to_eye, surface->shininess);
        color = (Color3){color.x + highlight, color.y + highlight, color.z + highlight};
    }
    return vector_select(light->lit, color_multiply(color, arriving), black);
}

#endif
