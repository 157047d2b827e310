#include "host/compile/shapes.h"

static Bounds box_bounds(const Object *object)
{
    return (Bounds){object->as.box.min, object->as.box.max};
}

static void box_flatten(Flattening *flattening, const Object *object)
{
    const Box box = {.low = scalar4_of(point_from_eye(&flattening->rounding, object->as.box.min), 0),
                     .high = scalar4_of(point_from_eye(&flattening->rounding, object->as.box.max), 0)};
    primitive_add(flattening, TYPE_BOXES, &box, object->material);
}

static Bounds box_primitive_bounds(const void *primitive)
{
    const Box *box = primitive;
    return (Bounds){vector3_of(&box->low), vector3_of(&box->high)};
}

const ShapeOps box_ops = {
    .bounds = box_bounds,
    .flatten = box_flatten,
    .primitive_bounds = box_primitive_bounds,
};
