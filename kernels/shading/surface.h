// Computes the position, normals and material of the surface at a hit, for shading.
#ifndef SURFACE_H
#define SURFACE_H

#include "shading/chords.h"
#include "shading/lane_points.h"
#include "shapes/triangle_normals.h"
#include "traversal/traversal.h"

// Members that only reflection, transmission or images need are set only with them. For an explicit ray,
// whose direction may have any length, colors and `travelled` are not used.
typedef struct {
    integer object; // its id; -1 if nothing is hit
    Vector position;
    Vector normal;         // geometric, unit, facing the ray; with HAS_SHADING_NORMALS: surface_normal
    Vector shading_normal; // unit, on the same side
    Vector to_eye;         // unit, back along the ray
    Vector lift;           // with HAS_SMOOTH_NORMALS, from the position to where rays to lights start
    real error;            // bound on the position's distance from the true surface
    real refracted_offset; // distance behind the surface at which a refracted ray starts
    Color3 ambient;        // the ambient light that it reflects, and its emission
    Color3 diffuse;        // the factor by which it reflects a light that it faces
    real specular, shininess;
    real reflection, transmission, ior;
    Color3 reflection_tint, specular_tint; // with HAS_TINTS
    mask fresnel;                          // with HAS_FRESNEL
    Sample sample;                         // with HAS_AREA_LIGHTS
    mask conductor;                        // with HAS_CONDUCTORS, and the square of its index:
    Color3 conductor_real, conductor_imaginary_squared;
    Color3 transmission_tint; // with HAS_FILTERS
    Color3 absorption;        // with HAS_ABSORPTION: the density within
    mask entering;            // the ray runs into the solid, against its outward normal
    real travelled;           // distance from the eye along the path
    // At `certified`, bounds on the distances from the exact ones of the position, of the shading normal,
    // with HAS_TRIANGLES of the geometric normal, and of to_eye; and the uncertain lanes.
    real place_error, normal_error, geometric_error, eye_error;
    real lift_error;              // with HAS_SMOOTH_NORMALS, bounds the error of `lift`, 0 where none lifts
    real line_error, start_error; // a reflected ray's origin_error and -tmin
    mask uncertain;
    ChordEnd chord_end; // with HAS_CHORDS
} Surface;

static inline mask surface_found(const Surface *surface)
{
    return surface->object >= (integer)(0);
}

// Returns the geometric normal, facing the ray.
static inline Vector surface_normal(const Surface *surface)
{
    return HAS_SHADING_NORMALS ? surface->normal : surface->shading_normal;
}

// Sets the chord's end where rays hit a sphere.
static inline void surface_set_chord_end(Surface *surface, const Sphere *sphere, const Ray *ray,
                                         const Hit *hit, const LaneSurfacePoints *found)
{
    ChordEnd end = chord_end(sphere, ray, hit, found->point.position, found->lanes);
    surface->place_error =
        lanes_select(found->lanes, real_min(surface->place_error, end.place), surface->place_error);
    surface->chord_end = chord_end_select(found->lanes, end, surface->chord_end);
}

// Marks finished lanes. It is larger than any id.
#define NO_OBJECT ((integer)(INT_MAX))

// Returns a lower bound on the cosine of the exact ray's incidence on a plane, or 0.
static inline real least_cosine(Vector normal, const Ray *ray)
{
    const real error = ray->direction_error + (real)(128 * UNIT_ROUNDOFF + 2 * TRIANGLE_NORMAL_ERROR);
    return real_max(fabs(vector_dot(normal, ray->direction)) * ray_inverse_length(ray) - error, (real)(0));
}

// Returns an upper bound on the root of a^2 + b^2, for a, b >= 0.
static inline real hypotenuse_above(real a, real b)
{
    return real_fma((real)(0.4143f), real_min(a, b), real_max(a, b));
}

// Lowers the bound on the position's error where the surface is flat. The exact hit is where the exact ray,
// line_error off, crosses a plane that the position is `height` above; `cosine` is its least_cosine.
static inline void surface_narrow_place(Surface *surface, mask lanes, real height, real cosine)
{
    const real one = (real)(1), across = surface->line_error;
    lanes = lanes & (cosine > (real)(0x1p-6f));
    const real sine =
        real_sqrt(real_max(real_fma(-cosine, cosine, one), (real)(0)) + (real)(16 * UNIT_ROUNDOFF));
    const real along = real_divide(real_fma(across, sine, height), lanes_select(lanes, cosine, one));
    const real both = hypotenuse_above(across, along);
    surface->place_error =
        lanes_select(lanes, real_min(surface->place_error, (real)(1.01f) * both), surface->place_error);
}

