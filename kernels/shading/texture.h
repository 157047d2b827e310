// Pictures on surfaces: which place of the picture a point shows, and the color there, filtered over what the
// ray sees (trilinear: Williams, Pyramidal parametrics, SIGGRAPH 1983).
#ifndef TEXTURE_H
#define TEXTURE_H

#include "numerics/angle.h"
#include "scene.h"

// u runs along the picture's rows, v from its bottom to its top, 0 to 1; elsewhere it repeats.
typedef struct {
    real u, v;
    real density; // texels of the full picture per unit of length
} PicturePoint;

// Poles lie along y; the picture's middle looks to +z, and seen from outside u grows to the east. A picture
// meant for a globe changes little along its rows near the poles, so that the texels' height and their width
// at the equator tell how dense they are.
static inline PicturePoint sphere_picture_point(const Sphere *sphere, Vector outward, uint4 level)
{
    real equator = real_sqrt(real_fma(outward.x, outward.x, outward.z * outward.z));
    const real one_half = (real)(0.5f), two = (real)(2), inverse_pi = (real)(0x1.45f306p-2f);
    PicturePoint point;
    point.u = one_half + real_turns(outward.z, outward.x);
    point.v = real_fma(two, real_turns(equator, outward.y), one_half);
    real texels = inverse_pi * real_max((real)((scalar)level.y) * one_half, (real)((scalar)level.z));
    point.density = real_divide(texels, fabs((real)(sphere->center_radius.w)));
    return point;
}

// Planes and discs have a grid of their own, along the surface.
static inline bool kind_has_grid(uint kind)
{
    if (HAS_PLANES && kind == KIND_PLANES) return true;
    return HAS_DISCS && kind == KIND_DISCS;
}

typedef struct {
    real u, v; // counted in checker squares, or in pictures
} GridPlace;

// Where in its grid a point of a plane or disc lies.
static inline GridPlace grid_place(const Scene *scene, uint kind, uint index, Vector position)
{
    scalar4 grid_u = (scalar4)(0), grid_v = (scalar4)(0);
    if (HAS_PLANES && kind == KIND_PLANES) {
        grid_u = scene->planes[index].grid_u;
        grid_v = scene->planes[index].grid_v;
    } else if (HAS_DISCS && kind == KIND_DISCS) {
        grid_u = scene->discs[index].grid_u;
        grid_v = scene->discs[index].grid_v;
    }
    return (GridPlace){vector_dot(position, vector_of(grid_u)) + (real)(grid_u.w),
                       vector_dot(position, vector_of(grid_v)) + (real)(grid_v.w)};
}

static inline PicturePoint picture_point(const Scene *scene, uint kind, uint index, const Material *material,
                                         const Patch *patch)
{
    if (HAS_SPHERES && kind == KIND_SPHERES) {
        Sphere sphere = scene->spheres[index];
        return sphere_picture_point(&sphere, patch->normal,
                                    scene->texture_levels[material->image.x - 1].place);
    }
    GridPlace place = grid_place(scene, kind, index, patch->position);
    return (PicturePoint){place.u, place.v, (real)(material->reflection_transmission_ior.w)};
}

// From here on one lane at a time: each reads texels of its own.

// The part after the point; 0 where that is no number.
static inline scalar repeated(scalar a)
{
    scalar part = a - floor(a);
    return part >= 0 && part <= 1 ? part : 0;
}

// A texel's number from -1 to count, one past each end, where the picture repeats.
static inline uint texel_repeated(scalar i, uint count)
{
    return i < 0 ? count - 1 : i >= (scalar)count ? 0 : (uint)i;
}

static inline uint texel_held(scalar i, uint count)
{
    return i < 0 ? 0 : i >= (scalar)count ? count - 1 : (uint)i;
}

static inline scalar4 texel_color(const Scene *scene, uint index)
{
    return JOIN(JOIN(convert_, REAL_BASE), 4)(as_float4(scene->texels[index].color));
}

static inline scalar4 scalar4_between(scalar4 a, scalar4 b, scalar part)
{
    return fma(b - a, (scalar4)(part), a);
}

// Texels stand for their centers; between centers colors change linearly. `level`: x its first texel, y
// width, z height.
static inline scalar4 level_color(const Scene *scene, uint4 level, scalar u, scalar v, bool repeats_upward)
{
    scalar x = fma(u, (scalar)level.y, (scalar)(-0.5f)), y = fma(1 - v, (scalar)level.z, (scalar)(-0.5f));
    scalar left = floor(x), top = floor(y);
    uint column_0 = texel_repeated(left, level.y), column_1 = texel_repeated(left + 1, level.y);
    uint row_0 = repeats_upward ? texel_repeated(top, level.z) : texel_held(top, level.z);
    uint row_1 = repeats_upward ? texel_repeated(top + 1, level.z) : texel_held(top + 1, level.z);
    uint start_0 = level.x + row_0 * level.y, start_1 = level.x + row_1 * level.y;
    scalar4 above = scalar4_between(texel_color(scene, start_0 + column_0),
                                    texel_color(scene, start_0 + column_1), x - left);
    scalar4 below = scalar4_between(texel_color(scene, start_1 + column_0),
                                    texel_color(scene, start_1 + column_1), x - left);
    return scalar4_between(above, below, y - top);
}

// `footprint`: how many texels of the full picture the ray sees across. Between the levels for 2^n and 2^(n +
// 1) texels colors change linearly with it.
static inline scalar4 picture_filtered(const Scene *scene, uint4 image, scalar u, scalar v, scalar footprint,
                                       bool repeats_upward)
{
    uint level = image.x - 1, last = level + image.y - 1;
    scalar part = 0;
    if (footprint > 1) {
        int exponent;
        part = 2 * frexp(min(footprint, (scalar)0x1p30f), &exponent) - 1;
        level += (uint)(exponent - 1);
    }
    if (level >= last) return level_color(scene, scene->texture_levels[last].place, u, v, repeats_upward);
    scalar4 color = level_color(scene, scene->texture_levels[level].place, u, v, repeats_upward);
    if (part == 0) return color;
    scalar4 coarser = level_color(scene, scene->texture_levels[level + 1].place, u, v, repeats_upward);
    return scalar4_between(color, coarser, part);
}

// The picture's color where the lanes in `wanted` meet a surface, `travelled` along from the eye. What is
// seen at a slant counts as at most 2^10 times longer.
static inline Vector picture_color(const Scene *scene, uint kind, const Material *material,
                                   PicturePoint point, const Patch *patch, const Ray *ray, real travelled,
                                   mask wanted)
{
    real cosine = real_max(fabs(vector_dot(patch->normal, ray->direction)), (real)(0x1p-10f));
    real width = travelled * (real)(scene->header->sample.x);
    RealLanes u = {point.u}, v = {point.v}, footprint = {real_divide(width * point.density, cosine)};
    RealLanes red = {(real)(0)}, green = {(real)(0)}, blue = {(real)(0)};
    IntegerLanes lanes = {wanted};
    for (uint lane = 0; lane < LANES; lane++) {
        if (lanes.each[lane] == 0) continue;
        bool is_sphere = kind == KIND_SPHERES;
        scalar up = is_sphere ? v.each[lane] : repeated(v.each[lane]);
        scalar4 color = picture_filtered(scene, material->image, repeated(u.each[lane]), up,
                                         footprint.each[lane], !is_sphere);
        red.each[lane] = color.x;
        green.each[lane] = color.y;
        blue.each[lane] = color.z;
    }
    return (Vector){red.all, green.all, blue.all};
}

#endif
