#include "host/scene/object_transform.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/scene/mesh.h"
#include "host/scene/oval.h"

static const double NUMBER_LARGEST = 1e30; // of scene files

// A mirroring transform inverts the winding; inverting it back keeps the triangles' outer side.
static bool mesh_transform(Mesh *mesh, const Affine *affine)
{
    const Affine for_normals = affine_for_normals(affine);
    bool fits = true;
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        mesh->vertices[i] = affine_point(affine, mesh->vertices[i]);
        fits &= vector_is_within(mesh->vertices[i], NUMBER_LARGEST);
        if (mesh->normals) mesh->normals[i] = affine_normal(&for_normals, mesh->normals[i]);
    }
    const bool is_mirrored = affine_determinant(affine) < 0;
    for (size_t i = 0; i < mesh->triangle_count && is_mirrored; i++) {
        uint32_t *corners = mesh->triangles[i], second = corners[1];
        corners[1] = corners[2];
        corners[2] = second;
    }
    return fits;
}

static bool triangle_transform(Object *object, const Affine *affine)
{
    affine_triangle(affine, object->as.triangle.vertices, object->as.triangle.normals);
    return true;
}

static bool instance_transform(const Mesh *mesh, Object *object, const Affine *affine)
{
    object->as.mesh.transform = affine_multiply(affine, &object->as.mesh.transform);
    const Bounds bounds = mesh_object_bounds(mesh, object);
    return vector_is_within(bounds.min, NUMBER_LARGEST) && vector_is_within(bounds.max, NUMBER_LARGEST);
}

static bool keeps_axes(const Affine *affine)
{
    for (int row = 0; row < 3; row++) {
        const double *m = affine->rows[row],
                     rounding = 1e-12 * fmax(fabs(m[0]), fmax(fabs(m[1]), fabs(m[2])));
        int count = 0;
        for (int column = 0; column < 3; column++)
            count += fabs(m[column]) > rounding;
        if (count != 1) return false;
    }
    return true;
}

static void box_make_mesh(Scene *scene, Object *object)
{
    static const uint32_t triangles[12][3] = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},
                                              {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                              {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    Mesh mesh = {.vertices = memory_allocate(8, sizeof *mesh.vertices),
                 .vertex_count = 8,
                 .triangles = memory_copy(triangles, 12, sizeof *triangles),
                 .triangle_count = 12};
    for (unsigned i = 0; i < 8; i++)
        mesh.vertices[i] = bounds_corner((Bounds){object->as.box.min, object->as.box.max}, i);
    object->type = SHAPE_MESH;
    object->as.mesh.index = (uint32_t)scene->meshes.count;
    array_push(scene->meshes, mesh);
}

// The functions below transform a shape. They return false, and change nothing, if it would no longer be one
// of its type, and leave numbers that object_transform checks.

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
    object->as.plane.normal = affine_normal(&for_normals, object->as.plane.normal);
    return true;
}

