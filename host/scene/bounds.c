#include "host/scene/scene.h"

static Bounds disc_bounds(Vector3 center, Vector3 normal, double radius)
{
    return bounds_around(center, vector_scale(circle_reach(vector_normalize(normal)), radius));
}

// Sides without caps reach as far as the discs that end them.
static Bounds frustum_bounds(Vector3 from, Vector3 axis, double radius_from, double radius_to)
{
    return bounds_join(disc_bounds(from, axis, radius_from),
                       disc_bounds(vector_add(from, axis), axis, radius_to));
}

static bool object_is_bounded(const Object *object)
{
    switch (object->kind) {
    case SHAPE_PLANE:
        return false;
    case SHAPE_CYLINDER:
        return object->as.cylinder.finite;
    case SHAPE_CONE:
        return object->as.cone.finite;
    default:
        return true;
    }
}

static Bounds mesh_bounds(const Mesh *mesh)
{
    Bounds bounds = bounds_empty();
    for (size_t i = 0; i < mesh->vertex_count; i++)
        bounds = bounds_join(bounds, (Bounds){mesh->vertices[i], mesh->vertices[i]});
    return bounds;
}

static Bounds object_bounds(const Scene *scene, const Object *object)
{
    switch (object->kind) {
    case SHAPE_SPHERE:
        return bounds_around(object->as.sphere.center, vector_all(object->as.sphere.radius));
    case SHAPE_DISC:
        return disc_bounds(object->as.disc.center, object->as.disc.normal, object->as.disc.radius);
    case SHAPE_BOX:
        return (Bounds){object->as.box.min, object->as.box.max};
    case SHAPE_CYLINDER:
        return frustum_bounds(object->as.cylinder.from, object->as.cylinder.axis, object->as.cylinder.radius,
                              object->as.cylinder.radius);
    case SHAPE_CONE:
        return frustum_bounds(object->as.cone.from, object->as.cone.axis, object->as.cone.radius[0],
                              object->as.cone.radius[1]);
    case SHAPE_TRIANGLE:
        return bounds_of_triangle(object->as.triangle.vertices[0], object->as.triangle.vertices[1],
                                  object->as.triangle.vertices[2]);
    case SHAPE_TORUS: {
        const Vector3 minor = vector_all(object->as.torus.minor);
        Bounds circle = disc_bounds(object->as.torus.center, object->as.torus.axis, object->as.torus.major);
        return (Bounds){vector_subtract(circle.min, minor), vector_add(circle.max, minor)};
    }
    case SHAPE_MESH:
        return mesh_bounds(&scene->meshes.items[object->as.mesh.index]);
    case SHAPE_PLANE:
    case SHAPE_COUNT:
        break;
    }
    return bounds_empty();
}

Bounds scene_bounds(const Scene *scene, size_t *unbounded_count)
{
    Bounds bounds = bounds_empty();
    *unbounded_count = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        if (object_is_bounded(object))
            bounds = bounds_join(bounds, object_bounds(scene, object));
        else
            ++*unbounded_count;
    }
    return bounds;
}

double scene_smallest_size(const Scene *scene)
{
    double smallest = INFINITY;
    for (size_t i = 0; i < scene->objects.count; i++) {
        if (!object_is_bounded(&scene->objects.items[i])) continue;
        Bounds bounds = object_bounds(scene, &scene->objects.items[i]);
        Vector3 size = vector_subtract(bounds.max, bounds.min);
        double largest_side = fmax(size.x, fmax(size.y, size.z));
        if (largest_side > 0) smallest = fmin(smallest, largest_side);
    }
    return isinf(smallest) ? 0 : smallest;
}
