// Computes lights and Phong shading (Phong, Illumination for computer generated pictures, CACM 18(6), 1975).
#ifndef PHONG_H
#define PHONG_H

#include "shading/visible_surface.h"

typedef struct {
    Vector direction; // from the surface to the light, unit
    real facing;      // the cosine between the shading normal and `direction`
    real strength;    // the fraction of the light's color that arrives unless it is occluded
    real fading;      // with HAS_FADING_LIGHTS, the fraction by distance alone
    Color3 tint;      // with HAS_SKY_LIGHT, factors of the light's color
    Ray shadow_ray;   // ends at the light
} LightRay;

// Returns 1 in a spotlight's full cone, 0 outside it, and a smooth value between. The angle is measured as
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

// Returns the strength of a light at a vector's length, which is never 0.
static inline real light_fading(const Light *light, Vector to_light)
{
    real light_distance = real_sqrt(vector_dot(to_light, to_light));
    real divisor = real_fma((real)(light->fading.z), light_distance, (real)(light->fading.y));
    divisor = real_max(real_fma(divisor, light_distance, (real)(light->fading.x)), (real)(SMALLEST_RATIO));
    return real_max(real_divide((real)(1), divisor), (real)(SMALLEST_RATIO));
}

// Returns the vector from the center of a light's area to the surface's sample of it. A sphere is seen as a
// disc, whose points are lifted to the sphere.
static inline Vector light_area_offset(const Light *light, uint index, const Surface *surface)
{
    SquarePoint point = sample_point(&surface->sample, SAMPLED_LIGHTS + index);
    if (light->type.y == LIGHT_AREA_TRIANGLE)
        point = triangle_of_square(point);
    else if (light->type.y != LIGHT_AREA_RECTANGLE)
        point = disc_of_square(point);
    if (light->type.y != LIGHT_AREA_SPHERE)
        return vector_fma(vector_of(light->across_u), point.x,
                          vector_scale(vector_of(light->across_v), point.y));
    // Where the basis jumps, a pixel's samples do not complement each other. This one jumps only where a
    // surface lies exactly along the axis, which is not a coordinate axis.
    const Vector axis = {(real)(0.37f), (real)(0.48f), (real)(0.79f)};
    Vector toward = vector_normalize(vector_subtract(surface->position, vector_of(light->position)));
    Vector u = vector_normalize(vector_cross(toward, axis)), v = vector_cross(toward, u);
    real height =
        real_sqrt(real_max(real_fma(-point.x, point.x, real_fma(-point.y, point.y, (real)(1))), (real)(0)));
    Vector offset = vector_fma(u, point.x, vector_fma(v, point.y, vector_scale(toward, height)));
    return vector_scale(offset, (real)(light->across_u.w));
}

// Returns the direction of the surface's sample of the sky's light, a random one if there is one sample per
// pixel. Sets *tint to the light from there, in fractions of the light's color.
static inline Vector sky_sample(const Scene *scene, const Light *light, uint index, const Surface *surface,
                                Color3 *tint)
{
    global const SceneHeader *header = scene->header;
    Sample sample = surface->sample;
    if (sample.index == SAMPLE_CENTER) sample.index = 0;
    SquarePoint point = sample_point(&sample, SAMPLED_LIGHTS + index);
    const real one = (real)(1);
    real columns = (point.x + one) * (real)(SKY_COLUMNS / 2), rows = (point.y + one) * (real)(SKY_ROWS / 2);
    RealLanes column = {floor(columns)}, row = {floor(rows)};
    RealLanes longitude, longitudes, sine, sines;
    for (uint lane = 0; lane < LANES; lane++) {
        scalar4 cell = scene->sky_cells[(uint)row.each[lane] * SKY_COLUMNS + (uint)column.each[lane]].place;
        longitude.each[lane] = cell.x;
        longitudes.each[lane] = cell.y;
        sine.each[lane] = cell.z;
        sines.each[lane] = cell.w;
    }
    longitude.all = real_fma(columns - column.all, longitudes.all, longitude.all);
    sine.all = real_fma(rows - row.all, sines.all, sine.all);
    real across = real_sqrt(real_max(real_fma(-sine.all, sine.all, one), (real)(0)));
    if (HAS_IMAGES && header->sky_texture.x > 0)
        *tint = sky_texel_color(scene, longitude.all, real_turns(across, sine.all), surface_found(surface));
    else
        *tint = sky_blended_color(header, sine.all);
    // rounding may give the color of a brighter texel next to the cell
    *tint = vector_scale(*tint, longitudes.all * sines.all * (real)(light->across_u.w));
    *tint = (Color3){real_min(tint->x, one), real_min(tint->y, one), real_min(tint->z, one)};
    Vector level =
        vector_of_turns(vector_of(header->sky_forward), vector_of(header->sky_right), longitude.all);
    return vector_fma(vector_of(header->sky_up), sine.all, vector_scale(level, across));
}

