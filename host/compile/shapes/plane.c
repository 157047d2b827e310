#include "host/compile/shapes.h"
#include "host/compile/texture_mapping.h"

static void plane_flatten(Flattening *flattening, const Object *object)
{
    const Vector3 normal = object->as.plane.normal;
    const Vector3 point = plane_point_from_eye(&flattening->rounding, object->as.plane.point, normal);
    Plane plane = {.point = scalar4_of(point, 0),
                   .normal = normal_and_inverse_length(&flattening->rounding, normal)};
    surface_grid(flattening, object->material, normal, &plane.grid_u, &plane.grid_v);
    primitive_add(flattening, TYPE_PLANES, &plane, object->material);
}

static void plane_plane(const void *primitive, Vector3 *point, Vector3 *normal)
{
    const Plane *plane = primitive;
    *point = vector3_of(&plane->point);
    *normal = vector3_of(&plane->normal);
}

static double plane_largest_coordinate(const void *primitive)
{
    const Plane *plane = primitive;
    return fabs(vector_dot(vector_normalize(vector3_of(&plane->normal)), vector3_of(&plane->point)));
}

const ShapeOps plane_ops = {
    .flatten = plane_flatten,
    .plane = plane_plane,
    .largest_coordinate = plane_largest_coordinate,
};
