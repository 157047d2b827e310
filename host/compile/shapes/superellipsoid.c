#include "host/compile/shapes.h"

// Bounds how far the shape reaches along a direction, where the axes have these parts. It is the parts' norm
// whose exponent is dual to that of the shape, which is at most the mean of their length and their sum,
// weighted with 2 / exponent (Lyapunov), exactly so for ellipsoids and for axes along the direction.
static double superellipsoid_extent(double x, double y, double z, double exponent)
{
    const double length = vector_length((Vector3){x, y, z}), sum = fabs(x) + fabs(y) + fabs(z);
    return length + (1 - 2 / exponent) * (sum - length);
}

// Returns half of the box.
static Vector3 superellipsoid_half_extents(const Object *object)
{
    const Vector3 *axes = object->as.superellipsoid.axes;
    const double exponent = object->as.superellipsoid.exponent;
    return (Vector3){superellipsoid_extent(axes[0].x, axes[1].x, axes[2].x, exponent),
                     superellipsoid_extent(axes[0].y, axes[1].y, axes[2].y, exponent),
                     superellipsoid_extent(axes[0].z, axes[1].z, axes[2].z, exponent)};
}

static Bounds superellipsoid_bounds(const Object *object)
{
    return bounds_around(object->as.superellipsoid.center, superellipsoid_half_extents(object));
}

static void superellipsoid_flatten(Flattening *flattening, const Object *object)
{
    const Rounding *rounding = &flattening->rounding;
    const Vector3 *axes = object->as.superellipsoid.axes;
    const double few = 8 * roundoff_of(rounding), above = 1 + few; // more than the roundings of a length
    Vector3 half = vector_scale(superellipsoid_half_extents(object), above);
    const double radius = vector_length(half) * above;
    Superellipsoid shape = {
        .center = scalar4_of(point_from_eye(rounding, object->as.superellipsoid.center), radius),
        .id.y = (uint32_t)object->as.superellipsoid.exponent,
    };
    double condition = 0; // roundings of q move the surface by this times the radius
    for (int i = 0; i < 3; i++) {
        const Quad3 cross = quad3_cross(quad3(axes[(i + 1) % 3]), quad3(axes[(i + 2) % 3]));
        const Quad3 row = quad3_scale(cross, 1 / quad3_dot(quad3(axes[i]), cross));
        const double length = (double)quad3_length(row);
        condition += length * vector_length(axes[i]);
        shape.rows[i] = scalar4_of(vector_rounded(rounding, quad3_rounded(row)), length * above);
    }
    // Hits lie in the box: the roundings of q move them by less than 7 u times this, and those of f by less
    // than u.
    half = vector_add(half, vector_all(few * condition * radius));
    shape.extent = scalar4_of(half, 0.5 * condition * radius);
    primitive_add(flattening, TYPE_SUPERELLIPSOIDS, &shape, object->material);
}

static Bounds superellipsoid_primitive_bounds(const void *primitive)
{
    const Superellipsoid *shape = primitive;
    return bounds_around(vector3_of(&shape->center), vector3_of(&shape->extent));
}

static double superellipsoid_condition(const void *primitive)
{
    const Superellipsoid *shape = primitive;
    return 2 * shape->extent.w / shape->center.w;
}

// The powers of coordinates in range may be infinite, which is above 1 like the coordinate, or 0.
static double superellipsoid_stretch(const void *primitive)
{
    const Superellipsoid *shape = primitive;
    return fmax(shape->rows[0].w, fmax(shape->rows[1].w, shape->rows[2].w));
}

const ShapeOps superellipsoid_ops = {
    .bounds = superellipsoid_bounds,
    .flatten = superellipsoid_flatten,
    .primitive_bounds = superellipsoid_primitive_bounds,
    .condition = superellipsoid_condition,
    .stretch = superellipsoid_stretch,
};
