#include "host/scene/object_transform.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/scene/mesh.h"
#include <string.h>

static const double NUMBER_LARGEST = 1e30; // of scene files

static bool is_in_range(Vector3 v)
{
    return fabs(v.x) <= NUMBER_LARGEST && fabs(v.y) <= NUMBER_LARGEST && fabs(v.z) <= NUMBER_LARGEST;
}

static void *items_copy(const void *items, size_t count, size_t size)
{
    return items ? memcpy(memory_allocate(count, size), items, count * size) : NULL;
}

Mesh mesh_copy(const Mesh *mesh)
{
    Mesh copy = *mesh;
    copy.vertices = items_copy(mesh->vertices, mesh->vertex_count, sizeof *mesh->vertices);
    copy.normals = items_copy(mesh->normals, mesh->vertex_count, sizeof *mesh->normals);
    copy.uvs = items_copy(mesh->uvs, mesh->vertex_count, sizeof *mesh->uvs);
    copy.triangles = items_copy(mesh->triangles, mesh->triangle_count, sizeof *mesh->triangles);
    copy.materials = items_copy(mesh->materials, mesh->triangle_count, sizeof *mesh->materials);
    copy.path = mesh->path ? memory_copy_text(mesh->path) : NULL;
    return copy;
}

// A normal that is zero, where shading is flat, stays zero.
static Vector3 normal_transform(const Affine *for_normals, Vector3 normal)
{
    return vector_is_zero(normal) ? normal : vector_normalize(affine_direction(for_normals, normal));
}

// A mirroring transform inverts the winding; inverting it back keeps the triangles' outer side.
static bool mesh_transform(Mesh *mesh, const Affine *affine)
{
    const Affine for_normals = affine_for_normals(affine);
    bool fits = true;
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        mesh->vertices[i] = affine_point(affine, mesh->vertices[i]);
        fits &= is_in_range(mesh->vertices[i]);
        if (mesh->normals) mesh->normals[i] = normal_transform(&for_normals, mesh->normals[i]);
    }
    for (size_t i = 0; i < mesh->triangle_count && affine_determinant(affine) < 0; i++) {
        uint32_t *corners = mesh->triangles[i], second = corners[1];
        corners[1] = corners[2];
        corners[2] = second;
    }
    return fits;
}

static bool triangle_transform(Object *object, const Affine *affine)
{
    const Affine for_normals = affine_for_normals(affine);
    Vector3 *vertices = object->as.triangle.vertices, *normals = object->as.triangle.normals;
    for (int i = 0; i < 3; i++) {
        vertices[i] = affine_point(affine, vertices[i]);
        normals[i] = normal_transform(&for_normals, normals[i]);
    }
    if (affine_determinant(affine) >= 0) return true;
    const Vector3 vertex = vertices[1], normal = normals[1];
    vertices[1] = vertices[2], normals[1] = normals[2];
    vertices[2] = vertex, normals[2] = normal;
    return true;
}

static bool keeps_axes(const Affine *affine)
{
    for (int row = 0; row < 3; row++) {
        int count = 0;
        for (int column = 0; column < 3; column++)
            count += affine->rows[row][column] != 0;
        if (count != 1) return false;
    }
    return true;
}

// Corner i of a box has its bits 0, 1 and 2 as the sides of x, y and z.
static Vector3 box_corner(Vector3 min, Vector3 max, unsigned i)
{
    return (Vector3){i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z};
}

