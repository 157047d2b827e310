// What a hit looks like to the lights: its place, its normals, its material.
#ifndef SURFACE_H
#define SURFACE_H

#include "shading/texture.h"

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

typedef struct {
    mask found;
    Vector position;
    Vector normal;         // unit, of the geometry, facing the ray
    Vector shading_normal; // unit, on the same side
    Vector to_eye;         // unit, back along the ray
    real error;            // the position is at most this far from the true surface
    real behind;           // a ray that passes the surface starts so far behind it
    Color3 color, diffuse;
    real ambient, specular, shininess;
    real reflection, transmission, ior;
    mask entering;  // the ray runs into the solid, against its outward normal
    real travelled; // from the eye, along unit rays
} Surface;

static inline Patch shape_patch(const Scene *scene, uint kind, uint index, const Ray *ray, real t)
{
#define PATCH_OF_SHAPE(feature, Type, name, names)                                                           \
    if (HAS_##feature && kind == KIND_##feature) {                                                           \
        Type shape = scene->names[index];                                                                    \
        return name##_patch(&shape, ray, t);                                                                 \
    }
    SHAPE_LIST(PATCH_OF_SHAPE)
    return patch_make(ray->origin, ray->direction, (real)(0));
}

typedef struct {
    mask lanes; // that met them
    Patch patch;
    PicturePoint point; // where a picture lies on them
} MetTriangles;

