#include "host/compile/shapes.h"

static bool torus_bounds(const Scene *scene, const Object *object, Bounds *bounds)
{
    (void)scene;
    *bounds =
        bounds_grow(bounds_of_disc(object->as.torus.center, object->as.torus.axis, object->as.torus.major),
                    object->as.torus.minor);
    return true;
}

static void torus_flatten(Flattening *flattening, const Object *object)
{
    const Vector3 center = point_from_eye(&flattening->rounding, object->as.torus.center);
    const Torus torus = {
        .center_major = scalar4_of(center, object->as.torus.major),
        .axis_minor = scalar4_of(vector_normalize(object->as.torus.axis), object->as.torus.minor),
    };
    primitive_add(flattening, KIND_TORI, &torus, object->material);
}

static bool torus_primitive_bounds(const void *primitive, Bounds *bounds)
{
    const Torus *torus = primitive;
    Vector3 reach = vector_scale(circle_reach(vector3_of(&torus->axis_minor)), torus->center_major.w);
    *bounds =
        bounds_around(vector3_of(&torus->center_major), vector_add(reach, vector_all(torus->axis_minor.w)));
    return true;
}

static BoundingSphere torus_bounding_sphere(const void *primitive)
{
    const Torus *torus = primitive;
    return (BoundingSphere){vector3_of(&torus->center_major), torus->center_major.w + torus->axis_minor.w};
}

const ShapeOps torus_ops = {
    .kind = KIND_TORI,
    .vectors = {offsetof(Object, as.torus.center), offsetof(Object, as.torus.axis)},
    .lengths = {offsetof(Object, as.torus.major), offsetof(Object, as.torus.minor)},
    .bounds = torus_bounds,
    .flatten = torus_flatten,
    .primitive_bounds = torus_primitive_bounds,
    .bounding_sphere = torus_bounding_sphere,
    .test_flops = 60,
};
