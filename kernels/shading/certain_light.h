// Bounds the errors of rays to lights and of the light that surfaces reflect, at `certified`
// (docs/numerics.md).
#ifndef CERTAIN_LIGHT_H
#define CERTAIN_LIGHT_H

#include "shading/phong.h"

// The largest error of a shadow ray's origin, in u of its length, that cull spheres allow. Rays with a
// larger error, as from a floor near the horizon, are not culled. Above a 64th the shadow is uncertain.
enum { SHADOW_ERROR_MAX = 1 << 9 };
#define SHADOW_UNCERTAIN_MAX ((real)(0x1p-6f))
// If the facing is uncertain by at most this fraction of full light, the light's contribution is too faint
// to matter.
#define FACING_ERROR_MAX ((real)(0x1p-12f))
// The least fourth power of a light's distance for which cull_slack does not underflow.
#define CULLED_DISTANCE_MIN ((real)(SMALLEST_RATIO * 0x1p30f))

// If the distance d is off by the part r of it, at most SHADOW_UNCERTAIN_MAX, 1 / (a + b d + c d^2) is off by
// less than 1 / (1 - r)^2 - 1 < FADING_ERROR r of it, and not above FADING_MAX times it.
#define FADING_ERROR ((real)(2.06f))
#define FADING_MAX   ((real)(1.04f))
// The steepest slope of x^2 (3 - 2 x), at x = 1/2.
#define SMOOTH_STEP_SLOPE 1.5f

// The relative roundings of a light's color and of its contribution, up to those of the power.
#define COLOR_ROUNDING ((real)(128 * UNIT_ROUNDOFF))

// A highlight's error bound is tightened if it exceeds this.
#define HIGHLIGHT_ERROR_FAINT ((real)(CERTIFIED_COLOR_ERROR * 0x1p-4f))
// The slope of the highlight (1 - d^2 / 2)^n is steepest at d^2 = 2 / (2 n - 1). There it is 1.41 for n = 1
// and near e^-1/2 sqrt(n) for large n, never above HIGHLIGHT_SLOPE sqrt(n) + HIGHLIGHT_SLOPE_MORE.
#define HIGHLIGHT_SLOPE      ((real)(0.61f))
#define HIGHLIGHT_SLOPE_MORE ((real)(0.81f))
// Exceeds the relative roundings of a highlight and of its vectors' distance.
#define HIGHLIGHT_SLACK ((real)(1.01f))

// Bounds the error of a highlight of this brightness if the vectors that it compares are off by `error`. For
// powers n below 1 its slope at the distance d is at most 2 n over 1 - d^2 / 2. The error does not exceed the
// highlight at d - error.
static inline real highlight_error(const Surface *surface, const LightRay *light, real brightness, real error)
{
    const real zero = (real)(0), one = (real)(1), one_half = (real)(0.5f), n = surface->shininess;
    real bound = error * real_fma(HIGHLIGHT_SLOPE, real_sqrt(n), HIGHLIGHT_SLOPE_MORE);
    mask is_root = (n > zero) & (n < one), wide = is_root | (brightness * bound > HIGHLIGHT_ERROR_FAINT);
    wide = wide & (brightness > zero);
    if (lanes_any(wide)) {
        Vector difference = vector_subtract(light_mirrored(surface, light), surface->to_eye);
        real distance = vector_norm(difference), nearest = real_max(distance - error, zero),
             farthest = distance + error;
        real least = real_max(real_fma(-one_half * farthest, farthest, one), zero);
        bound = lanes_select(is_root, error * divide_or(n + n, least, NEVER), bound);
        real highest = HIGHLIGHT_SLACK * highlight_power(wide, one_half * nearest * nearest, n);
        bound = lanes_select(wide, real_min(bound, highest), bound);
    }
    return brightness * real_min(bound, one);
}

// Bounds on a light and on the errors of the way to it, before the shadow ray is traced.
typedef struct {
    real position;      // bounds the errors of the shadow ray's ends
    real angle;         // bounds the error of the light's direction
    real facing;        // bounds the error of its cosine with the shading normal
    real strength;      // bounds the error of its strength, relative to full
    real brightest;     // the largest channel of its color that arrives
    mask out_of_range;  // too near or too far away to bound whether it is occluded
    mask skips_culling; // the errors are too large for cull spheres
} LightErrors;

