#include "host/compile/shapes.h"

static Bounds torus_bounds(const Object *object)
{
    return bounds_grow(bounds_of_disc(object->as.torus.center, object->as.torus.axis, object->as.torus.major),
                       object->as.torus.minor);
}

// A torus relative to the eye: the eye's distance from the axis and the unit direction away from it, and
// from the circle's nearest point to the eye the parts along that and along the axis.
typedef struct {
    Quad3 radial;
    Quad rho, outward, height;
} TorusFromEye;

static TorusFromEye torus_from_eye(Quad3 center, Quad3 unit_axis, Quad major)
{
    TorusFromEye relative = {.height = -quad3_dot(center, unit_axis)};
    const Quad3 across = quad3_scale(quad3_add(center, quad3_scale(unit_axis, relative.height)), -1);
    relative.rho = quad3_length(across);
    relative.radial =
        relative.rho > 0 ? quad3_scale(across, 1 / relative.rho) : quad3_perpendicular(unit_axis);
    relative.outward = relative.rho - major;
    return relative;
}

static Quad torus_gap(const TorusFromEye *relative, Quad minor)
{
    const Quad squared = relative->outward * relative->outward + relative->height * relative->height;
    return (squared - minor * minor) / (quad_root(squared) + minor);
}

// Lets the eye's power define a torus that is near the eye for its size. The ray's closest approach to the
// center, where the other form starts, is off by some roundings of that size, whether or not they move the
// torus itself.
static void torus_set_power(Torus *torus, Flattening *flattening, const Object *object)
{
    const Rounding *rounding = &flattening->rounding;
    const Quad minor = object->as.torus.minor;
    const TorusFromEye exact =
        torus_from_eye(exact_from_eye(rounding, object->as.torus.center),
                       quad3_unit(quad3(object->as.torus.axis)), object->as.torus.major);
    const Quad gap = torus_gap(&exact, minor), size = object->as.torus.major + object->as.torus.minor;
    if (!rounding->has_eye || !(quad_absolute(gap) < size)) return;
    const Quad squared = exact.outward * exact.outward + exact.height * exact.height;
    if (!primitive_set_power(flattening, (double)((squared - minor * minor) / (2 * minor)), &torus->id))
        return;
    const Quad3 from_circle = quad3_add(quad3_scale(exact.radial, exact.outward),
                                        quad3_scale(quad3_unit(quad3(object->as.torus.axis)), exact.height));
    torus->gradient = scalar4_of(vector_rounded(rounding, quad3_rounded(quad3_scale(from_circle, 1 / minor))),
                                 (double)(exact.outward / minor));
    torus->radial = scalar4_of(vector_rounded(rounding, quad3_rounded(exact.radial)), (double)exact.rho);
}

static void torus_flatten(Flattening *flattening, const Object *object)
{
    const Vector3 center = point_from_eye(&flattening->rounding, object->as.torus.center);
    Torus torus = {
        .center_major = scalar4_of(center, object->as.torus.major),
        .axis_minor = scalar4_of(vector_normalize(object->as.torus.axis), object->as.torus.minor),
    };
    torus_set_power(&torus, flattening, object);
    primitive_add(flattening, TYPE_TORI, &torus, object->material);
}

static Bounds torus_primitive_bounds(const void *primitive)
{
    const Torus *torus = primitive;
    Vector3 half_extents =
        vector_scale(circle_half_extents(vector3_of(&torus->axis_minor)), torus->center_major.w);
    return bounds_around(vector3_of(&torus->center_major),
                         vector_add(half_extents, vector_all(torus->axis_minor.w)));
}

static BoundingSphere torus_bounding_sphere(const void *primitive)
{
    const Torus *torus = primitive;
    return (BoundingSphere){vector3_of(&torus->center_major), torus->center_major.w + torus->axis_minor.w};
}

const ShapeOps torus_ops = {
    .bounds = torus_bounds,
    .flatten = torus_flatten,
    .primitive_bounds = torus_primitive_bounds,
    .bounding_sphere = torus_bounding_sphere,
};
