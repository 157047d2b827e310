// Computes the surface points of triangles. In a fine mesh each lane hits a different triangle.
#ifndef TRIANGLE_POINTS_H
#define TRIANGLE_POINTS_H

#include "shading/certain_surface.h"
#include "shapes/instance.h"
#include "shapes/triangle_normals.h"

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
    LaneTriangles triangles = {mask_none(), mask_none(), none, none, none, zero, (real)(0), density, false};
    for (;;) {
        scalar_integer object = lanes_smallest(objects);
        if (object == INT_MAX) break;
        if (HAS_INSTANCES && object >= (scalar_integer)range->end) break;
        mask same = objects == (integer)(object);
        objects = lanes_select(same, NO_OBJECT, objects);
        uint4 entry = range_entry(scene, range, object);
        if (entry.x != TYPE_TRIANGLES || entry.z != material) continue;
        triangles.lanes = triangles.lanes | same;
        Triangle triangle = scene->triangles[entry.y];
        if (has_eye_height(triangle.id)) triangles.next_to_eye = triangles.next_to_eye | same;
        triangles.corners =
            corners_select(same, corners_of(triangle.a, triangle.b, triangle.c), triangles.corners);
        vector_replace(&triangles.normal, same, triangle_normal(&triangle));
        if (HAS_SMOOTH_NORMALS && triangle.id.y > 0) {
            triangles.smooth = true;
            TriangleNormals vertex_normals = scene->triangle_normals[triangle.id.y - 1];
            triangles.normals = corners_select(
                same, corners_of(vertex_normals.a, vertex_normals.b, vertex_normals.c), triangles.normals);
            real_replace(&triangles.liftable, same, (real)(vertex_normals.a.w));
        }
        if (HAS_IMAGES && triangle.id.z > 0) {
            TriangleUvs vertex_uvs = scene->triangle_uvs[triangle.id.z - 1];
            triangles.uvs = corners_select(same, corners_of_uvs(vertex_uvs), triangles.uvs);
            real_replace(&triangles.density, same, (real)(vertex_uvs.c_density.z));
        }
    }
    return triangles;
}

// Sets the points of flat triangles and returns their weights. Maps the triangles from an instance's space.
static inline TriangleWeights triangles_set_point(LaneTriangles *triangles, const Scene *scene,
                                                  const ObjectRange *range, const Ray *ray, real t,
                                                  SurfacePoint *point)
{
    if (!HAS_INSTANCES || !range->is_instance) {
        const TriangleWeights weights = triangle_weights(triangles->corners, ray);
        *point = corners_surface_point(triangles->corners, triangles->normal, weights, triangles->next_to_eye,
                                       ray, t);
        return weights;
    }
    const Instance instance = scene->instances[range->instance];
    Ray mapped = instance_ray(&instance, ray);
    ray_prepare(&mapped);
    const TriangleWeights weights = triangle_weights(triangles->corners, &mapped);
    *point = instance_surface_point(&instance, triangles->corners, triangles->normal, weights);
    if (triangles->smooth) triangles->normals = instance_normals(&instance, triangles->normals);
    if (triangles->smooth || HAS_NORMAL_MAPS)
        triangles->corners = instance_corners(&instance, triangles->corners);
    const real stretch = instance_stretch(&instance, triangles->normal);
    if (HAS_IMAGES)
        triangles->density =
            real_divide(triangles->density, lanes_select(triangles->lanes, stretch, (real)(1)));
    return weights;
}

// Returns the surface points of the triangles of one material among the objects hit that are in the range,
// evaluated for all lanes at once.
static OUT_OF_LINE LaneSurfacePoints triangles_surface_point(const Scene *scene, integer objects,
                                                             const ObjectRange *range, uint material,
                                                             const Ray *ray, real t, Surface *surface)
{
    LaneTriangles triangles = triangles_gather(scene, objects, range, material);
    LaneSurfacePoints points;
    points.lanes = triangles.lanes;
    const TriangleWeights weights = triangles_set_point(&triangles, scene, range, ray, t, &points.point);
    const Corners corners = triangles.corners, normals = triangles.normals;
    TriangleHeights heights = {(real)(0), (real)(0), (real)(0), (real)(0)};
    real side = triangles.liftable;
    if (triangles.smooth) {
        triangle_smooth(normals, weights, &points.point);
        mask along = vector_dot(points.point.normal, ray->direction) > 0,
             opposite = vector_dot(points.point.normal, points.point.shading_normal) < 0;
        side = lanes_select(along ^ opposite, -side, side);
        heights = triangle_lift(corners, normals, weights, side, &points.point);
    }
    if (IS_CERTIFIED) {
        const real slimness = triangle_slimness(corners_edges(corners)),
                   cosine = least_cosine(points.point.normal, ray),
                   height = triangle_height(corners.a, points.point.normal, ray_point(ray, t)),
                   weights_error = triangle_weights_error(corners, ray, cosine);
        triangle_set_normal_errors(normals, weights, slimness, weights_error, &points.point);
        surface_narrow_position(surface, points.lanes, height, cosine);
        if (triangles.smooth)
            triangle_set_lift_error(corners, heights, side, slimness, surface->position_error + weights_error,
                                    &points.point);
        else
            points.point.height = height;
    }
    if (HAS_IMAGES) {
        Vector uv = triangle_blend(weights, triangles.uvs);
        points.images.coordinates = (TextureCoordinates){uv.x, uv.y, triangles.density};
        if (HAS_NORMAL_MAPS) points.images.tangents = triangle_tangents(corners, triangles.uvs);
    }
    return points;
}

#endif
