#include "host/compile/shapes.h"
#include "host/compile/texture_mapping.h"

static bool disc_bounds(const Scene *scene, const Object *object, Bounds *bounds)
{
    (void)scene;
    *bounds = bounds_of_disc(object->as.disc.center, object->as.disc.normal, object->as.disc.radius);
    return true;
}

static void disc_flatten(Flattening *flattening, const Object *object)
{
    const Vector3 normal = object->as.disc.normal;
    const Vector3 center = point_from_eye(&flattening->rounding, object->as.disc.center);
    Disc disc = {.center_radius = scalar4_of(center, object->as.disc.radius),
                 .normal = normal_and_inverse_length(&flattening->rounding, normal)};
    surface_grid(flattening, object->material, normal, &disc.grid_u, &disc.grid_v);
    primitive_add(flattening, KIND_DISCS, &disc, object->material);
}

static BoundingSphere disc_bounding_sphere(const void *primitive)
{
    const Disc *disc = primitive;
    return (BoundingSphere){vector3_of(&disc->center_radius), disc->center_radius.w};
}

// Those of its bounding sphere: where the ray lies nearly in its plane, t is uncertain by as much.
static bool disc_primitive_bounds(const void *primitive, Bounds *bounds)
{
    const Disc *disc = primitive;
    *bounds = bounds_around(vector3_of(&disc->center_radius), vector_all(disc->center_radius.w));
    return true;
}

static void disc_plane(const void *primitive, Vector3 *point, Vector3 *normal)
{
    const Disc *disc = primitive;
    *point = vector3_of(&disc->center_radius);
    *normal = vector3_of(&disc->normal);
}

static void disc_randomize(RandomShape *made, unsigned form, Random *random)
{
    (void)form, (void)random;
    made->object.as.disc.center = made->center;
    made->object.as.disc.normal = made->axis;
    made->object.as.disc.radius = made->radius;
}

const ShapeOps disc_ops = {
    .kind = KIND_DISCS,
    .vectors = {offsetof(Object, as.disc.center), offsetof(Object, as.disc.normal)},
    .lengths = {offsetof(Object, as.disc.radius)},
    .bounds = disc_bounds,
    .flatten = disc_flatten,
    .forms = {"disc"},
    .randomize = disc_randomize,
    .primitive_bounds = disc_primitive_bounds,
    .bounding_sphere = disc_bounding_sphere,
    .plane = disc_plane,
    .test_flops = 14,
};
