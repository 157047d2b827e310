#include "host/compile/shapes.h"
#include <float.h>

#define SHAPE_DECLARE(feature, Type, name, names) extern const ShapeOps name##_ops;
SHAPE_LIST(SHAPE_DECLARE)
extern const ShapeOps mesh_ops;

#define SHAPE_ROW(feature, Type, name, names) [TYPE_##feature] = &name##_ops,
const ShapeOps *const shape_ops[SHAPE_COUNT] = {SHAPE_LIST(SHAPE_ROW)[SHAPE_MESH] = &mesh_ops};
_Static_assert((int)SHAPE_MESH == (int)TYPE_INSTANCES && TYPE_INSTANCES + 1 == TYPE_COUNT,
               "ShapeKind follows PRIMITIVE_LIST: a mesh, which is last, may be an instance");

bool primitive_bounds(size_t type, const void *primitive, Bounds *bounds)
{
    return shape_ops[type]->primitive_bounds && shape_ops[type]->primitive_bounds(primitive, bounds);
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
    Bounds box;
    if (!primitive_bounds(type, primitive, &box)) return (BoundingSphere){.radius = INFINITY};
    return box_bounding_sphere(&box);
}
