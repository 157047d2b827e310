// Computes the light that comes from the background: a color, a blend of colors or an image of all
// directions.
#ifndef SKY_H
#define SKY_H

#include "shading/texture.h"

// Returns the color of a sky without an image, for the sine of a latitude.
static inline Vector sky_blended_color(global const SceneHeader *header, real sine)
{
    const real zero = (real)(0);
    Vector color =
        vector_fma(vector_of(header->sky_above), real_max(sine, zero), vector_of(header->background));
    return vector_fma(vector_of(header->sky_below), real_max(-sine, zero), color);
}

// Returns the color of the texel of the sky's image in which a direction lies, for each lane in `wanted`.
static inline Vector sky_texel_color(const Scene *scene, real longitude_turns, real latitude_turns,
                                     mask wanted)
{
    uint4 level = scene->texture_levels[scene->header->sky_texture.x - 1].range;
    const real one_half = (real)(0.5f);
    RealLanes column = {(longitude_turns + one_half) * (real)((scalar)level.y)};
    RealLanes row = {(one_half - latitude_turns - latitude_turns) * (real)((scalar)level.z)};
    VectorLanes colors = vector_lanes_zero();
    IntegerLanes lanes = {wanted};
    for (uint lane = 0; lane < LANES; lane++) {
        if (lanes.each[lane] == 0) continue;
        uint x = min((uint)column.each[lane], level.y - 1), y = min((uint)row.each[lane], level.z - 1);
        vector_lanes_set(&colors, lane, texel_color(scene, level.x + y * level.y + x));
    }
    return vector_of_lanes(&colors);
}

// Returns the color of the sky's image along a unit direction, for the lanes in `wanted`.
static inline Vector sky_image_color(const Scene *scene, Vector direction, mask wanted)
{
    global const SceneHeader *header = scene->header;
    const scalar texels = globe_density(scene->texture_levels[header->sky_texture.x - 1].range);
    const GridCoordinates at = globe_coordinates((Vector){
        vector_dot(direction, vector_of(header->sky_right)), vector_dot(direction, vector_of(header->sky_up)),
        vector_dot(direction, vector_of(header->sky_forward))});
    Vector color = image_color(scene, image_wrapped(header->sky_texture, true), at.u, at.v,
                               (real)(header->sample.x * texels), wanted);
    return vector_scale(color, (real)(header->sky_forward.w));
}

// Returns the color of the background along a unit direction, for the lanes in `wanted`.
static inline Vector background_color(const Scene *scene, Vector direction, mask wanted)
{
    global const SceneHeader *header = scene->header;
    Vector color = vector_of(header->background);
    if (!HAS_SKY) return color;
    if (HAS_IMAGES && header->sky_texture.x > 0)
        return lanes_any(wanted) ? sky_image_color(scene, direction, wanted) : color;
    return sky_blended_color(header, vector_dot(direction, vector_of(header->sky_up)));
}

// Bounds the error of the sky's color in every channel, at `certified`.
static inline real sky_color_error(const Scene *scene, const Ray *ray)
{
    return (real)(scene->header->sky_up.w) * (ray->direction_error + DIRECTION_ROUNDING);
}

#endif
