// Implements cutouts. Rays pass through a surface where the alpha of its image is low.
//
// The alpha is that of the full texture, whatever the ray's footprint is, so that camera rays, bounces and
// shadow rays see the same surface. Hits are cut away before they are recorded. So no ray starts behind a
// hole, and a surface right behind it is not missed.
#ifndef CUTOUT_H
#define CUTOUT_H

#include "shading/texture.h"
#include "shapes/disc.h"
#include "shapes/plane.h"
#include "shapes/sphere.h"
#include "shapes/triangle.h"
#include "traversal/query.h"

// Returns the texture coordinates of a hit, without their density. `entry` is the object's
// type_index_material. Shading computes the same coordinates.
static inline TextureCoordinates cutout_coordinates(const Scene *scene, uint4 entry, const Ray *ray, real t)
{
    TextureCoordinates coordinates = {(real)(0), (real)(0), (real)(0)};
    Vector position = {(real)(0), (real)(0), (real)(0)};
    if (HAS_TRIANGLES && entry.x == TYPE_TRIANGLES) {
        const Triangle triangle = scene->triangles[entry.y];
        if (triangle.id.z == 0) return coordinates;
        const Corners corners = corners_of(triangle.a, triangle.b, triangle.c),
                      uvs = corners_of_uvs(scene->triangle_uvs[triangle.id.z - 1]);
        Vector uv = triangle_blend(triangle_weights(corners, ray), uvs);
        coordinates.u = uv.x;
        coordinates.v = uv.y;
        return coordinates;
    }
    if (HAS_SPHERES && entry.x == TYPE_SPHERES) {
        const Sphere sphere = scene->spheres[entry.y];
        return sphere_texture_coordinates(&sphere, sphere_normal(&sphere, ray, t), (uint4)(0));
    }
    if (HAS_PLANES && entry.x == TYPE_PLANES) {
        const Plane plane = scene->planes[entry.y];
        position = plane_surface_point(&plane, ray, t).position;
    }
    if (HAS_DISCS && entry.x == TYPE_DISCS) {
        const Disc disc = scene->discs[entry.y];
        position = disc_surface_point(&disc, ray, t).position;
    }
    const GridCoordinates grid = grid_coordinates(scene, entry.x, entry.y, position);
    coordinates.u = grid.u;
    coordinates.v = grid.v;
    return coordinates;
}

// Returns the lanes in `wanted` where the alpha is too low for a hit.
static inline mask alpha_is_low(const Scene *scene, uint4 cutout, TextureCoordinates coordinates, mask wanted)
{
    const uint4 level = scene->texture_levels[cutout.x - 1].range;
    RealLanes u = {coordinates.u}, v = {coordinates.v};
    IntegerLanes lanes = {wanted}, low = {(integer)(0)};
    for (uint lane = 0; lane < LANES; lane++) {
        if (lanes.each[lane] == 0) continue;
        scalar4 texel = level_color(scene, cutout, level, wrap_unit(u.each[lane], cutout.z),
                                    wrap_unit(v.each[lane], cutout.w));
        low.each[lane] = texel.w < (scalar)as_float(cutout.y);
    }
    return low.all != (integer)(0);
}

// Returns the lanes in `wanted` that pass through a hole at t.
static OUT_OF_LINE mask object_hole_lanes(const Traversal *traversal, const Scene *scene, const Ray *ray,
                                          uint id, mask wanted, real t)
{
    const uint4 entry = object_entry(traversal, scene, id);
    const uint4 cutout = scene->materials[entry.z].cutout;
    if (cutout.x == 0) return mask_none();
    return alpha_is_low(scene, image_wrapped(cutout, entry.x == TYPE_SPHERES),
                        cutout_coordinates(scene, entry, ray, t), wanted);
}

// Removes from `found` the crossings that would not be recorded and those in holes. Returns the lanes whose
// crossing is in a hole.
static inline mask traversal_cut(const Traversal *traversal, const Scene *scene, const Ray *ray, uint id,
                                 mask *found, real t)
{
    const Hit *hit = &traversal->hit;
    *found = *found & (traversal->query == OCCLUSION ? traversal->active & (t < hit->t) : t <= hit->t);
    if (!lanes_any(*found)) return mask_none();
    const mask cut = object_hole_lanes(traversal, scene, ray, id, *found, t);
    *found = *found & !cut;
    return cut;
}

#endif