// Bounds the error of the light's contribution in every channel, while it shines in full.
static inline real light_color_error(const Surface *surface, const LightRay *to_light,
                                     const LightErrors *errors)
{
    real largest = color_largest(surface->diffuse), brightest = errors->brightest;
    real shiny = brightest * surface->specular;
    real compared = real_fma((real)(2), surface->normal_error, errors->angle + surface->eye_error);
    real highlight = highlight_error(surface, to_light, shiny, compared);
    real error = real_fma(brightest * largest, errors->facing, highlight);
    return real_fma(real_fma(brightest, largest, shiny), errors->strength + COLOR_ROUNDING, error);
}

// Extends the bounds of a directional light to those of a point or spot light, where the shadow ray ends.
static inline void light_add_distance_errors(const FlatLight *light, const Surface *surface,
                                             LightRay *to_light, LightErrors *errors)
{
    Ray *shadow_ray = &to_light->shadow_ray;
    shadow_ray->ends_at_light = true;
    errors->position = errors->position + 2 * UNIT_ROUNDOFF * vector_norm1(vector_of(light->position));
    // avoids another root; the unit vector is off by 14.5 u, the dot product by 3 u
    if (!HAS_SMOOTH_NORMALS)
        shadow_ray->length =
            vector_dot(to_light->direction, shadow_ray->direction) * (1 + 24 * UNIT_ROUNDOFF);
    // nothing is known of a light so near that rounding moves it onto the surface, or too far away to square
    real squared = shadow_ray->squared;
    mask in_range = (squared >= SMALLEST_RATIO) & (squared <= 1 / SMALLEST_RATIO);
    real nearest = ray_inverse_length(shadow_ray);
    if (HAS_SMOOTH_NORMALS) { // the light's distance from the position may be less
        Vector to_position = vector_add(shadow_ray->direction, surface->lift);
        real inverse = divide_or((real)(1 + 32 * UNIT_ROUNDOFF), vector_norm(to_position), NEVER);
        nearest = real_max(nearest, inverse);
    }
    real relative = lanes_select(in_range, errors->position * nearest, NEVER);
    errors->out_of_range = !(relative <= SHADOW_UNCERTAIN_MAX);
    errors->skips_culling =
        (relative > SHADOW_ERROR_MAX * UNIT_ROUNDOFF) | (squared * squared < CULLED_DISTANCE_MIN);
    errors->angle = errors->angle + relative + relative;
    if (HAS_FADING_LIGHTS) {
        errors->strength = real_fma(FADING_ERROR, relative, (real)(32 * UNIT_ROUNDOFF));
        errors->brightest = FADING_MAX * errors->brightest * to_light->fading;
    }
}

// Returns the cosine between the geometric normal and the way to the light, and sets to which side of the
// surface the shadow ray leaves.
static inline Bounded light_set_side(const Surface *surface, LightRay *to_light, real angle_error)
{
    Ray *shadow_ray = &to_light->shadow_ray;
    Bounded cosine = {vector_dot(surface_normal(surface), to_light->direction),
                      (HAS_TRIANGLES ? surface->geometric_error : surface->normal_error) + angle_error};
    if (HAS_SMOOTH_NORMALS) { // the shadow ray, not parallel to the light's direction, must leave the surface
        cosine.value =
            vector_dot(surface_normal(surface), shadow_ray->direction) * ray_inverse_length(shadow_ray);
        cosine.error = cosine.error + 96 * UNIT_ROUNDOFF;
        shadow_ray->is_lifted = surface->lift_error > 0;
        shadow_ray->sinks = shadow_ray->is_lifted & (cosine.value < -cosine.error);
    }
    shadow_ray->leaves_outward = surface->entering & (cosine.value > cosine.error);
    return cosine;
}

// Returns the largest channel of the diffuse light that the surface reflects, or 1 if that is more.
static inline real light_brightness(const Surface *surface, real brightest)
{
    return real_max(brightest * color_largest(surface->diffuse), (real)(1));
}

