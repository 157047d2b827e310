// Computes a surface point's texture coordinates and the texture's color there, filtered over the footprint
// of the pixel (trilinear: Williams, Pyramidal parametrics, SIGGRAPH 1983).
#ifndef TEXTURE_H
#define TEXTURE_H

#include "numerics/angle.h"
#include "scene.h"
#include "shading/color.h"
#include "shapes/surface_point.h"

// u runs along the texture's rows and v from bottom to top, from 0 to 1. Beyond that the texture wraps.
typedef struct {
    real u, v;
    real density; // texels of the full texture per unit of length
} TextureCoordinates;

typedef struct {
    real u, v; // in texture repeats or checker squares
} GridCoordinates;

// Returns a direction's coordinates in an image that covers all directions. The poles lie on the y axis, and
// the image's center on the z axis.
static inline GridCoordinates globe_coordinates(Vector direction)
{
    const real one_half = (real)(0.5f), x = direction.x, y = direction.y, z = direction.z,
               across = real_sqrt(real_fma(x, x, z * z));
    return (GridCoordinates){one_half + real_turns(z, x),
                             real_fma((real)(2), real_turns(across, y), one_half)};
}

// Returns the texels per radian of this level of such an image, along the equator or a meridian, whichever
// are denser, because images of globes vary little along rows near the poles.
static inline scalar globe_density(uint4 level)
{
    return max((scalar)level.y * (scalar)0.5f, (scalar)level.z) * (scalar)0x1.45f306p-2f;
}

// Returns a sphere's texture coordinates. Seen from outside, u grows eastward.
static inline TextureCoordinates sphere_texture_coordinates(const Sphere *sphere, Vector outward, uint4 level)
{
    const GridCoordinates at = globe_coordinates(outward);
    const real radius = fabs((real)(sphere->center_radius.w));
    return (TextureCoordinates){at.u, at.v, real_divide((real)(globe_density(level)), radius)};
}

// Returns whether shapes of this type have a grid in the surface, as planes and discs do. This is not one
// expression, because clang would warn about its constant operands.
static inline bool type_has_grid(uint type)
{
    if (HAS_PLANES && type == TYPE_PLANES) return true;
    return HAS_DISCS && type == TYPE_DISCS;
}

// The axes of a surface's grid; w is the grid's offset.
typedef struct {
    scalar4 u, v;
} GridAxes;

// Returns the axes of the grid, all 0 for other types, which have no grid.
static inline GridAxes grid_axes(const Scene *scene, uint type, uint index)
{
    if (HAS_PLANES && type == TYPE_PLANES)
        return (GridAxes){scene->planes[index].grid_u, scene->planes[index].grid_v};
    if (HAS_DISCS && type == TYPE_DISCS)
        return (GridAxes){scene->discs[index].grid_u, scene->discs[index].grid_v};
    return (GridAxes){(scalar4)(0), (scalar4)(0)};
}

// Returns the grid coordinates of a point of a plane or disc, (0, 0) for other types.
static inline GridCoordinates grid_coordinates(const Scene *scene, uint type, uint index, Vector position)
{
    GridAxes axes = grid_axes(scene, type, index);
    return (GridCoordinates){vector_dot(position, vector_of(axes.u)) + (real)(axes.u.w),
                             vector_dot(position, vector_of(axes.v)) + (real)(axes.v.w)};
}

// Bounds the error of grid coordinates, for a position that is off by `position_error`.
static inline real grid_error(const Scene *scene, uint type, uint index, Vector position, real position_error)
{
    const GridAxes axes = grid_axes(scene, type, index);
    const Vector u = vector_of(axes.u), v = vector_of(axes.v);
    const real moved = real_max(vector_norm1(u), vector_norm1(v)),
               size = real_max(vector_norm1_along(u, position) + (real)(fabs(axes.u.w)),
                               vector_norm1_along(v, position) + (real)(fabs(axes.v.w)));
    return real_fma(moved, position_error, 8 * UNIT_ROUNDOFF * size);
}

static inline TextureCoordinates texture_coordinates(const Scene *scene, uint type, uint index,
                                                     const FlatMaterial *material, const SurfacePoint *point)
{
    if (HAS_SPHERES && type == TYPE_SPHERES) {
        Sphere sphere = scene->spheres[index];
        uint first_level = material->texture.x;
        if (HAS_NORMAL_MAPS && first_level == 0) first_level = material->normal_map.x;
        return sphere_texture_coordinates(&sphere, point->normal,
                                          scene->texture_levels[first_level - 1].range);
    }
    GridCoordinates grid = grid_coordinates(scene, type, index, point->position);
    return (TextureCoordinates){grid.u, grid.v, (real)(material->reflection_transmission_ior.w)};
}

// The functions up to image_filtered treat one lane at a time, since each lane reads different texels.

// Returns the texture coordinate wrapped to 0..1, or 0 if it is NaN.
static inline scalar wrap_unit(scalar a, uint wrap)
{
    scalar part = a - floor(a);
    if (wrap == WRAP_MIRRORED) part = fabs(a - 2 * rint(a * (scalar)0.5f));
    if (wrap == WRAP_CLAMPED) part = clamp(a, (scalar)0, (scalar)1);
    return part >= 0 && part <= 1 ? part : 0;
}