// The triangles of one material among the lanes' objects. In a fine mesh each lane meets one of its own:
// their numbers are gathered one triangle after the other, what is made of them is made for all lanes at
// once.
static OUT_OF_LINE MetTriangles triangles_met(const Scene *scene, integer objects, uint material,
                                              const Ray *ray, real t)
{
    const Vector nothing = {(real)(0), (real)(0), (real)(0)};
    const integer settled = (integer)(INT_MAX);
    MetTriangles met;
    met.lanes = mask_none();
    Vector normal = nothing;
    Corners corners = {nothing, nothing, nothing}, normals = corners, uvs = corners;
    real density = (real)(scene->materials[material].reflection_transmission_ior.w);
    bool smooth = false;
    for (;;) {
        scalar_integer object = lanes_smallest(objects);
        if (object == INT_MAX) break;
        mask same = objects == (integer)(object);
        objects = lanes_select(same, settled, objects);
        uint4 entry = scene->objects[object].kind_index_material;
        if (entry.x != KIND_TRIANGLES || entry.z != material) continue;
        met.lanes = met.lanes | same;
        Triangle triangle = scene->triangles[entry.y];
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
    met.patch = triangle_crossing_patch(corners, normal, weights, ray, t);
    if (smooth) triangle_smooth(normals, weights, &met.patch);
    if (HAS_IMAGES) {
        Vector uv = triangle_blend(weights, uvs);
        met.point = (PicturePoint){uv.x, uv.y, density};
    }
    return met;
}

// The checker's square at each point: even or odd. On a plane or disc squares lie in the surface; elsewhere
// they are cubes in space, looked up a 1024th of a cube behind the surface, so that a face lying on the
// border between cubes has one color.
static inline mask checker_odd(const Scene *scene, uint kind, uint index, const Patch *patch, Vector inward,
                               scalar4 grid)
{
    real cells;
    if (kind_has_grid(kind)) {
        GridPlace place = grid_place(scene, kind, index, patch->position);
        cells = floor(place.u) + floor(place.v);
    } else {
        Vector cell = vector_fma(patch->position, (real)(grid.w), vector_of(grid));
        cell = vector_fma(inward, (real)(0x1p-10f), cell);
        cells = floor(cell.x) + floor(cell.y) + floor(cell.z);
    }
    real halved = cells * (real)(0.5f);
    return floor(halved) != halved;
}

// Rays of one tile mostly meet one or two objects: each object among the hits is looked up once, for all its
// lanes, but triangles of one material together.
static inline Surface surface_at(const Scene *scene, const Ray *ray, const Hit *hit)
{
    Surface surface;
    surface.found = hit_found(hit);
    Patch patch = patch_make(ray->origin, ray->direction, (real)(0));
    surface.color = surface.diffuse = (Color3){(real)(0), (real)(0), (real)(0)};
    surface.ambient = surface.specular = surface.shininess = (real)(0);
    surface.reflection = surface.transmission = (real)(0);
    surface.ior = (real)(1);

    surface.travelled = ray->travelled + hit->t;
    surface.to_eye = vector_scale(ray->direction, -real_sqrt(ray->inverse_squared));

    const integer settled = (integer)(INT_MAX);
    integer pending = lanes_select(surface.found, hit->object, settled);
    for (;;) {
        scalar_integer object = lanes_smallest(pending);
        if (object == INT_MAX) break;
        uint4 entry = scene->objects[object].kind_index_material;
        mask same = pending == (integer)(object);
        Patch found;
        PicturePoint point;
        if (HAS_TRIANGLES && entry.x == KIND_TRIANGLES) {
            MetTriangles met = triangles_met(scene, pending, entry.z, ray, hit->t);
            same = met.lanes;
            found = met.patch;
            point = met.point;
        } else {
            found = shape_patch(scene, entry.x, entry.y, ray, hit->t);
        }
        pending = lanes_select(same, settled, pending);
        patch_keep(&patch, same, &found);
        Material material = scene->materials[entry.z];

        Color3 color = vector_of(material.color);
        if (HAS_CHECKERS && material.grid.w != 0) {
            mask against = vector_dot(found.normal, ray->direction) > (real)(0);
            Vector inward = vector_select(against, found.normal, vector_negate(found.normal));
            mask odd = checker_odd(scene, entry.x, entry.y, &found, inward, material.grid);
            color = vector_select(odd, vector_of(material.other_color), color);
        }
        if (HAS_IMAGES && material.image.x > 0) {
            if (entry.x != KIND_TRIANGLES) point = picture_point(scene, entry.x, entry.y, &material, &found);
            color = picture_color(scene, entry.x, &material, point, &found, ray, surface.travelled, same);
        }
        surface.color = vector_select(same, color, surface.color);
        surface.diffuse = vector_select(same, vector_of(material.diffuse), surface.diffuse);
        surface.ambient = lanes_select(same, (real)(material.color.w), surface.ambient);
        surface.specular = lanes_select(same, (real)(material.diffuse.w), surface.specular);
        surface.shininess = lanes_select(same, (real)(material.other_color.w), surface.shininess);
        surface.reflection =
            lanes_select(same, (real)(material.reflection_transmission_ior.x), surface.reflection);
        surface.transmission =
            lanes_select(same, (real)(material.reflection_transmission_ior.y), surface.transmission);
        surface.ior = lanes_select(same, (real)(material.reflection_transmission_ior.z), surface.ior);
    }

    surface.position = patch.position;
    mask away = vector_dot(patch.normal, ray->direction) > (real)(0);
    surface.entering = !away;
    surface.normal = vector_select(away, vector_negate(patch.normal), patch.normal);
    mask shading_away = vector_dot(patch.shading_normal, surface.normal) < (real)(0);
    surface.shading_normal =
        vector_select(shading_away, vector_negate(patch.shading_normal), patch.shading_normal);
    surface.error =
        (real)(UNIT_ROUNDOFF)*real_fma((real)(16), patch.size, (real)(4) * vector_magnitude(patch.position));
    surface.behind = surface.error + surface.error;
    return surface;
}

// Where a ray that leaves the surface starts, on the side the ray came from or, `through` it, on the other:
// off it by twice the bound on the position's error, once for that error and once for the new ray's own test
// of the surface.
static inline Vector surface_leave(const Surface *surface, bool through)
{
    return vector_fma(surface->normal, through ? -surface->behind : surface->error + surface->error,
                      surface->position);
}

// Whether something opaque may be in the same place.
static inline mask place_may_touch(const Scene *scene, Vector place)
{
    Vector low = vector_of(scene->header->contact_low), high = vector_of(scene->header->contact_high);
    return (place.x >= low.x) & (place.x <= high.x) & (place.y >= low.y) & (place.y <= high.y) &
           (place.z >= low.z) & (place.z <= high.z);
}

// Looks for something opaque just behind transparent surfaces, before or little beyond where a ray that
// passes them starts. What lies within the surface's error is in the same place: returns the lanes whose hits
// it becomes. Farther ones a ray that passes starts halfway to.
static inline mask surface_find_opaque(const Scene *scene, Surface *surface, Hit *hit)
{
    mask transparent = surface->found & (surface->transmission > (real)(0));
    transparent = transparent & place_may_touch(scene, surface->position);
    if (!lanes_any(transparent)) return mask_none();
    real error = surface->error, before = error + error;
    Ray inward = ray_make_unit(surface_leave(surface, false), vector_negate(surface->normal), transparent);
    inward.near = error;
    inward.far = before + (real)(3) * error;
    Hit opaque = closest_opaque_hit(scene, &inward);
    mask found = hit_found(&opaque);
    real gap = opaque.t - before;
    mask touches = found & (gap <= error);
    surface->behind = lanes_select(found & !touches, (real)(0.5f) * gap, surface->behind);
    hit->object = lanes_select(touches, opaque.object, hit->object);
    return touches;
}

// What the ray meets, where an opaque surface goes before a transparent one in the same place: glass that
// stands on a floor shows the floor. Rays that leave it start beyond either.
static inline Surface surface_seen(const Scene *scene, const Ray *ray, Hit *hit)
{
    real error = (real)(0), behind = (real)(LARGEST);
    for (bool asked = false;; asked = true) {
        Surface surface = surface_at(scene, ray, hit);
        surface.error = real_max(surface.error, error);
        surface.behind = real_min(surface.behind, behind);
        if (!HAS_TRANSMISSION || asked) return surface;
        mask touches = surface_find_opaque(scene, &surface, hit);
        if (!lanes_any(touches)) return surface;
        error = lanes_select(touches, surface.error, (real)(0));
        behind = surface.behind;
    }
}

#endif