// Triangles of one material, one per lane.
typedef struct {
    mask lanes, next_to_eye; // next_to_eye: those with has_eye_height
    Corners corners, normals, uvs;
    Vector normal;          // geometric
    real liftable, density; // liftable: whether the normals are on one side of the triangle, 1 or 0
    bool smooth;            // some have normals
} LaneTriangles;

// Returns the triangles of one material among the objects hit that are in the range. In a fine mesh each lane
// hits a different triangle, so vertices are gathered triangle by triangle.
static inline LaneTriangles triangles_gather(const Scene *scene, integer objects, const ObjectRange *range,
                                             uint material)
{
    const Vector zero = {(real)(0), (real)(0), (real)(0)};
    const Corners none = {zero, zero, zero};
    const real density = (real)(scene->materials[material].reflection_transmission_ior.w);
    LaneTriangles hit = {mask_none(), mask_none(), none, none, none, zero, (real)(0), density, false};
    for (;;) {
        scalar_integer object = lanes_smallest(objects);
        if (object == INT_MAX) break;
        if (HAS_INSTANCES && object >= (scalar_integer)range->end) break;
        mask same = objects == (integer)(object);
        objects = lanes_select(same, NO_OBJECT, objects);
        uint4 entry = range_entry(scene, range, object);
        if (entry.x != TYPE_TRIANGLES || entry.z != material) continue;
        hit.lanes = hit.lanes | same;
        Triangle triangle = scene->triangles[entry.y];
        if (has_eye_height(triangle.id)) hit.next_to_eye = hit.next_to_eye | same;
        hit.corners = corners_select(same, corners_of(triangle.a, triangle.b, triangle.c), hit.corners);
        hit.normal = vector_select(same, triangle_normal(&triangle), hit.normal);
        if (HAS_SMOOTH_NORMALS && triangle.id.y > 0) {
            hit.smooth = true;
            TriangleNormals own = scene->triangle_normals[triangle.id.y - 1];
            hit.normals = corners_select(same, corners_of(own.a, own.b, own.c), hit.normals);
            hit.liftable = lanes_select(same, (real)(own.a.w), hit.liftable);
        }
        if (HAS_IMAGES && triangle.id.z > 0) {
            TriangleUvs own = scene->triangle_uvs[triangle.id.z - 1];
            const Corners uvs = corners_of(own.a_b, (scalar4)(own.a_b.zw, 0, 0), own.c_density);
            hit.uvs = corners_select(same, uvs, hit.uvs);
            hit.density = lanes_select(same, (real)(own.c_density.z), hit.density);
        }
    }
    return hit;
}

// Sets the points of flat triangles and returns their weights. Maps the triangles from an instance's space.
static inline TriangleWeights triangles_set_point(LaneTriangles *hit, const Scene *scene,
                                                  const ObjectRange *range, const Ray *ray, real t,
                                                  SurfacePoint *point)
{
    if (!HAS_INSTANCES || !range->is_instance) {
        const TriangleWeights weights = triangle_weights(hit->corners, ray);
        *point = corners_surface_point(hit->corners, hit->normal, weights, hit->next_to_eye, ray, t);
        return weights;
    }
    const Instance instance = scene->instances[range->instance];
    Ray own = instance_ray(&instance, ray);
    ray_prepare(&own);
    const TriangleWeights weights = triangle_weights(hit->corners, &own);
    *point = instance_surface_point(&instance, hit->corners, hit->normal, weights);
    if (hit->smooth) hit->normals = instance_normals(&instance, hit->normals);
    if (hit->smooth || HAS_NORMAL_MAPS) hit->corners = instance_corners(&instance, hit->corners);
    const real stretch = instance_stretch(&instance, hit->normal);
    if (HAS_IMAGES) hit->density = real_divide(hit->density, lanes_select(hit->lanes, stretch, (real)(1)));
    return weights;
}

