// The surface at a hit, as shading needs it: position, normals, material.
#ifndef SURFACE_H
#define SURFACE_H

#include "shading/texture.h"
#include "traversal/traversal.h"

typedef Vector Color3;

static inline Color3 color_multiply(Color3 a, Color3 b)
{
    return (Color3){a.x * b.x, a.y * b.y, a.z * b.z};
}

static inline Color3 color_add_weighted(Color3 sum, Color3 weight, Color3 color)
{
    return (Color3){real_fma(weight.x, color.x, sum.x), real_fma(weight.y, color.y, sum.y),
                    real_fma(weight.z, color.z, sum.z)};
}

// Color and `travelled` presume that the ray's direction is unit; of an explicit ray, which may have any
// length, neither is used.
typedef struct {
    mask found;
    Vector position;
    Vector normal;         // geometric, unit, facing the ray
    Vector shading_normal; // unit, on the same side
    Vector to_eye;         // unit, back along the ray
    real error;            // bound on the position's distance from the true surface
    real refracted_offset; // how far behind the surface a refracted ray starts
    Color3 color, diffuse;
    real ambient, specular, shininess;
    real reflection, transmission, ior;
    mask entering;  // the ray runs into the solid, against its outward normal
    real travelled; // distance from the eye along the path
} Surface;

static inline SurfacePoint shape_surface_point(const Scene *scene, uint kind, uint index, const Ray *ray,
                                               real t)
{
#define SHAPE_SURFACE_POINT(feature, Type, name, names)                                                      \
    if (HAS_##feature && kind == KIND_##feature) {                                                           \
        Type shape = scene->names[index];                                                                    \
        return name##_surface_point(&shape, ray, t);                                                         \
    }
    SHAPE_LIST(SHAPE_SURFACE_POINT)
    return surface_point_make(ray->origin, ray->direction, (real)(0));
}

// The surface points of the lanes that hit the same object, or triangles of the same material.
typedef struct {
    mask lanes;
    SurfacePoint point;
    TextureCoordinates coordinates; // of triangles only
} LaneSurfacePoints;

// Marks lanes that are done: larger than any id.
#define NO_OBJECT ((integer)(INT_MAX))

// The triangles of one material among the objects hit. In a fine mesh each lane hits one of its own: vertices
// are gathered triangle by triangle, then evaluated for all lanes at once.
static OUT_OF_LINE LaneSurfacePoints triangles_surface_point(const Scene *scene, integer objects,
                                                             uint material, const Ray *ray, real t)
{
    const Vector zero = {(real)(0), (real)(0), (real)(0)};
    LaneSurfacePoints hit;
    hit.lanes = mask_none();
    Vector normal = zero;
    Corners corners = {zero, zero, zero}, normals = corners, uvs = corners;
    real density = (real)(scene->materials[material].reflection_transmission_ior.w);
    mask next_to_eye = mask_none();
    bool smooth = false;
    for (;;) {
        scalar_integer object = lanes_smallest(objects);
        if (object == INT_MAX) break;
        mask same = objects == (integer)(object);
        objects = lanes_select(same, NO_OBJECT, objects);
        uint4 entry = scene->objects[object].kind_index_material;
        if (entry.x != KIND_TRIANGLES || entry.z != material) continue;
        hit.lanes = hit.lanes | same;
        Triangle triangle = scene->triangles[entry.y];
        if (has_eye_height(triangle.id)) next_to_eye = next_to_eye | same;
        corners = corners_select(same, corners_of(triangle.a, triangle.b, triangle.c), corners);
        normal = vector_select(same, triangle_normal(&triangle), normal);
        if (triangle.id.y > 0) {
            smooth = true;
            TriangleNormals own = scene->triangle_normals[triangle.id.y - 1];
            normals = corners_select(same, corners_of(own.a, own.b, own.c), normals);
        }
        if (HAS_IMAGES && triangle.id.z > 0) {
            TriangleUvs own = scene->triangle_uvs[triangle.id.z - 1];
            uvs = corners_select(same, corners_of(own.a_b, (scalar4)(own.a_b.zw, 0, 0), own.c_density), uvs);
            density = lanes_select(same, (real)(own.c_density.z), density);
        }
    }
    TriangleWeights weights = triangle_weights(corners, ray);
    hit.point = corners_surface_point(corners, normal, weights, next_to_eye, ray, t);
    if (smooth) triangle_smooth(normals, weights, &hit.point);
    if (HAS_IMAGES) {
        Vector uv = triangle_blend(weights, uvs);
        hit.coordinates = (TextureCoordinates){uv.x, uv.y, density};
    }
    return hit;
}