// Returns the ray to a light. The shadow ray to a point or spot light is not normalized, so that the light
// is at t = 1. It ends 32 u before that, so that a surface on which the light lies does not occlude it.
static inline LightRay light_ray(const Scene *scene, const Light *light, uint index, const Surface *surface)
{
    bool has_area = HAS_AREA_LIGHTS && light->type.y != LIGHT_AREA_NONE;
    bool is_sky = HAS_SKY_LIGHT && light->type.y == LIGHT_AREA_SKY;
    LightRay to_light;
    if (HAS_SKY_LIGHT) to_light.tint = (Color3){(real)(1), (real)(1), (real)(1)};
    Vector start = shadow_ray_origin(surface);
    to_light.strength = to_light.fading = (real)(1);
    bool has_positions = HAS_POINT_LIGHTS || HAS_SPOT_LIGHTS;
    if (HAS_DIRECTIONAL_LIGHTS && (!has_positions || light->type.x == LIGHT_TYPE_DIRECTIONAL)) {
        to_light.direction = vector_negate(vector_of(light->direction));
        if (is_sky)
            to_light.direction = sky_sample(scene, light, index, surface, &to_light.tint);
        else if (has_area)
            to_light.direction =
                vector_normalize(vector_add(to_light.direction, light_area_offset(light, index, surface)));
        to_light.facing = vector_dot(surface->shading_normal, to_light.direction);
        to_light.shadow_ray =
            ray_make(start, to_light.direction, (real)(0), (real)(LARGEST), surface_found(surface));
        return to_light;
    }
    Vector position = vector_of(light->position);
    if (has_area) position = vector_add(position, light_area_offset(light, index, surface));
    Vector to_position = vector_subtract(position, surface->position);
    to_light.direction = vector_normalize(to_position);
    to_light.facing = vector_dot(surface->shading_normal, to_light.direction);
    if (HAS_SPOT_LIGHTS && light->type.x == LIGHT_TYPE_SPOT)
        to_light.strength = spot_strength(light, vector_negate(to_light.direction));
    if (HAS_FADING_LIGHTS) {
        to_light.fading = light_fading(light, to_position);
        to_light.strength = to_light.strength * to_light.fading;
    }
    to_light.shadow_ray = ray_make(start, vector_subtract(position, start), (real)(0),
                                   (real)(1 - 32 * UNIT_ROUNDOFF), surface_found(surface));
    return to_light;
}

// Returns max(0, 1 - s)^shininess for the lanes in `wanted`; a shininess of 0 gives 1.
static inline real highlight_power(mask wanted, real s, real shininess)
{
    mask nonzero = real_complement_power_is_nonzero(s, shininess);
    real highlight = (real)(0);
    if (lanes_any(wanted & nonzero))
        highlight = lanes_select(
            nonzero, real_complement_power(lanes_select(nonzero, s, (real)(0.5f)), shininess), highlight);
    return lanes_select(shininess == (real)(0), (real)(1), highlight);
}

// Returns max(0, cos)^shininess of the angle between two unit vectors, for the lanes in `wanted`. Near the
// highlight's center the cosine has no bits left for a high power, but its complement s = |a - b|^2 / 2 has.
static inline real phong_highlight(mask wanted, Vector reflected, Vector to_eye, real shininess)
{
    Vector difference = vector_subtract(reflected, to_eye);
    return highlight_power(wanted, (real)(0.5f) * vector_dot(difference, difference), shininess);
}