// Returns the surface points of the triangles of one material among the objects hit that are in the range,
// evaluated for all lanes at once.
static OUT_OF_LINE LaneSurfacePoints triangles_surface_point(const Scene *scene, integer objects,
                                                             const ObjectRange *range, uint material,
                                                             const Ray *ray, real t, Surface *surface)
{
    LaneTriangles triangles = triangles_gather(scene, objects, range, material);
    LaneSurfacePoints hit;
    hit.lanes = triangles.lanes;
    const TriangleWeights weights = triangles_set_point(&triangles, scene, range, ray, t, &hit.point);
    const Corners corners = triangles.corners, normals = triangles.normals;
    TriangleHeights heights = {(real)(0), (real)(0), (real)(0), (real)(0)};
    real side = triangles.liftable;
    if (triangles.smooth) {
        triangle_smooth(normals, weights, &hit.point);
        mask along = vector_dot(hit.point.normal, ray->direction) > (real)(0),
             opposite = vector_dot(hit.point.normal, hit.point.shading_normal) < (real)(0);
        side = lanes_select(along ^ opposite, -side, side);
        heights = triangle_lift(corners, normals, weights, side, &hit.point);
    }
#if IS_CERTIFIED
    const real slimness = triangle_slimness(corners), cosine = least_cosine(hit.point.normal, ray),
               height = triangle_height(corners.a, hit.point.normal, ray_point(ray, t)),
               weights_error = triangle_weights_error(corners, ray, cosine);
    triangle_set_normal_errors(normals, weights, slimness, weights_error, &hit.point);
    surface_narrow_place(surface, hit.lanes, height, cosine);
    if (triangles.smooth)
        triangle_set_lift_error(corners, heights, side, slimness, surface->place_error + weights_error,
                                &hit.point);
    else
        hit.point.height = height;
#endif
    if (HAS_IMAGES) {
        Vector uv = triangle_blend(weights, triangles.uvs);
        hit.images.coordinates = (TextureCoordinates){uv.x, uv.y, triangles.density};
        if (HAS_NORMAL_MAPS) hit.images.tangents = triangle_tangents(corners, triangles.uvs);
    }
    return hit;
}

// Bounds how far a hit's position may be from the exact one: across the ray by the ray's error, along it by
// that of t, and by the roundings of ray_point and those of the shape.
static inline void surface_set_place_error(Surface *surface, const Ray *ray, const Hit *hit)
{
    real length = ray->length * (real)(1 + 16 * UNIT_ROUNDOFF), t = fabs(hit->t);
    real rounding =
        (real)(2 * UNIT_ROUNDOFF) * (vector_norm1(ray->origin) + vector_norm1(ray->direction) * t);
    real across = ray_place_error(ray, length * t),
         along = length * real_max(hit->high - hit->t, hit->t - hit->low);
    surface->place_error = real_fma((real)(1.04f), hypotenuse_above(across, along), rounding);
    surface->line_error = across * (real)(1 + 16 * UNIT_ROUNDOFF) + rounding; // excludes the surface
    surface->start_error = along * (real)(1 + 16 * UNIT_ROUNDOFF) + rounding;
}

// Sets the error of a reflected ray's line. A flat mirror that is `height` off moves that line by twice the
// height, and keeps its distance from the exact line. So errors of place add up from mirror to mirror,
// whereas those of points grow by one over the cosine.
static inline void surface_set_line_error(Surface *surface, const SurfacePoint *point)
{
    real line_error = real_fma((real)(2), point->height, surface->line_error);
    mask flat = line_error < surface->place_error;
    surface->line_error = lanes_select(flat, line_error, surface->place_error);
    surface->start_error = lanes_select(flat, surface->start_error, (real)(0));
}

static inline void surface_set_material(Surface *surface, const Scene *scene, mask lanes,
                                        const Material *material, Color3 color)
{
    scalar4 bounces = material->reflection_transmission_ior;
    Color3 ambient =
        color_multiply(vector_scale(vector_of(scene->header->ambient), (real)(material->color.w)), color);
    if (HAS_EMISSION) ambient = vector_add(ambient, vector_of(material->emission));
    surface->ambient = vector_select(lanes, ambient, surface->ambient);
    Color3 diffuse = color_multiply(vector_of(material->diffuse), color);
    surface->diffuse = vector_select(lanes, diffuse, surface->diffuse);
    surface->specular = lanes_select(lanes, (real)(material->diffuse.w), surface->specular);
    surface->shininess = lanes_select(lanes, (real)(material->other_color.w), surface->shininess);
    if (HAS_REFLECTION) surface->reflection = lanes_select(lanes, (real)(bounces.x), surface->reflection);
    if (HAS_TINTS) {
        Color3 reflected = vector_of(material->reflection_tint),
               specular = vector_of(material->specular_tint);
        surface->reflection_tint = vector_select(lanes, reflected, surface->reflection_tint);
        surface->specular_tint = vector_select(lanes, specular, surface->specular_tint);
    }
    if (HAS_CONDUCTORS) {
        Color3 index_real = vector_of(material->conductor_real),
               index_imaginary_squared = vector_of(material->conductor_imaginary_squared);
        surface->conductor = surface->conductor | (lanes & ((real)(material->conductor_real.w) > (real)(0)));
        surface->conductor_real = vector_select(lanes, index_real, surface->conductor_real);
        surface->conductor_imaginary_squared =
            vector_select(lanes, index_imaginary_squared, surface->conductor_imaginary_squared);
    }
    if (HAS_FRESNEL)
        surface->fresnel = surface->fresnel | (lanes & ((real)(material->reflection_tint.w) > (real)(0)));
    if (!HAS_TRANSMISSION) return;
    surface->transmission = lanes_select(lanes, (real)(bounces.y), surface->transmission);
    surface->ior = lanes_select(lanes, (real)(bounces.z), surface->ior);
    if (HAS_FILTERS)
        surface->transmission_tint =
            vector_select(lanes, vector_of(material->transmission_tint), surface->transmission_tint);
    if (HAS_ABSORPTION)
        surface->absorption = vector_select(lanes, vector_of(material->absorption), surface->absorption);
}

