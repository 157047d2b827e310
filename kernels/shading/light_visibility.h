// Finds which lights reach a surface.
#ifndef LIGHT_VISIBILITY_H
#define LIGHT_VISIBILITY_H

#include "shading/certain_light.h"

// Returns the light that reaches the surface unless something occludes it. Sets the shadow ray, which is
// active in the lanes that may be lit.
static inline LightVisibility light_reach(const Scene *scene, const Surface *surface, uint index,
                                          Ray *shadow_ray)
{
    FlatLight light = scene->lights[index];
    LightRay to_light = light_ray(scene, &light, index, surface);
    LightVisibility visibility;
    visibility.fraction = to_light.strength;
    visibility.lit = surface_found(surface) & (to_light.facing > 0) & (to_light.strength > 0);
    to_light.shadow_ray.active = to_light.shadow_ray.active & visibility.lit;
    mask skips_culling = mask_none();
    if (IS_CERTIFIED) skips_culling = light_set_errors(&light, surface, &to_light, &visibility);
    visibility.reflected = phong_reflect(surface, &to_light, to_light.shadow_ray.active);
    if (HAS_SKY_LIGHT) visibility.reflected = color_multiply(visibility.reflected, to_light.tint);
    *shadow_ray = to_light.shadow_ray;
    if (!light_is_directional(&light) && !light_has_area(&light))
        ray_set_common_origin(shadow_ray, COMMON_ORIGIN_FIRST_LIGHT + index, skips_culling);
    ray_counter_add(scene, RAYS_SHADOW, shadow_ray->active);
    return visibility;
}

// Reduces the light by what its shadow ray, which has been traced, crosses.
static inline void light_occlude(LightVisibility *visibility, const Traversal *occlusion)
{
    real passing = traversal_transmittance(occlusion);
    if (IS_CERTIFIED) {
        visibility->uncertain = visibility->uncertain | (occlusion->hit.uncertain & visibility->lit);
        visibility->color_error = visibility->color_error * lanes_select(visibility->lit, passing, (real)(1));
    }
    visibility->lit = visibility->lit & (passing > 0);
    visibility->fraction = visibility->fraction * passing;
}

static inline LightVisibility light_visibility(const Scene *scene, const Surface *surface, uint index)
{
    Ray shadow_ray;
    LightVisibility visibility = light_reach(scene, surface, index, &shadow_ray);
    if (!lanes_any(visibility.lit)) return visibility;
    Traversal occlusion;
    ray_traverse(&occlusion, scene, &shadow_ray, OCCLUSION);
    light_occlude(&visibility, &occlusion);
    return visibility;
}

#endif