// The light from a source that reaches a surface.
typedef struct {
    mask lit;         // lanes that face the light and are not occluded
    Color3 reflected; // the factor by which the surface reflects it
    real fraction;    // the fraction of the light's color that arrives
    // At `certified`, the lanes where the shadow is uncertain, and others that may or may not face the
    // light, which matters only to highlights and masks of shadows, because the rest fades to 0.
    mask uncertain, facing_uncertain;
    real color_error; // at `certified`, bounds the error of the light's contribution in every channel
} LightVisibility;

// The largest error of a shadow ray's origin, in u of its length, that cull spheres allow. Rays with a
// larger error, as from a floor near the horizon, are not culled. Above a 64th the shadow is uncertain.
enum { SHADOW_ERROR_MAX = 1 << 9 };
#define SHADOW_UNCERTAIN_MAX ((real)(0x1p-6f))
// If the facing is uncertain by at most this fraction of full light, the light's contribution is too faint
// to matter.
#define FACING_ERROR_MAX ((real)(0x1p-12f))
// The least fourth power of a light's distance for which cull_slack does not underflow.
#define CULLED_DISTANCE_MIN ((real)(SMALLEST_RATIO * 0x1p30f))

// The relative roundings of a light's color and of its contribution, up to those of the power.
#define COLOR_ROUNDING ((real)(128 * UNIT_ROUNDOFF))

// Returns the light's direction mirrored by the shading normal.
static inline Vector light_reflected(const Surface *surface, const LightRay *light)
{
    return vector_fma(surface->shading_normal, light->facing + light->facing,
                      vector_negate(light->direction));
}

// A highlight's error bound is tightened if it exceeds this.
#define HIGHLIGHT_ERROR_FAINT ((real)(CERTIFIED_COLOR_ERROR * 0x1p-4f))

// Bounds the error of a highlight of this brightness if the vectors that it compares are off by `error`. It
// falls with their distance d as (1 - d^2 / 2)^n. Its slope is at most 0.61 sqrt(n) + 0.81 for n >= 1, and
// at most n over 1 - d^2 / 2 for smaller n. The error does not exceed the highlight at d - error.
static inline real highlight_error(const Surface *surface, const LightRay *light, real brightness, real error)
{
    const real zero = (real)(0), one = (real)(1), one_half = (real)(0.5f), n = surface->shininess;
    real bound = error * real_fma((real)(0.61f), real_sqrt(n), (real)(0.81f));
    mask is_root = (n > zero) & (n < one), wide = is_root | (brightness * bound > HIGHLIGHT_ERROR_FAINT);
    wide = wide & (brightness > zero);
    if (lanes_any(wide)) {
        Vector difference = vector_subtract(light_reflected(surface, light), surface->to_eye);
        real distance = vector_norm(difference), nearest = real_max(distance - error, zero),
             farthest = distance + error;
        real least = real_max(real_fma(-one_half * farthest, farthest, one), zero);
        bound = lanes_select(is_root, error * divide_or(n + n, least, NEVER), bound);
        real highest = (real)(1.01f) * highlight_power(wide, one_half * nearest * nearest, n);
        bound = lanes_select(wide, real_min(bound, highest), bound);
    }
    return brightness * real_min(bound, one);
}

// Bounds on a light and on the errors of the way to it, before the shadow ray is traced.
typedef struct {
    real place;         // bounds the errors of the shadow ray's ends
    real angle;         // bounds the error of the light's direction
    real facing;        // bounds the error of its cosine with the shading normal
    real strength;      // bounds the error of its strength, relative to full
    real brightest;     // the largest channel of its color that arrives
    mask far_off;       // too near or too far away to bound whether it is occluded
    mask skips_culling; // the errors are too large for cull spheres
} LightErrors;