static void box_make_mesh(Scene *scene, Object *object)
{
    static const uint32_t triangles[12][3] = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},
                                              {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                              {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    Mesh mesh = {.vertices = memory_allocate(8, sizeof *mesh.vertices),
                 .vertex_count = 8,
                 .triangles = items_copy(triangles, 12, sizeof *triangles),
                 .triangle_count = 12};
    for (unsigned i = 0; i < 8; i++)
        mesh.vertices[i] = box_corner(object->as.box.min, object->as.box.max, i);
    object->kind = SHAPE_MESH;
    object->as.mesh.index = (uint32_t)scene->meshes.count;
    array_push(scene->meshes, mesh);
}

// The functions below transform a shape. They return false if it would no longer be one of its kind, and
// leave numbers that object_transform checks.

static bool sphere_transform(Object *object, const Affine *affine)
{
    AxisScale scale;
    if (!affine_keeps_balls(affine, &scale)) return false;
    object->as.sphere.center = affine_point(affine, object->as.sphere.center);
    object->as.sphere.radius *= scale.across;
    return true;
}

static bool plane_transform(Object *object, const Affine *affine)
{
    const Affine for_normals = affine_for_normals(affine);
    object->as.plane.point = affine_point(affine, object->as.plane.point);
    object->as.plane.normal = normal_transform(&for_normals, object->as.plane.normal);
    return true;
}

static bool disc_transform(Object *object, const Affine *affine)
{
    const Affine for_normals = affine_for_normals(affine);
    AxisScale scale;
    if (!affine_keeps_circles(affine, object->as.disc.normal, false, &scale)) return false;
    object->as.disc.center = affine_point(affine, object->as.disc.center);
    object->as.disc.normal = normal_transform(&for_normals, object->as.disc.normal);
    object->as.disc.radius *= scale.across;
    return true;
}

static bool box_transform(Object *object, const Affine *affine)
{
    const Vector3 a = affine_point(affine, object->as.box.min), b = affine_point(affine, object->as.box.max);
    object->as.box.min = vector_min(a, b);
    object->as.box.max = vector_max(a, b);
    return true;
}

static bool cylinder_transform(Object *object, const Affine *affine)
{
    AxisScale scale;
    if (!affine_keeps_circles(affine, object->as.cylinder.axis, true, &scale)) return false;
    object->as.cylinder.from = affine_point(affine, object->as.cylinder.from);
    object->as.cylinder.axis = affine_direction(affine, object->as.cylinder.axis);
    object->as.cylinder.radius *= scale.across;
    return true;
}

static bool cone_transform(Object *object, const Affine *affine)
{
    AxisScale scale;
    if (!affine_keeps_circles(affine, object->as.cone.axis, true, &scale)) return false;
    object->as.cone.from = affine_point(affine, object->as.cone.from);
    object->as.cone.axis = affine_direction(affine, object->as.cone.axis);
    object->as.cone.radius[0] *= scale.across;
    object->as.cone.radius[1] *= scale.across;
    object->as.cone.slope *= scale.across / vector_length(scale.along);
    return true;
}

static bool torus_transform(Object *object, const Affine *affine)
{
    AxisScale scale;
    if (!affine_keeps_balls(affine, &scale)) return false;
    object->as.torus.center = affine_point(affine, object->as.torus.center);
    object->as.torus.axis = affine_direction(affine, object->as.torus.axis);
    object->as.torus.major *= scale.across;
    object->as.torus.minor *= scale.across;
    return true;
}

// The radius r at the height h is r^2 = 4 f h.
static bool paraboloid_transform(Object *object, const Affine *affine)
{
    AxisScale scale;
    if (!affine_keeps_circles(affine, object->as.paraboloid.axis, true, &scale)) return false;
    const double along = vector_length(scale.along);
    object->as.paraboloid.apex = affine_point(affine, object->as.paraboloid.apex);
    object->as.paraboloid.axis = affine_direction(affine, object->as.paraboloid.axis);
    object->as.paraboloid.height *= along;
    object->as.paraboloid.focal_length *= scale.across / along * scale.across;
    return true;
}

#define NEEDS_STRAIGHT "needs the same scale in all directions across its axis, and no shear"

// Indexed by ShapeKind. `vectors` and `lengths` are the offsets of members that must stay in range, ended by
// 0; lengths must stay above 0, or at least 0 where the shape has an alternative to them.
static const struct {
    bool (*transform)(Object *object, const Affine *affine);
    const char *need; // where it can fail
    size_t vectors[4], positive[3], lengths[3];
} shapes[SHAPE_MESH] = {
    {sphere_transform,
     "needs the same scale in all directions",
     {offsetof(Object, as.sphere.center)},
     {offsetof(Object, as.sphere.radius)},
     {0}},
    {plane_transform, NULL, {offsetof(Object, as.plane.point)}, {0}, {0}},
    {disc_transform,
     "needs the same scale in all directions of its plane",
     {offsetof(Object, as.disc.center)},
     {offsetof(Object, as.disc.radius)},
     {0}},
    {box_transform, NULL, {offsetof(Object, as.box.min), offsetof(Object, as.box.max)}, {0}, {0}},
    {cylinder_transform,
     NEEDS_STRAIGHT,
     {offsetof(Object, as.cylinder.from), offsetof(Object, as.cylinder.axis)},
     {offsetof(Object, as.cylinder.radius)},
     {0}},
    {cone_transform,
     NEEDS_STRAIGHT,
     {offsetof(Object, as.cone.from), offsetof(Object, as.cone.axis)},
     {0},
     {offsetof(Object, as.cone.radius[0]), offsetof(Object, as.cone.radius[1])}},
    {triangle_transform,
     NULL,
     {offsetof(Object, as.triangle.vertices[0]), offsetof(Object, as.triangle.vertices[1]),
      offsetof(Object, as.triangle.vertices[2])},
     {0},
     {0}},
    {torus_transform,
     "needs the same scale in all directions",
     {offsetof(Object, as.torus.center), offsetof(Object, as.torus.axis)},
     {offsetof(Object, as.torus.major), offsetof(Object, as.torus.minor)},
     {0}},
    {paraboloid_transform,
     NEEDS_STRAIGHT,
     {offsetof(Object, as.paraboloid.apex), offsetof(Object, as.paraboloid.axis)},
     {offsetof(Object, as.paraboloid.focal_length)},
     {offsetof(Object, as.paraboloid.height)}},
};

static bool numbers_fit(const Object *object)
{
    const char *members = (const char *)object;
    bool fits = true;
    for (const size_t *offset = shapes[object->kind].vectors; *offset > 0; offset++)
        fits &= is_in_range(*(const Vector3 *)(const void *)(members + *offset));
    for (const size_t *offset = shapes[object->kind].positive; *offset > 0; offset++)
        fits &= *(const double *)(const void *)(members + *offset) > 0 &&
                *(const double *)(const void *)(members + *offset) <= NUMBER_LARGEST;
    for (const size_t *offset = shapes[object->kind].lengths; *offset > 0; offset++)
        fits &= *(const double *)(const void *)(members + *offset) <= NUMBER_LARGEST;
    const Object *cone = object->kind == SHAPE_CONE ? object : NULL;
    if (cone && cone->as.cone.finite) fits &= cone->as.cone.radius[0] + cone->as.cone.radius[1] > 0;
    if (cone) fits &= !vector_is_zero(cone->as.cone.axis);
    return fits;
}

const char *object_transform(Scene *scene, Object *object, const Affine *affine)
{
    static const char *const out_of_range = "gets numbers of 0 or beyond 1e30";
    if (object->kind == SHAPE_BOX && !keeps_axes(affine)) box_make_mesh(scene, object);
    if (object->kind == SHAPE_MESH)
        return mesh_transform(&scene->meshes.items[object->as.mesh.index], affine) ? NULL : out_of_range;
    if (!shapes[object->kind].transform(object, affine)) return shapes[object->kind].need;
    return numbers_fit(object) ? NULL : out_of_range;
}