// Returns the texel for an index from -1 to count, both of which lie beyond an edge.
static inline uint texel_wrapped(scalar i, uint count, uint wrap)
{
    bool is_repeated = wrap == WRAP_REPEATED;
    if (i < 0) return is_repeated ? count - 1 : 0;
    if (i >= (scalar)count) return is_repeated ? 0 : count - 1;
    return (uint)i;
}

static inline scalar4 texel_color(const Scene *scene, uint index)
{
    return JOIN(JOIN(convert_, REAL_BASE), 4)(as_float4(scene->texels[index].color));
}

static inline scalar4 scalar4_between(scalar4 a, scalar4 b, scalar part)
{
    return fma(b - a, (scalar4)(part), a);
}

// Returns an image, which wraps by z and w. One on a sphere or the sky does not wrap across the poles.
static inline uint4 image_wrapped(uint4 image, bool has_poles)
{
    if (has_poles) image.w = WRAP_CLAMPED;
    return image;
}

// Returns the color of an image's level, bilinear between texel centers. x of `level` is its first texel, y
// its width, z its height.
static inline scalar4 level_color(const Scene *scene, uint4 image, uint4 level, scalar u, scalar v)
{
    const uint wrap_u = image.z, wrap_v = image.w;
    scalar x = fma(u, (scalar)level.y, (scalar)(-0.5f)), y = fma(1 - v, (scalar)level.z, (scalar)(-0.5f));
    scalar left = floor(x), top = floor(y);
    uint column_0 = texel_wrapped(left, level.y, wrap_u), column_1 = texel_wrapped(left + 1, level.y, wrap_u);
    uint row_0 = texel_wrapped(top, level.z, wrap_v), row_1 = texel_wrapped(top + 1, level.z, wrap_v);
    uint start_0 = level.x + row_0 * level.y, start_1 = level.x + row_1 * level.y;
    scalar4 above = scalar4_between(texel_color(scene, start_0 + column_0),
                                    texel_color(scene, start_0 + column_1), x - left);
    scalar4 below = scalar4_between(texel_color(scene, start_1 + column_0),
                                    texel_color(scene, start_1 + column_1), x - left);
    return scalar4_between(above, below, y - top);
}

// Returns the color filtered over `footprint`, the pixel's width in texels of the full texture. Colors are
// linear in it between the levels for 2^n and 2^(n + 1) texels.
static inline scalar4 image_filtered(const Scene *scene, uint4 image, scalar u, scalar v, scalar footprint)
{
    uint level = image.x - 1, last = level + image.y - 1;
    scalar part = 0;
    if (footprint > 1) {
        int exponent;
        part = 2 * frexp(min(footprint, (scalar)0x1p30f), &exponent) - 1;
        level += (uint)(exponent - 1);
    }
    if (level >= last) return level_color(scene, image, scene->texture_levels[last].range, u, v);
    scalar4 color = level_color(scene, image, scene->texture_levels[level].range, u, v);
    if (part == 0) return color;
    scalar4 coarser = level_color(scene, image, scene->texture_levels[level + 1].range, u, v);
    return scalar4_between(color, coarser, part);
}

// Returns the filtered color of each lane in `wanted`, 0 in the others.
static inline Vector image_color(const Scene *scene, uint4 image, real along, real across, real width,
                                 mask wanted)
{
    RealLanes u = {along}, v = {across}, footprint = {width};
    VectorLanes colors = vector_lanes_zero();
    IntegerLanes lanes = {wanted};
    for (uint lane = 0; lane < LANES; lane++) {
        if (lanes.each[lane] == 0) continue;
        vector_lanes_set(&colors, lane,
                         image_filtered(scene, image, wrap_unit(u.each[lane], image.z),
                                        wrap_unit(v.each[lane], image.w), footprint.each[lane]));
    }
    return vector_of_lanes(&colors);
}

// The part of a surface that a pixel sees: its width across the ray, and the cosine of incidence, by which it
// is wider along the surface.
typedef struct {
    real width, cosine;
} Footprint;

// Returns the footprint of a ray of unit direction, at the distance `travelled` from the eye. At a grazing
// angle it grows by at most 2^10.
static inline Footprint ray_footprint(const Scene *scene, const Ray *ray, Vector normal, real travelled)
{
    Footprint footprint;
    footprint.cosine = real_max(fabs(vector_dot(normal, ray->direction)), (real)(0x1p-10f));
    footprint.width = travelled * (real)(scene->header->sample.x);
    if (HAS_ORTHOGRAPHIC && scene->header->sample.z > 0) footprint.width = (real)(scene->header->sample.z);
    return footprint;
}

// Returns the texture's color for the lanes in `wanted`.
static inline Vector texture_color(const Scene *scene, uint4 texture, TextureCoordinates coordinates,
                                   Footprint footprint, mask wanted)
{
    return image_color(scene, texture, coordinates.u, coordinates.v,
                       real_divide(footprint.width * coordinates.density, footprint.cosine), wanted);
}

#endif