// Bounds the error of the light's contribution in every channel, while it shines in full.
static inline real light_color_error(const Surface *surface, const LightRay *to_light,
                                     const LightErrors *errors)
{
    Color3 diffuse = surface->diffuse;
    real largest = real_max(real_max(diffuse.x, diffuse.y), diffuse.z), brightest = errors->brightest;
    real shiny = brightest * surface->specular;
    real compared = real_fma((real)(2), surface->normal_error, errors->angle + surface->eye_error);
    real highlight = highlight_error(surface, to_light, shiny, compared);
    real error = real_fma(brightest * largest, errors->facing, highlight);
    return real_fma(real_fma(brightest, largest, shiny), errors->strength + COLOR_ROUNDING, error);
}

// Returns the bounds of a directional light, which those of other lights extend.
static inline LightErrors light_errors(const Light *light, const Surface *surface)
{
    LightErrors errors;
    errors.place = surface->place_error;
    if (HAS_SMOOTH_NORMALS) errors.place = errors.place + surface->lift_error;
    errors.angle = (real)(16 * UNIT_ROUNDOFF);
    errors.strength = (real)(0);
    errors.brightest = (real)(light->color.w);
    errors.far_off = errors.skips_culling = mask_none();
    return errors;
}

// Extends the bounds to those of a light at a distance, a point or spot light, at which its shadow ray ends.
static inline void light_add_distance_errors(const Light *light, const Surface *surface, LightRay *to_light,
                                             LightErrors *errors)
{
    Ray *shadow_ray = &to_light->shadow_ray;
    shadow_ray->ends_at_light = true;
    errors->place = errors->place + (real)(2 * UNIT_ROUNDOFF) * vector_norm1(vector_of(light->position));
    // avoids another root, as a unit vector is off by 14.5 u and a dot product by 3 u
    if (!HAS_SMOOTH_NORMALS)
        shadow_ray->length =
            vector_dot(to_light->direction, shadow_ray->direction) * (real)(1 + 24 * UNIT_ROUNDOFF);
    // nothing is known of a light so near that rounding moves it onto the surface, or too far away to square
    real squared = shadow_ray->squared;
    mask in_range = (squared >= (real)(SMALLEST_RATIO)) & (squared <= (real)(1 / SMALLEST_RATIO));
    real nearest = ray_inverse_length(shadow_ray);
    if (HAS_SMOOTH_NORMALS) { // the light's distance from the position may be less
        Vector to_position = vector_add(shadow_ray->direction, surface->lift);
        real inverse = divide_or((real)(1 + 32 * UNIT_ROUNDOFF), vector_norm(to_position), NEVER);
        nearest = real_max(nearest, inverse);
    }
    real relative = lanes_select(in_range, errors->place * nearest, NEVER);
    errors->far_off = !(relative <= SHADOW_UNCERTAIN_MAX);
    errors->skips_culling =
        (relative > (real)(SHADOW_ERROR_MAX * UNIT_ROUNDOFF)) | (squared * squared < CULLED_DISTANCE_MIN);
    errors->angle = errors->angle + relative + relative;
    // the distance d is off by at most the part r of it, 2^-6 unless that is uncertain, and
    // 1 / (a + b d + c d^2) by less than 1 / (1 - r)^2 - 1 < 2.06 r
    if (HAS_FADING_LIGHTS) {
        errors->strength = real_fma((real)(2.06f), relative, (real)(32 * UNIT_ROUNDOFF));
        errors->brightest = (real)(1.04f) * errors->brightest * to_light->fading;
    }
}

// The cosine between the geometric normal and the way to a light.
typedef struct {
    real cosine, error;
} LightElevation;

// Returns the light's elevation, and sets to which side of the surface the shadow ray leaves.
static inline LightElevation light_set_side(const Surface *surface, LightRay *to_light, real angle_error)
{
    Ray *shadow_ray = &to_light->shadow_ray;
    LightElevation light;
    light.cosine = vector_dot(surface_normal(surface), to_light->direction);
    light.error = (HAS_TRIANGLES ? surface->geometric_error : surface->normal_error) + angle_error;
    if (HAS_SMOOTH_NORMALS) { // the shadow ray, not parallel to the light's direction, must leave the surface
        light.cosine =
            vector_dot(surface_normal(surface), shadow_ray->direction) * ray_inverse_length(shadow_ray);
        light.error = light.error + (real)(96 * UNIT_ROUNDOFF);
        shadow_ray->is_lifted = surface->lift_error > (real)(0);
        shadow_ray->sinks = shadow_ray->is_lifted & (light.cosine < -light.error);
    }
    shadow_ray->leaves_outward = surface->entering & (light.cosine > light.error);
    return light;
}

