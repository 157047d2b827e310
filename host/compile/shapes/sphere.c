#include "host/compile/shapes.h"

static bool sphere_bounds(const Scene *scene, const Object *object, Bounds *bounds)
{
    (void)scene;
    *bounds = bounds_around(object->as.sphere.center, vector_all(object->as.sphere.radius));
    return true;
}

static void sphere_flatten(Flattening *flattening, const Object *object)
{
    const Vector3 center = point_from_eye(&flattening->rounding, object->as.sphere.center);
    const Sphere sphere = {.center_radius = scalar4_of(center, object->as.sphere.radius),
                           .id.y = object->as.sphere.only_inside ? IGNORES_FRONT_FACES : 0u};
    primitive_add(flattening, KIND_SPHERES, &sphere, object->material);
}

static BoundingSphere sphere_bounding_sphere(const void *primitive)
{
    const Sphere *sphere = primitive;
    return (BoundingSphere){vector3_of(&sphere->center_radius), sphere->center_radius.w};
}

static bool sphere_primitive_bounds(const void *primitive, Bounds *bounds)
{
    const Sphere *sphere = primitive;
    *bounds = bounds_around(vector3_of(&sphere->center_radius), vector_all(sphere->center_radius.w));
    return true;
}

static void sphere_randomize(RandomShape *made, unsigned form, Random *random)
{
    (void)form, (void)random;
    made->object.as.sphere.center = made->center;
    made->object.as.sphere.radius = made->radius;
}

const ShapeOps sphere_ops = {
    .kind = KIND_SPHERES,
    .vectors = {offsetof(Object, as.sphere.center)},
    .lengths = {offsetof(Object, as.sphere.radius)},
    .bounds = sphere_bounds,
    .flatten = sphere_flatten,
    .forms = {"sphere"},
    .randomize = sphere_randomize,
    .primitive_bounds = sphere_primitive_bounds,
    .bounding_sphere = sphere_bounding_sphere,
    .test_flops = 17,
};
