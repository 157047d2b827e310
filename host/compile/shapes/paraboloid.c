#include "host/compile/shapes.h"

// A paraboloid relative to the eye: its axis' nearest point, that point's height above the apex, and how
// far the eye is from the unbounded side, to first order, and below the end.
typedef struct {
    Quad3 foot;
    Quad lift, outside, below_end;
} ParaboloidFromEye;

static ParaboloidFromEye paraboloid_from_eye(Quad3 apex, Quad3 unit_axis, Quad focal_length, Quad height)
{
    ParaboloidFromEye relative = {.lift = -quad3_dot(apex, unit_axis)};
    relative.foot = quad3_add(apex, quad3_scale(unit_axis, relative.lift));
    const Quad squared = quad3_dot(relative.foot, relative.foot);
    relative.outside = (squared - 4 * focal_length * relative.lift) /
                       (2 * quad_root(squared + 4 * focal_length * focal_length));
    relative.below_end = height - relative.lift;
    return relative;
}

// Returns whether rounding moves the side or the end by more than 2 roundings of its distance from the eye.
static bool paraboloid_moves(const Rounding *rounding, const Object *object, const Paraboloid *stored,
                             const ParaboloidFromEye *exact)
{
    const Quad3 axis = quad3(vector3_of(&stored->axis_end));
    const Quad length = quad3_length(axis), focal_length = rounded(rounding, stored->apex_k.w) / (4 * length);
    const ParaboloidFromEye stored_from_eye =
        paraboloid_from_eye(quad3(vector3_of(&stored->apex_k)), quad3_scale(axis, 1 / length), focal_length,
                            rounded(rounding, stored->axis_end.w) / length);
    const double tolerance = 2 * roundoff_of(rounding), below = (double)exact->below_end;
    const double beyond = object->as.paraboloid.finite ? fmax(-below, 0) : 0;
    const double side = fabs((double)(stored_from_eye.outside - exact->outside));
    if (!(side <= tolerance * hypotenuse((double)exact->outside, beyond)))
        return true; // or it is not a number
    if (!object->as.paraboloid.finite) return false;
    const double rim = 2 * sqrt(object->as.paraboloid.focal_length * object->as.paraboloid.height),
                 from_rim = (double)quad3_length(exact->foot) - rim;
    const double across = object->as.paraboloid.caps ? fmax(from_rim, 0) : from_rim;
    return fabs((double)(stored_from_eye.below_end - exact->below_end)) >
           tolerance * hypotenuse(below, across);
}

// Lets the eye's power define the paraboloid if rounding matters.
static void paraboloid_set_power(Paraboloid *shape, Flattening *flattening, const Object *object)
{
    const Rounding *rounding = &flattening->rounding;
    const Quad focal_length = object->as.paraboloid.focal_length;
    const bool finite = object->as.paraboloid.finite;
    const ParaboloidFromEye exact = paraboloid_from_eye(exact_from_eye(rounding, object->as.paraboloid.apex),
                                                        quad3_unit(quad3(object->as.paraboloid.axis)),
                                                        focal_length, object->as.paraboloid.height);
    if (!paraboloid_moves(rounding, object, shape, &exact)) return;
    const Quad3 axis = quad3(vector3_of(&shape->axis_end));
    const Quad squared = quad3_dot(axis, axis), length = quad_root(squared);
    const Quad power = squared * (quad3_dot(exact.foot, exact.foot) - 4 * focal_length * exact.lift);
    if (!primitive_set_power(flattening, (double)power, &shape->id)) return;
    shape->foot_lift =
        scalar4_of(vector_rounded(rounding, quad3_rounded(exact.foot)), (double)(exact.lift * length));
    shape->axis_end.w = finite ? (double)(exact.below_end * length) : 0;
}

static void paraboloid_flatten(Flattening *flattening, const Object *object)
{
    const Rounding *rounding = &flattening->rounding;
    const Vector3 axis = vector_rounded(rounding, axis_scaled(object->as.paraboloid.axis));
    const double length = vector_length(axis);
    const bool finite = object->as.paraboloid.finite;
    Paraboloid paraboloid = {
        .apex_k = scalar4_of(point_from_eye(rounding, object->as.paraboloid.apex),
                             4 * length * rounded(rounding, object->as.paraboloid.focal_length)),
        .axis_end = scalar4_of(axis, finite ? length * rounded(rounding, object->as.paraboloid.height) : 0),
        .id.y = (finite ? REVOLUTION_FINITE : 0u) |
                (finite && object->as.paraboloid.caps ? REVOLUTION_CAPPED : 0u),
    };
    paraboloid_set_power(&paraboloid, flattening, object);
    primitive_add(flattening, TYPE_PARABOLOIDS, &paraboloid, object->material);
}

// Returns how far the shape reaches in a direction with the parts `along` and `across` the unit axis: to the
// rim, or to where the side is square to the direction, at the height focal_length across^2 / along^2.
static double paraboloid_extent(double along, double across, double focal_length, double height)
{
    const double square = along < 0 ? focal_length * (across / along) * (across / along) : height;
    const double z = fmin(height, square);
    return along * z + 2 * across * sqrt(focal_length * z);
}

static Bounds paraboloid_bounds_of(Vector3 apex, Vector3 axis, double focal_length, double height)
{
    const Vector3 along = vector_normalize(axis), across = circle_half_extents(along);
    const double f = focal_length, h = height;
    const Vector3 above = {paraboloid_extent(along.x, across.x, f, h),
                           paraboloid_extent(along.y, across.y, f, h),
                           paraboloid_extent(along.z, across.z, f, h)};
    const Vector3 below = {paraboloid_extent(-along.x, across.x, f, h),
                           paraboloid_extent(-along.y, across.y, f, h),
                           paraboloid_extent(-along.z, across.z, f, h)};
    return (Bounds){vector_subtract(apex, below), vector_add(apex, above)};
}

static Bounds paraboloid_bounds(const Object *object)
{
    if (!object->as.paraboloid.finite) return bounds_everywhere();
    return paraboloid_bounds_of(object->as.paraboloid.apex, object->as.paraboloid.axis,
                                object->as.paraboloid.focal_length, object->as.paraboloid.height);
}

static Bounds paraboloid_primitive_bounds(const void *primitive)
{
    const Paraboloid *shape = primitive;
    const Vector3 axis = vector3_of(&shape->axis_end);
    const double length = vector_length(axis);
    if (!(shape->id.y & REVOLUTION_FINITE)) return bounds_everywhere();
    return paraboloid_bounds_of(vector3_of(&shape->apex_k), axis, shape->apex_k.w / (4 * length),
                                (shape->axis_end.w + shape->foot_lift.w) / length);
}

static double paraboloid_largest_coordinate(const void *primitive)
{
    const Paraboloid *shape = primitive;
    return vector_largest(vector3_of(&shape->apex_k)) + shape->apex_k.w;
}

const ShapeOps paraboloid_ops = {
    .bounds = paraboloid_bounds,
    .flatten = paraboloid_flatten,
    .primitive_bounds = paraboloid_primitive_bounds,
    .largest_coordinate = paraboloid_largest_coordinate,
};
