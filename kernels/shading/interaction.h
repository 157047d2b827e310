// Computes the surface at the closest hit of each ray of a packet.
#ifndef INTERACTION_H
#define INTERACTION_H

#include "shading/triangle_points.h"

// Sets the surface's point and its errors, with both normals turned to the side that the ray comes from.
static inline void surface_set_point(Surface *surface, const SurfacePoint *point, const Ray *ray)
{
    if (IS_CERTIFIED) surface_set_errors(surface, point, ray);
    surface->position = point->position;
    if (HAS_SMOOTH_NORMALS) surface->lift = point->lift;
    mask along = vector_dot(point->normal, ray->direction) > 0;
    if (HAS_TRANSMISSION || IS_CERTIFIED) surface->entering = !along;
    Vector normal = vector_select(along, vector_negate(point->normal), point->normal);
    if (HAS_SHADING_NORMALS) surface->normal = normal;
    mask opposite = vector_dot(point->shading_normal, normal) < 0;
    surface->shading_normal =
        vector_select(opposite, vector_negate(point->shading_normal), point->shading_normal);
    if (IS_CERTIFIED) return; // rays start on the surface
    surface->error = UNIT_ROUNDOFF * real_fma((real)(POINT_SCALE_ERROR), point->rounding_scale,
                                              POINT_POSITION_ERROR * vector_norm1(point->position));
    if (HAS_TRANSMISSION) surface->refracted_offset = surface->error + surface->error;
}

// Returns a surface with what follows from the ray and its t, and with the material of the background.
static inline Surface surface_start(const Ray *ray, const Hit *hit)
{
    Surface surface;
    surface.object = hit->object;
    surface.ambient = surface.diffuse = color_gray((real)(0));
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
    if (IS_CERTIFIED) surface_start_errors(&surface, ray, hit);
    return surface;
}

// Sets the point and the material in the lanes of *pending that hit one of their objects, or triangles of its
// material, and removes them. Returns false if none is pending. A call would keep the surface out of
// registers. Oclgrind rejects the code that clang generates for an inlined function that returns a struct.
static inline ALWAYS_INLINE bool surface_add_object(Surface *surface, SurfacePoint *point, integer *pending,
                                                    const Scene *scene, const Ray *ray, const Hit *hit)
{
    const scalar_integer object = lanes_smallest(*pending);
    if (object == INT_MAX) return false;
    const ObjectRange range = object_range(scene, (uint)object);
    uint4 entry = range_entry(scene, &range, object);
    LaneSurfacePoints points;
    if (HAS_TRIANGLES && entry.x == TYPE_TRIANGLES) {
        // other precisions pass no pointer, which would keep the surface out of registers
        points = triangles_surface_point(scene, *pending, &range, entry.z, ray, hit->t,
                                         IS_CERTIFIED ? surface : 0);
    } else {
        points.lanes = *pending == (integer)(object);
        points.point = shape_surface_point(scene, entry.x, entry.y, ray, hit->t);
    }
    points.entry = entry;
    points.uncertain = mask_none();
    if (IS_CERTIFIED) surface_set_point_errors(surface, &points, scene, ray, hit);
    FlatMaterial material = scene->materials[entry.z];
    if (HAS_IMAGES && (material.texture.x > 0 || material.normal_map.x > 0))
        points_set_images(&points, scene, &material, ray, surface->travelled);
    if (HAS_NORMAL_MAPS && material.normal_map.x > 0)
        points.point.shading_normal = normal_tilted(scene, &material, entry.x, &points.images,
                                                    points.point.shading_normal, points.lanes);
    // other precisions set no position_error, since storing a 0 in each surface would cost 2 % of a frame's
    // time
    Color3 color =
        object_color(scene, &material, &points, ray, IS_CERTIFIED ? surface->position_error : (real)(0));
    if (IS_CERTIFIED) surface->uncertain = surface->uncertain | (points.lanes & points.uncertain);
    surface_set_material(surface, scene, points.lanes, &material, color);
    *pending = lanes_select(points.lanes, NO_OBJECT, *pending);
    surface_point_replace(point, points.lanes, &points.point);
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