// Sets the bounds at a hit. Marks the lanes where the side that the ray comes from, or that of the shading
// normal, is uncertain.
static inline void surface_set_errors(Surface *surface, const SurfacePoint *point, const Ray *ray)
{
    surface->normal_error = point_normal_error(point, surface->place_error);
    real geometric_error = surface->normal_error;
    mask is_open = mask_none();
    if (HAS_TRIANGLES) { // triangles with smooth normals
        real shading_cosine = vector_dot(point->shading_normal, point->normal);
        mask flat = shading_cosine == vector_dot(point->normal, point->normal);
        geometric_error =
            lanes_select(flat, surface->normal_error, point->normal_error + (real)(16 * UNIT_ROUNDOFF));
        is_open = fabs(shading_cosine) <= geometric_error + surface->normal_error;
        surface->geometric_error = geometric_error;
    }
    real cosine = fabs(vector_dot(point->normal, ray->direction)); // times the ray's length
    real cosine_error = geometric_error + ray->direction_error + (real)(16 * UNIT_ROUNDOFF);
    is_open = is_open | !(cosine > cosine_error * ray->length);
    surface->uncertain = surface->uncertain | (surface_found(surface) & is_open);
}

// Turns both normals to the side that the ray comes from.
static inline void surface_set_point(Surface *surface, const SurfacePoint *point, const Ray *ray)
{
    if (IS_CERTIFIED) {
        surface_set_errors(surface, point, ray);
        surface_set_line_error(surface, point);
    }
    surface->position = point->position;
    if (HAS_SMOOTH_NORMALS) surface->lift = point->lift;
    if (HAS_SMOOTH_NORMALS && IS_CERTIFIED) surface->lift_error = point->lift_error;
    mask along = vector_dot(point->normal, ray->direction) > (real)(0);
    if (HAS_TRANSMISSION || IS_CERTIFIED) surface->entering = !along;
    Vector normal = vector_select(along, vector_negate(point->normal), point->normal);
    if (HAS_SHADING_NORMALS) surface->normal = normal;
    mask opposite = vector_dot(point->shading_normal, normal) < (real)(0);
    surface->shading_normal =
        vector_select(opposite, vector_negate(point->shading_normal), point->shading_normal);
    if (IS_CERTIFIED) return; // rays start on the surface
    surface->error =
        (real)(UNIT_ROUNDOFF)*real_fma((real)(POINT_SCALE_ERROR), point->rounding_scale,
                                       (real)(POINT_POSITION_ERROR)*vector_norm1(point->position));
    if (HAS_TRANSMISSION) surface->refracted_offset = surface->error + surface->error;
}

