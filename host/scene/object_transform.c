#include "host/scene/object_transform.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/scene/mesh.h"
#include "host/scene/oval.h"
#include "host/scene/shape_members.h"

#include <string.h>

static const double NUMBER_LARGEST = 1e30; // of scene files

// Transforms a mesh's vertices and normals. Returns whether all vertices are within the range. A mirroring
// transform inverts the winding, and inverting it back keeps the triangles' outer side.
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
    memset(&object->as, 0, sizeof object->as);
    object->as.mesh.index = (uint32_t)scene->meshes.count;
    array_push(scene->meshes, mesh);
}

// Returns whether a shape stays one of its type, and sets the scale of one with an axis or a radius.
static bool keeps_type(const Object *object, const ShapeMembers *members, const Affine *affine,
                       AxisScale *scale)
{
    if (object->type == SHAPE_SPHERE || object->type == SHAPE_TORUS) return affine_keeps_balls(affine, scale);
    const bool is_straight = object->type != SHAPE_DISC;
    return !members->lengths[0] || affine_keeps_circles(affine, *members->directions[0], is_straight, scale);
}

// Transforms a shape other than a mesh. Returns false, and changes nothing, if it would no longer be one of
// its type. Leaves numbers that object_transform checks.
static bool shape_transform(Object *object, const Affine *affine)
{
    if (object->type == SHAPE_OVAL) {
        oval_transform(object, affine);
        return true;
    }
    const ShapeMembers members = shape_members(object);
    if (object->type == SHAPE_TRIANGLE) {
        affine_triangle(affine, object->as.triangle.vertices, object->as.triangle.normals);
        return true;
    }
    AxisScale scale = {0};
    if (!keeps_type(object, &members, affine, &scale)) return false;
    for (Vector3 *const *point = members.points; *point; point++)
        **point = affine_point(affine, **point);
    box_order(object);
    const bool is_normal = object->type == SHAPE_PLANE || object->type == SHAPE_DISC;
    const Affine for_normals = affine_for_normals(affine);
    for (Vector3 *const *direction = members.directions; *direction; direction++)
        **direction =
            is_normal ? affine_normal(&for_normals, **direction) : affine_direction(affine, **direction);
    const double along = vector_length(scale.along);
    double factors[] = {scale.across, scale.across};
    if (object->type == SHAPE_CONE) object->as.cone.slope *= scale.across / along;
    if (object->type == SHAPE_PARABOLOID) { // whose radius r at the height h is r^2 = 4 f h
        factors[0] = scale.across / along * scale.across;
        factors[1] = along;
    }
    for (size_t i = 0; members.lengths[i]; i++)
        *members.lengths[i] *= factors[i];
    return true;
}

// Returns whether all numbers of a shape are within the range, and those above 0 that must be.
static bool shape_fits(Object *object)
{
    const ShapeMembers members = shape_members(object);
    const bool is_cone = object->type == SHAPE_CONE;
    bool fits =
        object->type == SHAPE_TRIANGLE || !members.directions[0] || !vector_is_zero(*members.directions[0]);
    for (Vector3 *const *point = members.points; *point; point++)
        fits &= vector_is_within(**point, NUMBER_LARGEST);
    for (Vector3 *const *direction = members.directions; *direction; direction++)
        fits &= vector_is_within(**direction, NUMBER_LARGEST);
    for (size_t i = 0; members.lengths[i]; i++) {
        const bool may_be_zero = is_cone || (object->type == SHAPE_PARABOLOID && i == 1);
        fits &= *members.lengths[i] <= NUMBER_LARGEST && (may_be_zero || *members.lengths[i] > 0);
    }
    if (!is_cone) return fits;
    const double slope = object->as.cone.slope,
                 widest =
                     object->as.cone.finite ? object->as.cone.radius[0] + object->as.cone.radius[1] : slope;
    return fits && slope <= NUMBER_LARGEST && widest > 0;
}

const char *object_transform(Scene *scene, Object *object, const Affine *affine)
{
    static const char *const out_of_range = "would have a size of 0 or numbers above 1e30";
    if (object->type == SHAPE_BOX && !keeps_axes(affine)) box_make_mesh(scene, object);
    if (object->type == SHAPE_MESH) {
        Mesh *mesh = &scene->meshes.items[object->as.mesh.index];
        const bool fits = object->as.mesh.is_instance ? instance_transform(mesh, object, affine)
                                                      : mesh_transform(mesh, affine);
        return fits ? NULL : out_of_range;
    }
    if (!shape_transform(object, affine)) {
        if (material_any_texture(&scene->materials.items[object->material]) > 0)
            return "would become an oval, which cannot have an image";
        oval_make(object);
        oval_transform(object, affine);
    }
    if (!shape_fits(object)) return out_of_range;
    const ShapeMembers members = shape_members(object);
    return object->type == SHAPE_TRIANGLE || !members.directions[2] || axes_are_moderate(*members.directions)
               ? NULL
               : "would be thinner than a millionth of its length or lean by more than 89.9 degrees";
}