// Returns the largest channel of the diffuse light that the surface reflects, or 1 if that is more.
static inline real light_brightness(const Surface *surface, real brightest)
{
    Color3 diffuse = surface->diffuse;
    return real_max(brightest * real_max(real_max(diffuse.x, diffuse.y), diffuse.z), (real)(1));
}

// Removes the lanes that the surface itself hides from the light. Sets those where the light may or may not
// face the surface. Returns the lanes that certainly face away from the light.
static inline mask light_set_facing(const Surface *surface, LightRay *to_light, const LightErrors *errors,
                                    LightVisibility *visibility)
{
    const LightElevation light = light_set_side(surface, to_light, errors->angle);
    mask turned = (to_light->facing < -errors->facing) | !surface_found(surface);
    mask open = !turned & !(to_light->facing > errors->facing);
    mask faint = errors->facing * light_brightness(surface, errors->brightest) <= FACING_ERROR_MAX;
    visibility->facing_uncertain = open & faint;
    // a light in front of the shading normal but behind the surface is occluded by the surface itself
    mask behind = HAS_TRIANGLES ? !turned & (light.cosine < -light.error) : mask_none();
    // unless the ray is lifted beyond its rim
    if (HAS_SMOOTH_NORMALS) behind = behind & !to_light->shadow_ray.sinks;
    visibility->lit = visibility->lit & !behind;
    visibility->uncertain = open & !faint;
    if (HAS_TRIANGLES)
        visibility->uncertain =
            visibility->uncertain | (!turned & !open & (fabs(light.cosine) <= light.error));
    if (HAS_TRANSMISSION)
        visibility->uncertain = visibility->uncertain | (behind & (surface->transmission > (real)(0)));
    return turned;
}

// Adds the error of a spotlight's strength, and the lanes that may be on either side of its edge, except for
// those that are `turned` away.
static inline void light_add_spot_errors(const Light *light, const Surface *surface, const LightRay *to_light,
                                         mask turned, LightErrors *errors, LightVisibility *visibility)
{
    Vector difference = vector_subtract(vector_negate(to_light->direction), vector_of(light->direction));
    real s = (real)(0.5f) * vector_dot(difference, difference), edge = (real)(light->cone.x);
    real error = errors->angle + (real)(16 * UNIT_ROUNDOFF);
    real s_error = error * (vector_norm(difference) + error) + (real)(16 * UNIT_ROUNDOFF) * (s + edge);
    mask at_edge = !turned & (fabs(s - edge) <= s_error);
    real brightness = light_brightness(surface, errors->brightest);
    mask fades = s_error * (real)(light->cone.z) * brightness <= FACING_ERROR_MAX;
    if (light->cone.z == 0)
        fades = mask_none();
    else // the smooth step's slope is at most 1.5
        errors->strength = errors->strength + real_min((real)(1.5f * light->cone.z) * s_error, (real)(1));
    visibility->uncertain = visibility->uncertain | (at_edge & !fades);
    visibility->facing_uncertain = visibility->facing_uncertain | (at_edge & fades);
}