// Where the checker has its second color. On planes and discs squares lie in the surface; elsewhere they are
// cubes in space, looked up a 1024th of a cube behind the surface, so that a face on the border between cubes
// has one color.
static inline mask checker_odd(const Scene *scene, uint kind, uint index, const SurfacePoint *point,
                               const Ray *ray, scalar4 grid)
{
    real cells;
    if (kind_has_grid(kind)) {
        GridCoordinates square = grid_coordinates(scene, kind, index, point->position);
        cells = floor(square.u) + floor(square.v);
    } else {
        mask along = vector_dot(point->normal, ray->direction) > (real)(0);
        Vector inward = vector_select(along, point->normal, vector_negate(point->normal));
        Vector cell = vector_fma(point->position, (real)(grid.w), vector_of(grid));
        cell = vector_fma(inward, (real)(0x1p-10f), cell);
        cells = floor(cell.x) + floor(cell.y) + floor(cell.z);
    }
    real halved = cells * (real)(0.5f);
    return floor(halved) != halved;
}

// The object's color at the hit: plain, checkered or textured. `entry` is the object's kind_index_material.
static inline Color3 object_color(const Scene *scene, uint4 entry, const Material *material,
                                  const LaneSurfacePoints *hit, const Ray *ray, real travelled)
{
    Color3 color = vector_of(material->color);
    if (HAS_CHECKERS && material->grid.w != 0) {
        mask odd = checker_odd(scene, entry.x, entry.y, &hit->point, ray, material->grid);
        color = vector_select(odd, vector_of(material->other_color), color);
    }
    if (HAS_IMAGES && material->texture.x > 0) {
        TextureCoordinates coordinates =
            entry.x == KIND_TRIANGLES ? hit->coordinates
                                      : texture_coordinates(scene, entry.x, entry.y, material, &hit->point);
        color = texture_color(scene, entry.x, material, coordinates, &hit->point, ray, travelled, hit->lanes);
    }
    return color;
}

static inline void surface_set_material(Surface *surface, mask lanes, const Material *material, Color3 color)
{
    scalar4 bounces = material->reflection_transmission_ior;
    surface->color = vector_select(lanes, color, surface->color);
    surface->diffuse = vector_select(lanes, vector_of(material->diffuse), surface->diffuse);
    surface->ambient = lanes_select(lanes, (real)(material->color.w), surface->ambient);
    surface->specular = lanes_select(lanes, (real)(material->diffuse.w), surface->specular);
    surface->shininess = lanes_select(lanes, (real)(material->other_color.w), surface->shininess);
    surface->reflection = lanes_select(lanes, (real)(bounces.x), surface->reflection);
    surface->transmission = lanes_select(lanes, (real)(bounces.y), surface->transmission);
    surface->ior = lanes_select(lanes, (real)(bounces.z), surface->ior);
}

// Turns both normals to the side that the ray comes from.
static inline void surface_set_point(Surface *surface, const SurfacePoint *point, const Ray *ray)
{
    surface->position = point->position;
    mask along = vector_dot(point->normal, ray->direction) > (real)(0);
    surface->entering = !along;
    surface->normal = vector_select(along, vector_negate(point->normal), point->normal);
    mask opposite = vector_dot(point->shading_normal, surface->normal) < (real)(0);
    surface->shading_normal =
        vector_select(opposite, vector_negate(point->shading_normal), point->shading_normal);
    surface->error =
        (real)(UNIT_ROUNDOFF)*real_fma((real)(POINT_SCALE_ERROR), point->rounding_scale,
                                       (real)(POINT_POSITION_ERROR)*vector_norm1(point->position));
    surface->refracted_offset = surface->error + surface->error;
}

