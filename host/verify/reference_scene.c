#include "host/verify/reference_scene.h"

#include "host/base/memory.h"
#include "host/compile/camera_basis.h"
#include "host/scene/mesh.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Returns a triangle of a mesh, flat if a vertex has no normal.
static Object mesh_triangle(const Mesh *mesh, const Object *whole, size_t part)
{
    const MeshTriangle triangle = mesh_triangle_at(mesh, whole, part);
    const uint32_t *materials = mesh_materials(mesh, whole);
    Object object = {.type = SHAPE_TRIANGLE, .material = materials ? materials[part] : whole->material};
    Vector3 *vertices = object.as.triangle.vertices, *normals = object.as.triangle.normals;
    memcpy(vertices, triangle.vertices, sizeof triangle.vertices);
    memcpy(normals, triangle.normals, sizeof triangle.normals);
    object.as.triangle.smooth = mesh->normals && !vector_is_zero(normals[0]) && !vector_is_zero(normals[1]) &&
                                !vector_is_zero(normals[2]);
    return object;
}

ReferenceScene reference_scene_open(const Scene *scene)
{
    const size_t count = scene_primitive_count(scene);
    ReferenceScene made = {.scene = *scene, .spheres = memory_allocate_zeroed(count, sizeof *made.spheres)};
    Object *objects = memory_allocate_zeroed(count, sizeof *objects);
    size_t next = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        if (object->type != SHAPE_MESH) {
            objects[next++] = *object;
            continue;
        }
        const Mesh *mesh = &scene->meshes.items[object->as.mesh.index];
        for (size_t k = 0; k < mesh->triangle_count; k++)
            objects[next++] = mesh_triangle(mesh, object, k);
    }
    made.scene.objects.items = objects;
    made.scene.objects.count = made.scene.objects.capacity = count;
    for (size_t i = 0; i < count; i++) {
        const Bounds bounds = object_bounds(&made.scene, &objects[i]);
        made.spheres[i].radius = INFINITY;
        if (bounds_is_everywhere(&bounds)) continue;
        made.spheres[i].center = vector_scale(vector_add(bounds.min, bounds.max), 0.5);
        made.spheres[i].radius = vector_length(vector_subtract(bounds.max, made.spheres[i].center));
    }
    return made;
}

void reference_scene_close(ReferenceScene *scene)
{
    free(scene->scene.objects.items);
    free(scene->spheres);
    *scene = (ReferenceScene){0};
}

// Returns whether the ray certainly misses a sphere or reaches it only outside its interval. The slack is
// far above the rounding errors of double.
static bool sphere_is_missed(const BoundingSphere *sphere, const ReferenceRay *ray)
{
    if (!isfinite(sphere->radius)) return false;
    const Vector3 from = vector_subtract(sphere->center, quad3_rounded(ray->origin));
    const Vector3 direction = quad3_rounded(ray->direction);
    const double length = vector_length(direction), distance = vector_length(from);
    const double along = vector_dot(from, direction) / length;
    const double radius = sphere->radius * (1 + 1e-6) + 1e-6 * distance;
    return distance * distance - along * along > radius * radius ||
           along + radius < (double)ray->tmin * length || along - radius > (double)ray->tmax * length;
}

ReferenceHit reference_scene_hit_object(const ReferenceScene *scene, size_t index, const ReferenceRay *ray,
                                        uint32_t left)
{
    if (scene->spheres && sphere_is_missed(&scene->spheres[index], ray)) return reference_miss();
    const Object *object = &scene->scene.objects.items[index];
    const bool is_flat =
        object->type == SHAPE_PLANE || object->type == SHAPE_DISC || object->type == SHAPE_TRIANGLE;
    if (index == left && is_flat) return reference_miss();
    ReferenceRay whole = *ray;
    if (left != UINT32_MAX) whole.tmin = 0;
    ReferenceHit hit = reference_hit_object(object, &whole);
    while (left != UINT32_MAX && hit.found && hit.t * hit.cosine <= ray->tmin) {
        whole.tmin = hit.t;
        hit = reference_hit_object(object, &whole);
    }
    if (index == left) hit.margin = reference_miss().margin;
    return hit;
}

ReferenceHit reference_scene_hit(const ReferenceScene *scene, const ReferenceRay *ray, uint32_t left)
{
    ReferenceHit nearest = reference_miss();
    for (size_t i = 0; i < scene->scene.objects.count; i++)
        reference_hit_record(&nearest, reference_scene_hit_object(scene, i, ray, left), (uint32_t)i, ray);
    return nearest;
}

ReferenceRay reference_camera_ray(const Camera *camera, unsigned width, unsigned height, unsigned column,
                                  unsigned row)
{
    const CameraBasis basis = camera_basis(camera, width, height);
    const Quad x = (Quad)2 * column + 1 - width, y = height - 1 - (Quad)2 * row;
    if (camera->projection == PROJECTION_EQUIRECTANGULAR) {
        const Quad half_turn = QUAD_CALL(acos)(-1), longitude = half_turn * x / width,
                   latitude = half_turn / 2 * y / height;
        const Quad3 right = quad3(vector_normalize(basis.right)), up = quad3(vector_normalize(basis.up));
        const Quad3 level = quad3_add(quad3_scale(quad3(basis.forward), QUAD_CALL(cos)(longitude)),
                                      quad3_scale(right, QUAD_CALL(sin)(longitude)));
        return (ReferenceRay){quad3(camera->position),
                              quad3_add(quad3_scale(level, QUAD_CALL(cos)(latitude)),
                                        quad3_scale(up, QUAD_CALL(sin)(latitude))),
                              0, (Quad)FLT_MAX};
    }
    const Quad3 sideways = quad3_add(quad3_scale(quad3(basis.right), x), quad3_scale(quad3(basis.up), y));
    const Quad3 direction = quad3_add(quad3(basis.middle), sideways);
    return (ReferenceRay){quad3(camera->position), direction, 0, (Quad)FLT_MAX};
}