// Returns what the ray and its t alone decide of the surface, with the material of the background.
static inline Surface surface_start(const Ray *ray, const Hit *hit)
{
    Surface surface;
    surface.object = hit->object;
    surface.ambient = surface.diffuse = (Color3){(real)(0), (real)(0), (real)(0)};
    surface.specular = surface.shininess = (real)(0);
    if (HAS_REFLECTION) surface.reflection = (real)(0);
    if (HAS_TINTS) surface.reflection_tint = surface.specular_tint = surface.ambient;
    if (HAS_FRESNEL) surface.fresnel = mask_none();
    if (HAS_CONDUCTORS) {
        surface.conductor = mask_none();
        surface.conductor_real = surface.conductor_imaginary_squared = surface.ambient;
    }
    if (HAS_FILTERS) surface.transmission_tint = surface.ambient;
    if (HAS_ABSORPTION) surface.absorption = surface.ambient;
    if (HAS_TRANSMISSION) {
        surface.transmission = (real)(0);
        surface.ior = (real)(1);
    }
    if (HAS_IMAGES) surface.travelled = ray->travelled + hit->t;
    if (HAS_AREA_LIGHTS) surface.sample = ray->sample;
    surface.to_eye = vector_scale(ray->direction, -real_sqrt(ray->inverse_squared));
    if (IS_CERTIFIED) {
        surface_set_place_error(&surface, ray, hit);
        surface.eye_error = ray->direction_error + (real)(16 * UNIT_ROUNDOFF);
        surface.uncertain = hit->uncertain;
        if (HAS_CHORDS) surface.chord_end = chord_end_none();
    }
    return surface;
}

// Sets the point and the material in the lanes of *pending that hit one of their objects, or triangles of its
// material, and removes them. Returns false if none is pending. A call would keep the surface out of
// registers, and Oclgrind does not know what clang makes of an inlined function that returns a struct.
static inline ALWAYS_INLINE bool surface_add_object(Surface *surface, SurfacePoint *point, integer *pending,
                                                    const Scene *scene, const Ray *ray, const Hit *hit)
{
    const scalar_integer object = lanes_smallest(*pending);
    if (object == INT_MAX) return false;
    const ObjectRange range = object_range(scene, (uint)object);
    uint4 entry = range_entry(scene, &range, object);
    LaneSurfacePoints found;
    if (HAS_TRIANGLES && entry.x == TYPE_TRIANGLES) {
        // other precisions pass no pointer, which would keep the surface out of registers
        found = triangles_surface_point(scene, *pending, &range, entry.z, ray, hit->t,
                                        IS_CERTIFIED ? surface : 0);
    } else {
        found.lanes = *pending == (integer)(object);
        found.point = shape_surface_point(scene, entry.x, entry.y, ray, hit->t);
    }
    found.entry = entry;
    found.uncertain = mask_none();
    // the exact hit lies as near to the ray's own point as place_error says
    if (IS_CERTIFIED) found.point.position = ray_point(ray, hit->t);
#if IS_CERTIFIED
    if (HAS_CHORDS && entry.x == TYPE_SPHERES) {
        Sphere sphere = scene->spheres[entry.y];
        surface_set_chord_end(surface, &sphere, ray, hit, &found);
    }
    shape_set_errors(scene, &found, ray, hit->t, surface->place_error);
    if (!HAS_TRIANGLES || entry.x != TYPE_TRIANGLES)
        surface_narrow_place(surface, found.lanes & (found.point.height < NEVER), found.point.height,
                             least_cosine(found.point.normal, ray));
#endif
    Material material = scene->materials[entry.z];
    if (HAS_IMAGES && (material.texture.x > 0 || material.normal_map.x > 0))
        hit_set_images(&found, scene, &material, ray, surface->travelled);
    if (HAS_NORMAL_MAPS && material.normal_map.x > 0)
        found.point.shading_normal =
            normal_tilted(scene, &material, entry.x, &found.images, found.point.shading_normal, found.lanes);
    // storing the zero in every surface would cost 2 % of a frame's time
    Color3 color =
        object_color(scene, &material, &found, ray, IS_CERTIFIED ? surface->place_error : (real)(0));
    if (IS_CERTIFIED) surface->uncertain = surface->uncertain | (found.lanes & found.uncertain);
    surface_set_material(surface, scene, found.lanes, &material, color);
    *pending = lanes_select(found.lanes, NO_OBJECT, *pending);
    surface_point_replace(point, found.lanes, &found.point);
    return true;
}

// Returns the surface at the closest hit. Rays of a packet mostly hit one or two objects, so each object is
// looked up once, for all its lanes.
static inline Surface surface_interaction(const Scene *scene, const Ray *ray, const Hit *hit)
{
    Surface surface = surface_start(ray, hit);
    SurfacePoint point = surface_point_make(ray->origin, ray->direction, (real)(0));
    integer pending = lanes_select(hit_found(hit), hit->object, NO_OBJECT);
    while (surface_add_object(&surface, &point, &pending, scene, ray, hit)) {
    }
    surface_set_point(&surface, &point, ray);
    return surface;
}

#endif