static bool disc_transform(Object *object, const Affine *affine)
{
    const Affine for_normals = affine_for_normals(affine);
    AxisScale scale;
    if (!affine_keeps_circles(affine, object->as.disc.normal, false, &scale)) return false;
    object->as.disc.center = affine_point(affine, object->as.disc.center);
    object->as.disc.normal = affine_normal(&for_normals, object->as.disc.normal);
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

// A 0 ends each list of offsets. Vectors and lengths must stay within the range, the axis different from 0,
// and `positive` lengths above 0.
static const struct {
    bool (*transform)(Object *object, const Affine *affine);
    size_t vectors[5], axis, positive[3], lengths[4];
} shapes[SHAPE_MESH] = {
    [SHAPE_SPHERE] = {sphere_transform, .vectors = {offsetof(Object, as.sphere.center)},
                      .positive = {offsetof(Object, as.sphere.radius)}},
    [SHAPE_PLANE] = {plane_transform, .vectors = {offsetof(Object, as.plane.point)}},
    [SHAPE_DISC] = {disc_transform, .vectors = {offsetof(Object, as.disc.center)},
                    .positive = {offsetof(Object, as.disc.radius)}},
    [SHAPE_BOX] = {box_transform, .vectors = {offsetof(Object, as.box.min), offsetof(Object, as.box.max)}},
    [SHAPE_CYLINDER] = {cylinder_transform,
                        .vectors = {offsetof(Object, as.cylinder.from), offsetof(Object, as.cylinder.axis)},
                        .axis = offsetof(Object, as.cylinder.axis),
                        .positive = {offsetof(Object, as.cylinder.radius)}},
    [SHAPE_CONE] = {cone_transform,
                    .vectors = {offsetof(Object, as.cone.from), offsetof(Object, as.cone.axis)},
                    .axis = offsetof(Object, as.cone.axis),
                    .lengths = {offsetof(Object, as.cone.radius[0]), offsetof(Object, as.cone.radius[1]),
                                offsetof(Object, as.cone.slope)}},
    [SHAPE_TRIANGLE] = {triangle_transform, .vectors = {offsetof(Object, as.triangle.vertices[0]),
                                                        offsetof(Object, as.triangle.vertices[1]),
                                                        offsetof(Object, as.triangle.vertices[2])}},
    [SHAPE_TORUS] = {torus_transform,
                     .vectors = {offsetof(Object, as.torus.center), offsetof(Object, as.torus.axis)},
                     .axis = offsetof(Object, as.torus.axis),
                     .positive = {offsetof(Object, as.torus.major), offsetof(Object, as.torus.minor)}},
    [SHAPE_PARABOLOID] = {paraboloid_transform,
                          .vectors = {offsetof(Object, as.paraboloid.apex),
                                      offsetof(Object, as.paraboloid.axis)},
                          .axis = offsetof(Object, as.paraboloid.axis),
                          .positive = {offsetof(Object, as.paraboloid.focal_length)},
                          .lengths = {offsetof(Object, as.paraboloid.height)}},
    [SHAPE_OVAL] = {oval_transform,
                    .vectors = {offsetof(Object, as.oval.center), offsetof(Object, as.oval.axes[0]),
                                offsetof(Object, as.oval.axes[1]), offsetof(Object, as.oval.axes[2])}},
};

// Return the member of an object at an offset.
static double number_at(const Object *object, size_t offset)
{
    return *(const double *)(const void *)((const char *)object + offset);
}

static Vector3 vector_at(const Object *object, size_t offset)
{
    return *(const Vector3 *)(const void *)((const char *)object + offset);
}

static bool numbers_fit(const Object *object)
{
    bool fits =
        shapes[object->type].axis == 0 || !vector_is_zero(vector_at(object, shapes[object->type].axis));
    for (const size_t *offset = shapes[object->type].vectors; *offset > 0; offset++)
        fits &= vector_is_within(vector_at(object, *offset), NUMBER_LARGEST);
    for (const size_t *offset = shapes[object->type].positive; *offset > 0; offset++)
        fits &= number_at(object, *offset) > 0 && number_at(object, *offset) <= NUMBER_LARGEST;
    for (const size_t *offset = shapes[object->type].lengths; *offset > 0; offset++)
        fits &= number_at(object, *offset) <= NUMBER_LARGEST;
    if (object->type != SHAPE_CONE) return fits;
    const double widest = object->as.cone.finite ? object->as.cone.radius[0] + object->as.cone.radius[1]
                                                 : object->as.cone.slope;
    return fits && widest > 0;
}

const char *object_transform(Scene *scene, Object *object, const Affine *affine)
{
    static const char *const out_of_range = "gets a size of 0 or a number beyond 1e30";
    if (object->type == SHAPE_BOX && !keeps_axes(affine)) box_make_mesh(scene, object);
    if (object->type == SHAPE_MESH) {
        Mesh *mesh = &scene->meshes.items[object->as.mesh.index];
        const bool fits = object->as.mesh.is_instance ? instance_transform(mesh, object, affine)
                                                      : mesh_transform(mesh, affine);
        return fits ? NULL : out_of_range;
    }
    if (!shapes[object->type].transform(object, affine)) {
        if (material_any_texture(&scene->materials.items[object->material]) > 0)
            return "with an image would change its shape, and then cannot have one";
        oval_make(object);
        oval_transform(object, affine);
    }
    if (!numbers_fit(object)) return out_of_range;
    return object->type != SHAPE_OVAL || oval_is_moderate(object)
               ? NULL
               : "gets thinner than a millionth of its length, or leans by more than 89.9 degrees";
}
