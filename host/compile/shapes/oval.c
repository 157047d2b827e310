#include "host/scene/oval.h"
#include "host/compile/instances.h"
#include "host/compile/shapes.h"

// Returns half the size of the box around the oval. In its space, the sum of a ball, a disc across z and a
// line along z contains the unit shape.
static Vector3 oval_half_extents(const Object *object)
{
    const double *radii = object->as.oval.radii;
    const Affine map = oval_map(object);
    double ball = 0, disc = 1, line = 0, half[3];
    if (object->as.oval.unit == SHAPE_SPHERE) ball = 1, disc = 0;
    if (object->as.oval.unit == SHAPE_TORUS) ball = radii[1], disc = radii[0];
    if (object->as.oval.finite) line = object->as.oval.half_height;
    for (int i = 0; i < 3; i++) {
        const double *row = map.rows[i];
        half[i] =
            ball * vector_length(vector_from(row)) + disc * hypotenuse(row[0], row[1]) + line * fabs(row[2]);
    }
    return (Vector3){half[0], half[1], half[2]};
}

static Bounds oval_bounds(const Object *object)
{
    if (!oval_is_bounded(object)) return bounds_everywhere();
    return bounds_around(object->as.oval.center, oval_half_extents(object));
}

static void oval_flatten(Flattening *flattening, const Object *object)
{
    const Rounding *rounding = &flattening->rounding;
    const Affine transform = oval_map(object);
    const Vector3 center = point_from_eye(rounding, object->as.oval.center);
    const double *radii = object->as.oval.radii, half_height = object->as.oval.half_height;
    const bool is_bounded = oval_is_bounded(object);
    double shortest, longest;
    int exponent;
    oval_stretches(object, &shortest, &longest);
    frexp(longest, &exponent);
    const double unit = ldexp(1, exponent);
    const InstanceMap map = instance_map(&transform, unit, true);
    const double condition = map_condition(&map);
    Vector3 half = is_bounded ? oval_half_extents(object) : (Vector3){0, 0, 0};
    const double reach = is_bounded ? vector_length(half) : unit;
    // the hits of mapped rays lie in the box (docs/numerics.md)
    if (is_bounded)
        half = vector_add(half, vector_all(8 * (8 + 3 * condition) * roundoff_of(rounding) * reach));
    Oval oval = {
        .extent = scalar4_of(half, condition),
        .sizes = {unit, 0, 0, half_height * unit},
        .id.y = (object->as.oval.finite ? REVOLUTION_FINITE : 0u) |
                (object->as.oval.caps ? REVOLUTION_CAPPED : 0u),
        .id.z = object->as.oval.unit,
    };
    map_round(rounding, &map, (const double[]){center.x, center.y, center.z}, oval.rows, oval.inverses);
    oval.inverses[0].w = unit / shortest * (1 + 1e-6); // more than the roundings
    oval.inverses[1].w = reach;
    if (object->as.oval.unit == SHAPE_TORUS) {
        oval.sizes.y = radii[0] * unit;
        oval.sizes.z = radii[1] * unit;
    } else if (object->as.oval.unit == SHAPE_CONE) {
        oval.sizes.y = radii[0] * unit;
        oval.sizes.z =
            object->as.oval.finite ? (radii[1] - radii[0]) / (2 * half_height) : object->as.oval.rise;
    } else if (object->as.oval.unit == SHAPE_PARABOLOID) {
        oval.sizes.y = unit * (object->as.oval.finite ? 0.5 / half_height : object->as.oval.rise);
    }
    primitive_add(flattening, TYPE_OVALS, &oval, object->material);
}

static Bounds oval_primitive_bounds(const void *primitive)
{
    const Oval *oval = primitive;
    const Vector3 half = vector3_of(&oval->extent);
    if (vector_is_zero(half)) return bounds_everywhere();
    return bounds_around((Vector3){oval->rows[0].w, oval->rows[1].w, oval->rows[2].w}, half);
}

static double oval_largest_coordinate(const void *primitive)
{
    const Oval *oval = primitive;
    return vector_largest((Vector3){oval->rows[0].w, oval->rows[1].w, oval->rows[2].w}) + oval->sizes.x;
}

static double oval_condition(const void *primitive)
{
    const Oval *oval = primitive;
    return oval->extent.w;
}

// In the unit shape's space distances are up to twice the inverse's norm times as large, and not smaller.
static double oval_stretch(const void *primitive)
{
    const Oval *oval = primitive;
    return 2 * oval->inverses[0].w;
}

const ShapeOps oval_ops = {
    .bounds = oval_bounds,
    .flatten = oval_flatten,
    .primitive_bounds = oval_primitive_bounds,
    .largest_coordinate = oval_largest_coordinate,
    .condition = oval_condition,
    .stretch = oval_stretch,
};
