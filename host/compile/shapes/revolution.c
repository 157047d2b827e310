// Cylinders and cones.
#include "host/compile/shapes.h"

// A cylinder or cone as the scene has it. If it is infinite, its radius grows by the slope from `from` on.
typedef struct {
    Vector3 from, axis;
    double base_radius, end_radius, infinite_slope;
    bool finite, caps, only_inside;
} RevolutionGiven;

static RevolutionGiven revolution_given(const Object *object)
{
    if (object->type == SHAPE_CYLINDER)
        return (RevolutionGiven){.from = object->as.cylinder.from,
                                 .axis = object->as.cylinder.axis,
                                 .base_radius = object->as.cylinder.radius,
                                 .end_radius = object->as.cylinder.radius,
                                 .finite = object->as.cylinder.finite,
                                 .caps = object->as.cylinder.caps,
                                 .only_inside = object->as.cylinder.only_inside};
    const bool finite = object->as.cone.finite;
    return (RevolutionGiven){.from = object->as.cone.from,
                             .axis = object->as.cone.axis,
                             .base_radius = finite ? object->as.cone.radius[0] : 0,
                             .end_radius = finite ? object->as.cone.radius[1] : 0,
                             .infinite_slope = object->as.cone.slope,
                             .finite = finite,
                             .caps = object->as.cone.caps,
                             .only_inside = object->as.cone.only_inside};
}

// Rounds both ends as points, so that they stay where the points of other objects are rounded to. If that
// turns the axis of a short shape far away, or leaves none, rounds only its base, and the shape keeps its
// form.
static Vector3 axis_between_rounded_ends(const Rounding *rounding, const RevolutionGiven *given, Vector3 base)
{
    if (!given->finite) return given->axis;
    const Vector3 axis =
        vector_subtract(point_from_eye(rounding, vector_add(given->from, given->axis)), base);
    const double length = vector_length(given->axis),
                 turned = vector_length(vector_subtract(axis, given->axis)) / length;
    const bool keeps_form =
        turned * fmax(1, fmax(given->base_radius, given->end_radius) / length) < AXIS_TURN_MAX;
    return keeps_form ? axis : given->axis;
}

static Revolution revolution_rounded(const Rounding *rounding, const RevolutionGiven *given)
{
    Vector3 base = point_from_eye(rounding, given->from);
    const Vector3 axis = axis_between_rounded_ends(rounding, given, base);
    Vector3 scaled = vector_rounded(rounding, axis_scaled(axis));
    double length = vector_length(scaled);
    double radius = rounded(rounding, given->base_radius);
    double slope = given->finite ? (rounded(rounding, given->end_radius) - radius) / vector_length(axis)
                                 : given->infinite_slope;
    return (Revolution){
        .base_radius = scalar4_of(base, radius * length),
        .axis_slope = scalar4_of(scaled, slope),
        .range = {given->finite ? vector_dot(axis, scaled) : 0, length, vector_dot(scaled, scaled), 0},
        .id.y = (given->finite ? REVOLUTION_FINITE : 0u) |
                (given->finite && given->caps ? REVOLUTION_CAPPED : 0u) |
                (given->only_inside ? IGNORES_FRONT_FACES : 0u),
    };
}

// A cylinder or cone relative to the eye: its axis' nearest point, the radius there and the slope, how
// far the eye is outside the unbounded side, and the heights of the ends above the eye.
typedef struct {
    Quad3 foot;
    Quad radius, slope, outside, low, high;
} RevolutionFromEye;

static RevolutionFromEye revolution_from_eye(Quad3 base, Quad3 unit_axis, Quad radius, Quad slope,
                                             Quad height)
{
    RevolutionFromEye relative = {.low = quad3_dot(base, unit_axis), .slope = slope};
    relative.high = relative.low + height;
    relative.foot = quad3_subtract(base, quad3_scale(unit_axis, relative.low));
    relative.radius = radius - slope * relative.low;
    relative.outside =
        (quad3_length(relative.foot) - quad_absolute(relative.radius)) / quad_root(1 + slope * slope);
    return relative;
}

static RevolutionFromEye revolution_from_eye_exact(const Rounding *rounding, const RevolutionGiven *given)
{
    const Quad height = given->finite ? quad3_length(quad3(given->axis)) : 0;
    const Quad slope =
        given->finite ? ((Quad)given->end_radius - given->base_radius) / height : (Quad)given->infinite_slope;
    return revolution_from_eye(exact_from_eye(rounding, given->from), quad3_unit(quad3(given->axis)),
                               given->base_radius, slope, height);
}

// Returns the shape that the kernel receives without a power.
static RevolutionFromEye revolution_from_eye_stored(const Rounding *rounding, const Revolution *stored)
{
    const Quad3 axis = quad3(vector3_of(&stored->axis_slope));
    const Quad length = quad3_length(axis);
    return revolution_from_eye(quad3(vector3_of(&stored->base_radius)), quad3_scale(axis, 1 / length),
                               rounded(rounding, stored->base_radius.w) / length,
                               rounded(rounding, stored->axis_slope.w),
                               rounded(rounding, stored->range.x) / length);
}

static double difference(Quad a, Quad b)
{
    return fabs((double)(a - b));
}

