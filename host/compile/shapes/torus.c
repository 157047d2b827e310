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
    Vector3 half_extents =
        vector_scale(circle_half_extents(vector3_of(&torus->axis_minor)), torus->center_major.w);
    *bounds = bounds_around(vector3_of(&torus->center_major),
                            vector_add(half_extents, vector_all(torus->axis_minor.w)));
    return true;
}

static BoundingSphere torus_bounding_sphere(const void *primitive)
{
    const Torus *torus = primitive;
    return (BoundingSphere){vector3_of(&torus->center_major), torus->center_major.w + torus->axis_minor.w};
}

enum { TORUS, TORUS_THIN, TORUS_FAT, TORUS_SPINDLE };

// The tube of a spindle torus is wider than its circle: it has no hole. Half of them are aligned with a world
// axis.
static void torus_randomize(RandomShape *made, unsigned form, Random *random)
{
    const double major = made->radius;
    double minor = major * random_between(random, 0.1, 0.6);
    if (form == TORUS_THIN) minor = major * 0.01;
    if (form == TORUS_FAT) minor = major * 0.9;
    if (form == TORUS_SPINDLE) minor = major * random_between(random, 1.1, 3);
    made->axis = random_coin(random) ? random_world_axis(random) : vector_on_grid(random_unit_vector(random));
    made->object.as.torus.center = made->center;
    made->object.as.torus.axis = made->axis;
    made->object.as.torus.major = major;
    made->object.as.torus.minor = minor;
    made->radius = major + minor;
}

const ShapeOps torus_ops = {
    .kind = KIND_TORI,
    .vectors = {offsetof(Object, as.torus.center), offsetof(Object, as.torus.axis)},
    .lengths = {offsetof(Object, as.torus.major), offsetof(Object, as.torus.minor)},
    .bounds = torus_bounds,
    .flatten = torus_flatten,
    .forms = {"torus", "thin torus", "fat torus", "spindle torus"},
    .randomize = torus_randomize,
    .primitive_bounds = torus_primitive_bounds,
    .bounding_sphere = torus_bounding_sphere,
    .test_flops = 60,
};
