#include "host/compile/shapes.h"
#include "host/scene/mesh.h"
#include <float.h>

#define SHAPE_DECLARE(feature, Type, name, names) extern const ShapeOps name##_ops;
SHAPE_LIST(SHAPE_DECLARE)
extern const ShapeOps mesh_ops;

#define SHAPE_ROW(feature, Type, name, names) [TYPE_##feature] = &name##_ops,
const ShapeOps *const shape_ops[SHAPE_COUNT] = {SHAPE_LIST(SHAPE_ROW)[SHAPE_MESH] = &mesh_ops};
_Static_assert((int)SHAPE_MESH == (int)TYPE_INSTANCES && TYPE_INSTANCES + 1 == TYPE_COUNT,
               "ShapeType follows PRIMITIVE_LIST, whose last type is that of meshes and instances");

Bounds object_bounds(const Scene *scene, const Object *object)
{
    if (object->type == SHAPE_MESH)
        return mesh_object_bounds(&scene->meshes.items[object->as.mesh.index], object);
    const ShapeOps *shape = shape_ops[object->type];
    return shape->bounds ? shape->bounds(object) : bounds_everywhere();
}

Bounds primitive_bounds(size_t type, const void *primitive)
{
    const ShapeOps *shape = shape_ops[type];
    if (shape->primitive_bounds) return shape->primitive_bounds(primitive);
    if (!shape->bounding_sphere) return bounds_everywhere();
    const BoundingSphere sphere = shape->bounding_sphere(primitive);
    return bounds_around(sphere.center, vector_all(sphere.radius));
}

BoundingSphere box_bounding_sphere(const Bounds *box)
{
    Vector3 half = vector_scale(vector_subtract(box->max, box->min), 0.5);
    double roundings = 4 * DBL_EPSILON * (vector_length(box->min) + vector_length(box->max));
    return (BoundingSphere){vector_add(box->min, half), vector_length(half) + roundings};
}

BoundingSphere primitive_bounding_sphere(size_t type, const void *primitive)
{
    if (shape_ops[type]->bounding_sphere) return shape_ops[type]->bounding_sphere(primitive);
    const Bounds box = primitive_bounds(type, primitive);
    return bounds_is_everywhere(&box) ? (BoundingSphere){.radius = INFINITY} : box_bounding_sphere(&box);
}

double primitive_reach(size_t type, const void *primitive)
{
    const Bounds box = primitive_bounds(type, primitive);
    return bounds_is_everywhere(&box) ? shape_ops[type]->largest_coordinate(primitive)
                                      : fmax(vector_largest(box.min), vector_largest(box.max));
}
