// Applies normal maps. A texture's colors from 0 to 1 are the shading normal's components from -1 to 1 along
// u, along v and outward (Peercy, Airey, Cabral, Efficient bump mapping hardware, SIGGRAPH 1997).
#ifndef NORMAL_MAP_H
#define NORMAL_MAP_H

#include "shading/texture.h"
#include "shapes/triangle.h"

// The directions, of any length, in which a surface's texture coordinates grow, or 0 if they do not.
typedef struct {
    Vector u, v;
} Tangents;

// Returns the tangents of triangles, from the corners and their texture coordinates.
static inline Tangents triangle_tangents(Corners corners, Corners uvs)
{
    Vector ab = vector_subtract(corners.b, corners.a), ac = vector_subtract(corners.c, corners.a);
    Vector uv_ab = vector_subtract(uvs.b, uvs.a), uv_ac = vector_subtract(uvs.c, uvs.a);
    real area = difference_of_products(uv_ab.x, uv_ac.y, uv_ab.y, uv_ac.x);
    real side = lanes_select(area < 0, (real)(-1), (real)(1));
    side = lanes_select(area == 0, (real)(0), side);
    Tangents tangents;
    tangents.u = vector_fma(ab, side * uv_ac.y, vector_scale(ac, -side * uv_ab.y));
    tangents.v = vector_fma(ac, side * uv_ab.x, vector_scale(ab, -side * uv_ac.x));
    return tangents;
}

// Returns the tangents of other shapes, 0 for those without texture coordinates.
static inline Tangents shape_tangents(const Scene *scene, uint type, uint index, Vector outward)
{
    if (HAS_SPHERES && type == TYPE_SPHERES) {
        Vector east = {outward.z, (real)(0), -outward.x};
        return (Tangents){east, vector_cross(outward, east)};
    }
    GridAxes axes = grid_axes(scene, type, index);
    return (Tangents){vector_of(axes.u), vector_of(axes.v)};
}

// Where a material's images are looked up for a surface point.
typedef struct {
    TextureCoordinates coordinates;
    Tangents tangents; // with HAS_NORMAL_MAPS
    Footprint footprint;
} ImageLookup;

// Returns the unit shading normal tilted by the material's normal map, for the lanes in `wanted`. A map that
// is mirrored on the surface has its v on the other side of the normal and u.
static inline Vector normal_tilted(const Scene *scene, const FlatMaterial *material, uint type,
                                   const ImageLookup *lookup, Vector normal, mask wanted)
{
    const TextureCoordinates coordinates = lookup->coordinates;
    const Tangents tangents = lookup->tangents;
    const scalar4 row_u = material->normal_u, row_v = material->normal_v;
    const real zero = (real)(0), one = (real)(1), two = (real)(2), strength = (real)(row_u.w);
    const scalar side = row_u.x * row_v.y < row_u.y * row_v.x ? -1 : 1;
    TextureCoordinates mapped;
    mapped.u =
        real_fma((real)(row_u.x), coordinates.u, real_fma((real)(row_u.y), coordinates.v, (real)(row_u.z)));
    mapped.v =
        real_fma((real)(row_v.x), coordinates.u, real_fma((real)(row_v.y), coordinates.v, (real)(row_v.z)));
    mapped.density = coordinates.density * (real)(row_v.w);
    Vector along_u =
        vector_fma(tangents.u, (real)(side * row_v.y), vector_scale(tangents.v, (real)(-side * row_v.x)));
    Vector along_v =
        vector_fma(tangents.v, (real)(side * row_u.x), vector_scale(tangents.u, (real)(-side * row_u.y)));
    Vector texel = texture_color(scene, image_wrapped(material->normal_map, type == TYPE_SPHERES), mapped,
                                 lookup->footprint, wanted);
    real x = strength * real_fma(two, texel.x, -one), y = strength * real_fma(two, texel.y, -one),
         z = real_fma(two, texel.z, -one);
    Vector across = vector_fma(normal, -vector_dot(normal, along_u), along_u);
    mask tilts = (vector_dot(across, across) > zero) & ((x != zero) | (y != zero));
    across = vector_normalize(across);
    Vector up = vector_cross(normal, across);
    y = lanes_select(vector_dot(up, along_v) < zero, -y, y);
    Vector tilted = vector_fma(across, x, vector_fma(up, y, vector_scale(normal, z)));
    return vector_select(tilts, vector_normalize(tilted), normal);
}

#endif