// The surface at the closest hit. Rays of a packet mostly hit one or two objects: each is looked up once, for
// all its lanes.
static inline Surface surface_interaction(const Scene *scene, const Ray *ray, const Hit *hit)
{
    Surface surface;
    surface.found = hit_found(hit);
    surface.color = surface.diffuse = (Color3){(real)(0), (real)(0), (real)(0)};
    surface.ambient = surface.specular = surface.shininess = (real)(0);
    surface.reflection = surface.transmission = (real)(0);
    surface.ior = (real)(1);
    surface.travelled = ray->travelled + hit->t;
    surface.to_eye = vector_scale(ray->direction, -real_sqrt(ray->inverse_squared));

    SurfacePoint point = surface_point_make(ray->origin, ray->direction, (real)(0));
    integer pending = lanes_select(surface.found, hit->object, NO_OBJECT);
    for (;;) {
        scalar_integer object = lanes_smallest(pending);
        if (object == INT_MAX) break;
        uint4 entry = scene->objects[object].kind_index_material;
        LaneSurfacePoints found;
        if (HAS_TRIANGLES && entry.x == KIND_TRIANGLES) {
            found = triangles_surface_point(scene, pending, entry.z, ray, hit->t);
        } else {
            found.lanes = pending == (integer)(object);
            found.point = shape_surface_point(scene, entry.x, entry.y, ray, hit->t);
        }
        pending = lanes_select(found.lanes, NO_OBJECT, pending);
        surface_point_replace(&point, found.lanes, &found.point);
        Material material = scene->materials[entry.z];
        Color3 color = object_color(scene, entry, &material, &found, ray, surface.travelled);
        surface_set_material(&surface, found.lanes, &material, color);
    }
    surface_set_point(&surface, &point, ray);
    return surface;
}

// The origin of a secondary ray, on the side the ray came from or, if `through`, on the other. It lies off
// the surface by twice the bound on the position's error: once for that error and once for the new ray's own
// test of the surface.
static inline Vector secondary_ray_origin(const Surface *surface, bool through)
{
    return vector_fma(surface->normal, through ? -surface->refracted_offset : surface->error + surface->error,
                      surface->position);
}

// Lanes where a transparent object may touch an opaque one.
static inline mask may_be_in_contact(const Scene *scene, Vector position)
{
    Vector low = vector_of(scene->header->contact_low), high = vector_of(scene->header->contact_high);
    return (position.x >= low.x) & (position.x <= high.x) & (position.y >= low.y) & (position.y <= high.y) &
           (position.z >= low.z) & (position.z <= high.z);
}

// Searches for opaque surfaces just behind transparent ones, from one error before them up to a gap of 3
// errors: a refracted ray starts 2 behind, and t is off by up to 1. An opaque surface within the error
// coincides with the transparent one: it becomes the hit of the lanes returned. If it is farther, the
// refracted ray starts halfway to it.
static inline mask surface_find_opaque(const Scene *scene, Surface *surface, Hit *hit)
{
    mask transparent = surface->found & (surface->transmission > (real)(0));
    transparent = transparent & may_be_in_contact(scene, surface->position);
    if (!lanes_any(transparent)) return mask_none();
    real error = surface->error, offset = error + error;
    Ray inward =
        ray_make_unit(secondary_ray_origin(surface, false), vector_negate(surface->normal), transparent);
    inward.tmin = error;
    inward.tmax = offset + (real)(3) * error;
    Hit opaque = closest_opaque_hit(scene, &inward);
    mask found = hit_found(&opaque);
    real gap = opaque.t - offset;
    mask touches = found & (gap <= error);
    surface->refracted_offset = lanes_select(found & !touches, (real)(0.5f) * gap, surface->refracted_offset);
    hit->object = lanes_select(touches, opaque.object, hit->object);
    return touches;
}

// The visible surface: where a transparent and an opaque one coincide, the opaque one, so that glass on a
// floor shows the floor. Secondary rays start beyond both. The second round is for the lanes whose hit the
// opaque surface replaced; a loop, since compilers would inline surface_interaction twice.
static inline Surface visible_surface(const Scene *scene, const Ray *ray, Hit *hit)
{
    real transparent_error = (real)(0), transparent_offset = (real)(LARGEST);
    for (bool replaced = false;; replaced = true) {
        Surface surface = surface_interaction(scene, ray, hit);
        surface.error = real_max(surface.error, transparent_error);
        surface.refracted_offset = real_min(surface.refracted_offset, transparent_offset);
        if (!HAS_TRANSMISSION || replaced) return surface;
        mask touches = surface_find_opaque(scene, &surface, hit);
        if (!lanes_any(touches)) return surface;
        transparent_error = lanes_select(touches, surface.error, (real)(0));
        transparent_offset = surface.refracted_offset;
    }
}

#endif
