// Computes rays from surfaces to lights, and the light that arrives along them unless it is occluded.
#ifndef LIGHT_H
#define LIGHT_H

#include "shading/sky.h"
#include "shading/visible_surface.h"

typedef struct {
    Vector direction; // from the surface to the light, unit
    real facing;      // the cosine between the shading normal and `direction`
    real strength;    // the fraction of the light's color that arrives unless it is occluded
    real fading;      // with HAS_FADING_LIGHTS, the fraction by distance alone
    Color3 tint;      // with HAS_SKY_LIGHT, factors of the light's color
    Ray shadow_ray;   // ends at the light
} LightRay;

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

static inline bool light_is_directional(const FlatLight *light)
{
    return light->type.x == LIGHT_TYPE_DIRECTIONAL;
}

static inline bool light_has_area(const FlatLight *light)
{
    return HAS_AREA_LIGHTS && light->type.y != LIGHT_AREA_NONE;
}

// Returns 1 minus the cosine of the angle between two unit vectors, as |a - b|^2 / 2. For small angles the
// cosine itself has no bits left.
static inline real cosine_complement(Vector a, Vector b)
{
    Vector difference = vector_subtract(a, b);
    return 0.5f * vector_dot(difference, difference);
}

// Returns 1 in a spotlight's full cone, 0 outside it, and a smooth value between.
static inline real spot_strength(const FlatLight *light, Vector from_light)
{
    real s = cosine_complement(from_light, vector_of(light->direction));
    real x = ((real)(light->cone.x) - s) * (real)(light->cone.z);
    x = real_clamp(x, (real)(0), (real)(1));
    real soft = x * x * real_fma((real)(-2), x, (real)(3));
    real hard = lanes_select(s <= (real)(light->cone.x), (real)(1), (real)(0));
    return light->cone.z == 0 ? hard : soft;
}

// Returns the factor, above 0, by which a light fades over the length of `to_light`.
static inline real light_fading(const FlatLight *light, Vector to_light)
{
    real light_distance = real_sqrt(vector_dot(to_light, to_light));
    real divisor = real_fma((real)(light->fading.z), light_distance, (real)(light->fading.y));
    divisor = real_max(real_fma(divisor, light_distance, (real)(light->fading.x)), (real)(SMALLEST_RATIO));
    return real_max(real_divide((real)(1), divisor), (real)(SMALLEST_RATIO));
}

// Returns the vector from the center of a light's area to the surface's sample of it. A sphere is seen as a
// disc, whose points are lifted to the sphere.
static inline Vector light_area_offset(const FlatLight *light, uint index, const Surface *surface)
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
static inline Vector sky_sample(const Scene *scene, const FlatLight *light, uint index,
                                const Surface *surface, Color3 *tint)
{
    global const SceneHeader *header = scene->header;
    Sample sample = surface->sample;
    if (sample.index == SAMPLE_CENTER) sample.index = 0;
    SquarePoint point = sample_point(&sample, SAMPLED_LIGHTS + index);
    const real one = (real)(1);
    real columns = (point.x + one) * (SKY_CELL_COLUMNS / 2), rows = (point.y + one) * (SKY_CELL_ROWS / 2);
    RealLanes column = {floor(columns)}, row = {floor(rows)};
    RealLanes longitude, longitudes, sine, sines;
    for (uint lane = 0; lane < LANES; lane++) {
        scalar4 cell =
            scene->sky_cells[(uint)row.each[lane] * SKY_CELL_COLUMNS + (uint)column.each[lane]].range;
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
    *tint = vector_scale(*tint, longitudes.all * sines.all * (real)(light->across_u.w));
    // rounding may give the color of a brighter texel next to the cell
    *tint = (Color3){real_min(tint->x, one), real_min(tint->y, one), real_min(tint->z, one)};
    Vector level =
        vector_of_turns(vector_of(header->sky_forward), vector_of(header->sky_right), longitude.all);
    return vector_fma(vector_of(header->sky_up), sine.all, vector_scale(level, across));
}

// Returns a ray of full strength along a unit direction. Its shadow ray remains to be set.
static inline LightRay light_ray_along(const Surface *surface, Vector direction)
{
    LightRay to_light;
    to_light.direction = direction;
    to_light.facing = vector_dot(surface->shading_normal, direction);
    to_light.strength = to_light.fading = (real)(1);
    if (HAS_SKY_LIGHT) to_light.tint = color_gray((real)(1));
    return to_light;
}

static inline LightRay directional_light_ray(const Scene *scene, const FlatLight *light, uint index,
                                             const Surface *surface)
{
    Vector direction = vector_negate(vector_of(light->direction));
    Color3 tint = color_gray((real)(1));
    if (HAS_SKY_LIGHT && light->type.y == LIGHT_AREA_SKY)
        direction = sky_sample(scene, light, index, surface, &tint);
    else if (light_has_area(light))
        direction = vector_normalize(vector_add(direction, light_area_offset(light, index, surface)));
    LightRay to_light = light_ray_along(surface, direction);
    if (HAS_SKY_LIGHT) to_light.tint = tint;
    to_light.shadow_ray =
        ray_make(shadow_ray_origin(surface), direction, (real)(0), (real)(LARGEST), surface_found(surface));
    return to_light;
}

// Returns the ray to a point or spot light. Its shadow ray is not normalized, so that the light is at t = 1.
// It ends 32 u before that, so that a surface on which the light lies does not occlude it.
static inline LightRay positional_light_ray(const FlatLight *light, uint index, const Surface *surface)
{
    Vector position = vector_of(light->position), start = shadow_ray_origin(surface);
    if (light_has_area(light)) position = vector_add(position, light_area_offset(light, index, surface));
    Vector to_position = vector_subtract(position, surface->position);
    LightRay to_light = light_ray_along(surface, vector_normalize(to_position));
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

static inline LightRay light_ray(const Scene *scene, const FlatLight *light, uint index,
                                 const Surface *surface)
{
    bool has_positional_lights = HAS_POINT_LIGHTS || HAS_SPOT_LIGHTS;
    if (HAS_DIRECTIONAL_LIGHTS && (!has_positional_lights || light_is_directional(light)))
        return directional_light_ray(scene, light, index, surface);
    return positional_light_ray(light, index, surface);
}

#endif