// Returns whether a shape is too far away, for its size, for rounding to matter. Most are.
static bool revolution_is_far(const Rounding *rounding, const RevolutionGiven *given)
{
    const Vector3 from = vector_subtract(given->from, rounding->eye), to = vector_add(from, given->axis);
    const double radius = fmax(given->base_radius, given->end_radius);
    const double reach = hypotenuse(vector_length(given->axis) / 2, radius); // from its middle
    const double distance = vector_length(vector_scale(vector_add(from, to), 0.5)) - reach;
    return given->finite && 2 * distance > fmax(vector_length(from), vector_length(to)) + radius;
}

// Returns whether rounding moves the side or an end by more than the tolerance times its distance from the
// eye, or leaves no shape, for example one whose ends coincide. In that case differences are NaN.
static bool revolution_moves(const RevolutionGiven *given, const RevolutionFromEye *exact,
                             const RevolutionFromEye *stored, double tolerance)
{
    const double beyond = given->finite ? (double)quad_maximum(quad_maximum(exact->low, -exact->high), 0) : 0;
    if (!(difference(exact->outside, stored->outside) <=
          tolerance * hypotenuse((double)exact->outside, beyond)))
        return true;
    if (!given->finite) return false;
    const double off_axis = (double)quad3_length(exact->foot);
    const double radii[] = {given->base_radius, given->end_radius},
                 moved[] = {difference(exact->low, stored->low), difference(exact->high, stored->high)},
                 heights[] = {(double)exact->low, (double)exact->high};
    for (int end = 0; end < 2; end++) {
        const double from_rim = off_axis - radii[end];
        const double across = given->caps ? fmax(from_rim, 0) : from_rim;
        if (!(moved[end] <= tolerance * hypotenuse(heights[end], across))) return true;
    }
    return false;
}

// Makes everything relative to the eye if rounding matters.
static void revolution_set_power(Revolution *shape, Flattening *flattening, const RevolutionGiven *given)
{
    const Rounding *rounding = &flattening->rounding;
    if (revolution_is_far(rounding, given)) return;
    const RevolutionFromEye exact = revolution_from_eye_exact(rounding, given),
                            stored = revolution_from_eye_stored(rounding, shape);
    // the radius at the foot is up to the slope times the distance, and displaces a flat cone's rims by its
    // rounding
    const double tolerance = roundoff_of(rounding) * fmax(1, fabs((double)exact.slope));
    const double size = (double)(quad3_length(exact.foot) + quad_absolute(exact.radius));
    const bool is_near = rounding->certifies && fabs((double)exact.outside) < NEAR_EYE * size;
    if (!is_near && !revolution_moves(given, &exact, &stored, tolerance)) return;
    const Vector3 axis = vector_rounded(rounding, axis_scaled(given->axis));
    const Quad3 wide_axis = quad3(axis);
    const Quad squared = quad3_dot(wide_axis, wide_axis), length = quad_root(squared);
    const Quad power = squared * (quad3_dot(exact.foot, exact.foot) - exact.radius * exact.radius);
    if (!primitive_set_power(flattening, (double)power, &shape->id)) return;
    shape->base_radius =
        scalar4_of(vector_rounded(rounding, quad3_rounded(exact.foot)), (double)(exact.radius * length));
    shape->axis_slope = scalar4_of(axis, (double)exact.slope);
    shape->range = (scalar4){given->finite ? (double)(exact.high * length) : 0, (double)length,
                             (double)squared, given->finite ? (double)(exact.low * length) : 0};
}

static void revolution_flatten(Flattening *flattening, const Object *object)
{
    const RevolutionGiven given = revolution_given(object);
    Revolution shape = revolution_rounded(&flattening->rounding, &given);
    revolution_set_power(&shape, flattening, &given);
    primitive_add(flattening, (int)object->type, &shape, object->material);
}

// Returns the bounds of the discs at the ends, which sides without caps reach.
static Bounds revolution_bounds(const Object *object)
{
    const RevolutionGiven given = revolution_given(object);
    if (!given.finite) return bounds_everywhere();
    return bounds_join(bounds_of_disc(given.from, given.axis, given.base_radius),
                       bounds_of_disc(vector_add(given.from, given.axis), given.axis, given.end_radius));
}

static Bounds revolution_primitive_bounds(const void *primitive)
{
    const Revolution *shape = primitive;
    if (!(shape->id.y & REVOLUTION_FINITE)) return bounds_everywhere();
    Vector3 base = vector3_of(&shape->base_radius), axis = vector3_of(&shape->axis_slope);
    double length = shape->range.y, radius = shape->base_radius.w / length;
    const double heights[] = {shape->range.w / shape->range.z, shape->range.x / shape->range.z}; // in axes
    Vector3 half_extents = circle_half_extents(vector_scale(axis, 1 / length));
    Bounds bounds = bounds_empty();
    for (int end = 0; end < 2; end++) {
        const double end_radius = radius + shape->axis_slope.w * heights[end] * length;
        bounds = bounds_join(bounds, bounds_around(vector_add(base, vector_scale(axis, heights[end])),
                                                   vector_scale(half_extents, fabs(end_radius))));
    }
    return bounds;
}

static double revolution_largest_coordinate(const void *primitive)
{
    const Revolution *shape = primitive;
    return vector_largest(vector3_of(&shape->base_radius)) + fabs(shape->base_radius.w) / shape->range.y;
}

#define REVOLUTION_OPS                                                                                       \
    {                                                                                                        \
        .bounds = revolution_bounds, .flatten = revolution_flatten,                                          \
        .primitive_bounds = revolution_primitive_bounds,                                                     \
        .largest_coordinate = revolution_largest_coordinate,                                                 \
    }

const ShapeOps cylinder_ops = REVOLUTION_OPS, cone_ops = REVOLUTION_OPS;