// Sets the shadow ray's bounds, and what is uncertain before it is traced. Returns the lanes whose errors are
// too large for cull spheres.
static inline mask light_set_errors(const Light *light, const Surface *surface, LightRay *to_light,
                                    LightVisibility *visibility)
{
    Ray *shadow_ray = &to_light->shadow_ray;
    LightErrors errors = light_errors(light, surface);
    if (light->type.x != LIGHT_TYPE_DIRECTIONAL) light_add_distance_errors(light, surface, to_light, &errors);
    errors.facing = surface->normal_error + errors.angle;
    shadow_ray->direction_error = (real)(2 * UNIT_ROUNDOFF);
    shadow_ray->origin_error = errors.place;
    shadow_ray->origin_object = surface->object;
    const mask turned = light_set_facing(surface, to_light, &errors, visibility);
    if (HAS_SPOT_LIGHTS && light->type.x == LIGHT_TYPE_SPOT)
        light_add_spot_errors(light, surface, to_light, turned, &errors, visibility);
    visibility->color_error = lanes_select(turned, (real)(0), light_color_error(surface, to_light, &errors));
    visibility->uncertain = visibility->uncertain | (visibility->lit & errors.far_off);
    shadow_ray->active = shadow_ray->active & !visibility->uncertain;
    return errors.skips_culling;
}

// Adds the lanes whose traced shadow ray leaves the light's visibility uncertain.
static inline void light_add_uncertainty(LightVisibility *visibility, const Hit *occlusion)
{
    visibility->uncertain = visibility->uncertain | (occlusion->uncertain & visibility->lit);
}

// Returns the factor by which the surface reflects a light, in the lanes that the light reaches.
static inline Color3 phong_reflect(const Surface *surface, const LightRay *to_light, mask lit)
{
    Color3 color = vector_scale(surface->diffuse, to_light->facing);
    mask glossy = lit & (surface->specular > (real)(0));
    if (!lanes_any(glossy)) return color;
    real highlight = surface->specular * phong_highlight(glossy, light_reflected(surface, to_light),
                                                         surface->to_eye, surface->shininess);
    if (HAS_TINTS) return vector_fma(surface->specular_tint, highlight, color);
    return (Color3){color.x + highlight, color.y + highlight, color.z + highlight};
}

// Returns the light that reaches the surface unless something occludes it. Sets the shadow ray, which is
// active in the lanes that may be lit.
static inline LightVisibility light_reach(const Scene *scene, const Surface *surface, uint index,
                                          Ray *shadow_ray)
{
    Light light = scene->lights[index];
    LightRay to_light = light_ray(scene, &light, index, surface);
    LightVisibility visibility;
    visibility.fraction = to_light.strength;
    visibility.lit = surface_found(surface) & (to_light.facing > (real)(0)) & (to_light.strength > (real)(0));
    to_light.shadow_ray.active = to_light.shadow_ray.active & visibility.lit;
    mask skips_culling = mask_none();
    if (IS_CERTIFIED) skips_culling = light_set_errors(&light, surface, &to_light, &visibility);
    visibility.reflected = phong_reflect(surface, &to_light, to_light.shadow_ray.active);
    if (HAS_SKY_LIGHT) visibility.reflected = color_multiply(visibility.reflected, to_light.tint);
    *shadow_ray = to_light.shadow_ray;
    bool has_area = HAS_AREA_LIGHTS && light.type.y != LIGHT_AREA_NONE;
    if (light.type.x != LIGHT_TYPE_DIRECTIONAL && !has_area)
        ray_set_common_origin(shadow_ray, COMMON_ORIGIN_FIRST_LIGHT + index, skips_culling);
    ray_counter_add(scene, RAYS_SHADOW, shadow_ray->active);
    return visibility;
}

static inline void light_occlude(LightVisibility *visibility, real passing)
{
    if (IS_CERTIFIED)
        visibility->color_error = visibility->color_error * lanes_select(visibility->lit, passing, (real)(1));
    visibility->lit = visibility->lit & (passing > (real)(0));
    visibility->fraction = visibility->fraction * passing;
}

static inline LightVisibility light_visibility(const Scene *scene, const Surface *surface, uint index)
{
    Ray shadow_ray;
    LightVisibility visibility = light_reach(scene, surface, index, &shadow_ray);
    if (IS_CERTIFIED) {
        Traversal traversal;
        ray_traverse(&traversal, scene, &shadow_ray, OCCLUSION);
        light_add_uncertainty(&visibility, &traversal.hit);
        light_occlude(&visibility, traversal_transmittance(&traversal));
        return visibility;
    }
    if (lanes_any(visibility.lit)) light_occlude(&visibility, transmittance(scene, &shadow_ray));
    return visibility;
}

#endif
