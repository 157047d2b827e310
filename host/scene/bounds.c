#include "host/scene/scene.h"

static Vector3 vector_min(Vector3 a, Vector3 b)
{
    return (Vector3){fmin(a.x, b.x), fmin(a.y, b.y), fmin(a.z, b.z)};
}

static Vector3 vector_max(Vector3 a, Vector3 b)
{
    return (Vector3){fmax(a.x, b.x), fmax(a.y, b.y), fmax(a.z, b.z)};
}

static Bounds bounds_empty(void)
{
    return (Bounds){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static Bounds bounds_join(Bounds a, Bounds b)
{
    return (Bounds){vector_min(a.min, b.min), vector_max(a.max, b.max)};
}

// A disc reaches as far along a coordinate axis as that axis' projection into the disc's plane is long:
// sqrt(1 - n_x^2) for the unit normal n, here as the length of n's other components, which does not cancel.
static Bounds disc_bounds(Vector3 center, Vector3 normal, double radius)
{
    Vector3 n = vector_normalize(normal);
    Vector3 reach = vector_scale((Vector3){hypot(n.y, n.z), hypot(n.x, n.z), hypot(n.x, n.y)}, radius);
    return (Bounds){vector_subtract(center, reach), vector_add(center, reach)};
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

static Bounds sphere_bounds(Vector3 center, double radius)
{
    Vector3 reach = {radius, radius, radius};
    return (Bounds){vector_subtract(center, reach), vector_add(center, reach)};
}

static Bounds triangle_bounds(const Vector3 vertices[3])
{
    return (Bounds){vector_min(vertices[0], vector_min(vertices[1], vertices[2])),
                    vector_max(vertices[0], vector_max(vertices[1], vertices[2]))};
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
        return sphere_bounds(object->as.sphere.center, object->as.sphere.radius);
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
        return triangle_bounds(object->as.triangle.vertices);
    case SHAPE_TORUS: {
        double minor = object->as.torus.minor;
        Bounds circle = disc_bounds(object->as.torus.center, object->as.torus.axis, object->as.torus.major);
        return (Bounds){vector_subtract(circle.min, (Vector3){minor, minor, minor}),
                        vector_add(circle.max, (Vector3){minor, minor, minor})};
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