// Removes the lanes that the surface itself hides from the light. Sets those where the light may or may not
// face the surface. Returns the lanes that certainly face away from the light.
static inline mask light_set_facing(const Surface *surface, LightRay *to_light, const LightErrors *errors,
                                    LightVisibility *visibility)
{
    const Bounded cosine = light_set_side(surface, to_light, errors->angle);
    mask turned = (to_light->facing < -errors->facing) | !surface_found(surface);
    mask open = !turned & !(to_light->facing > errors->facing);
    mask faint = errors->facing * light_brightness(surface, errors->brightest) <= FACING_ERROR_MAX;
    visibility->facing_uncertain = open & faint;
    // a light in front of the shading normal but behind the surface is occluded by the surface itself
    mask behind = HAS_TRIANGLES ? !turned & (cosine.value < -cosine.error) : mask_none();
    // unless the ray is lifted beyond its rim
    if (HAS_SMOOTH_NORMALS) behind = behind & !to_light->shadow_ray.sinks;
    visibility->lit = visibility->lit & !behind;
    visibility->uncertain = open & !faint;
    if (HAS_TRIANGLES)
        visibility->uncertain =
            visibility->uncertain | (!turned & !open & (fabs(cosine.value) <= cosine.error));
    visibility->uncertain = visibility->uncertain | (behind & surface_is_transparent(surface));
    return turned;
}

// Adds the error of a spotlight's strength, and the lanes that may be on either side of its edge, except for
// those that are `turned` away.
static inline void light_add_spot_errors(const FlatLight *light, const Surface *surface,
                                         const LightRay *to_light, mask turned, LightErrors *errors,
                                         LightVisibility *visibility)
{
    const Vector from_light = vector_negate(to_light->direction), axis = vector_of(light->direction);
    real s = cosine_complement(from_light, axis), edge = (real)(light->cone.x);
    real error = errors->angle + DIRECTION_ROUNDING;
    real s_error =
        error * (vector_norm(vector_subtract(from_light, axis)) + error) + 16 * UNIT_ROUNDOFF * (s + edge);
    mask at_edge = !turned & (fabs(s - edge) <= s_error);
    real brightness = light_brightness(surface, errors->brightest);
    mask fades = s_error * (real)(light->cone.z) * brightness <= FACING_ERROR_MAX;
    if (light->cone.z == 0)
        fades = mask_none();
    else
        errors->strength =
            errors->strength + real_min((real)(SMOOTH_STEP_SLOPE * light->cone.z) * s_error, (real)(1));
    visibility->uncertain = visibility->uncertain | (at_edge & !fades);
    visibility->facing_uncertain = visibility->facing_uncertain | (at_edge & fades);
}

// Sets the shadow ray's bounds, and what is uncertain before it is traced. Returns the lanes whose errors are
// too large for cull spheres.
static inline mask light_set_errors(const FlatLight *light, const Surface *surface, LightRay *to_light,
                                    LightVisibility *visibility)
{
    Ray *shadow_ray = &to_light->shadow_ray;
    LightErrors errors = {.position = surface->position_error,
                          .angle = DIRECTION_ROUNDING,
                          .brightest = (real)(light->color.w)};
    if (HAS_SMOOTH_NORMALS) errors.position = errors.position + surface->lift_error;
    if (!light_is_directional(light)) light_add_distance_errors(light, surface, to_light, &errors);
    errors.facing = surface->normal_error + errors.angle;
    shadow_ray->direction_error = (real)(2 * UNIT_ROUNDOFF);
    shadow_ray->origin_error = errors.position;
    shadow_ray->origin_object = surface->object;
    const mask turned = light_set_facing(surface, to_light, &errors, visibility);
    if (HAS_SPOT_LIGHTS && light->type.x == LIGHT_TYPE_SPOT)
        light_add_spot_errors(light, surface, to_light, turned, &errors, visibility);
    visibility->color_error = lanes_select(turned, (real)(0), light_color_error(surface, to_light, &errors));
    visibility->uncertain = visibility->uncertain | (visibility->lit & errors.out_of_range);
    shadow_ray->active = shadow_ray->active & !visibility->uncertain;
    return errors.skips_culling;
}

#endif
