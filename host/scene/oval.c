#include "host/scene/oval.h"

#include "host/scene/shape_members.h"
#include <math.h>
#include <string.h>

// Sets the center, and axes of the given lengths, the last along `along`.
static void axes_set(Object *oval, Vector3 center, Vector3 along, double across, double length)
{
    oval->as.oval.center = center;
    const Vector3 w = vector_normalize(along);
    const Vector3 u = vector_normalize(vector_cross(w, vector_least_aligned_axis(w)));
    oval->as.oval.axes[0] = vector_scale(u, across);
    oval->as.oval.axes[1] = vector_scale(vector_cross(w, u), across);
    oval->as.oval.axes[2] = vector_scale(w, length);
}

void oval_make(Object *object)
{
    Object from = *object;
    const ShapeMembers members = shape_members(&from);
    const Vector3 place = *members.points[0];
    double across = *members.lengths[0], widest = across; // of an infinite shape's map, and of one with ends
    object->type = SHAPE_OVAL;
    memset(&object->as, 0, sizeof object->as);
    object->as.oval.unit = from.type;
    if (from.type == SHAPE_SPHERE) {
        object->as.oval.center = place;
        for (int i = 0; i < 3; i++)
            object->as.oval.axes[i] = vector_scale((Vector3){i == 0, i == 1, i == 2}, across);
        return;
    }
    Vector3 axis = *members.directions[0];
    if (from.type == SHAPE_CYLINDER) {
        object->as.oval.finite = from.as.cylinder.finite;
        object->as.oval.caps = from.as.cylinder.caps;
    } else if (from.type == SHAPE_CONE) {
        const double *radii = from.as.cone.radius;
        object->as.oval.finite = from.as.cone.finite;
        across = 1;
        widest = fmax(radii[0], radii[1]);
        object->as.oval.caps = from.as.cone.caps;
        object->as.oval.rise = from.as.cone.slope;
        for (int i = 0; i < 2 && from.as.cone.finite; i++)
            object->as.oval.radii[i] = radii[i] / widest;
    } else if (from.type == SHAPE_TORUS) {
        across = from.as.torus.major + from.as.torus.minor;
        object->as.oval.radii[0] = from.as.torus.major / across;
        object->as.oval.radii[1] = from.as.torus.minor / across;
    } else if (from.type == SHAPE_PARABOLOID) {
        const double focal_length = across, height = from.as.paraboloid.height;
        object->as.oval.finite = from.as.paraboloid.finite;
        across = 4 * focal_length;
        widest = 2 * sqrt(focal_length * height);
        axis = vector_normalize(axis);
        if (from.as.paraboloid.finite) axis = vector_scale(axis, height);
        object->as.oval.caps = from.as.paraboloid.caps;
        object->as.oval.rise = 1;
    }
    if (!object->as.oval.finite) {
        axes_set(object, place, axis, across, across);
        return;
    }
    const Vector3 half = vector_scale(axis, 0.5); // the unit shape's middle is that of the axis
    object->as.oval.half_height = 1;
    axes_set(object, vector_add(place, half), axis, widest, vector_length(half));
}

// Turns two axes in the space of the unit shape so that they become perpendicular (Hestenes, Inversion of
// matrices by biorthogonalization and related results, J. SIAM 6(1), 1958). Returns whether they changed.
static bool axes_turn(Vector3 *a, Vector3 *b)
{
    const double aa = vector_dot(*a, *a), bb = vector_dot(*b, *b), ab = vector_dot(*a, *b);
    if (fabs(ab) <= 0x1p-52 * sqrt(aa) * sqrt(bb)) return false;
    const double half = (bb - aa) / (2 * ab);
    const double tangent = copysign(1 / (fabs(half) + sqrt(1 + half * half)), half);
    const double cosine = 1 / sqrt(1 + tangent * tangent), sine = cosine * tangent;
    const Vector3 turned = vector_subtract(vector_scale(*a, cosine), vector_scale(*b, sine));
    *b = vector_add(vector_scale(*a, sine), vector_scale(*b, cosine));
    *a = turned;
    return true;
}

enum { TURNS_MAX = 32 }; // of all axes; a few suffice

// Makes all axes perpendicular.
static void axes_turn_all(Vector3 axes[3])
{
    bool changes = true;
    for (int i = 0; i < TURNS_MAX && changes; i++) {
        changes = axes_turn(&axes[0], &axes[1]);
        changes |= axes_turn(&axes[1], &axes[2]);
        changes |= axes_turn(&axes[2], &axes[0]);
    }
}

// Gives the last axis the mean length of the others, and the unit shape the height that it loses.
static void axis_rescale(Object *object)
{
    Vector3 *axes = object->as.oval.axes;
    const double length = sqrt(vector_length(axes[0])) * sqrt(vector_length(axes[1])),
                 factor = length / vector_length(axes[2]);
    axes[2] = vector_scale(axes[2], factor);
    object->as.oval.half_height /= factor;
    object->as.oval.rise *= factor;
}

void oval_transform(Object *object, const Affine *affine)
{
    Vector3 *axes = object->as.oval.axes;
    object->as.oval.center = affine_point(affine, object->as.oval.center);
    for (int i = 0; i < 3; i++)
        axes[i] = affine_direction(affine, axes[i]);
    if (object->as.oval.unit == SHAPE_SPHERE) {
        axes_turn_all(axes);
        return;
    }
    axes_turn(&axes[0], &axes[1]);
    if (object->as.oval.unit == SHAPE_DISC) axes[2] = vector_cross(vector_normalize(axes[0]), axes[1]);
    if (object->as.oval.unit != SHAPE_TORUS) axis_rescale(object);
}

static void axes_stretches(const Vector3 axes[3], double *shortest, double *longest)
{
    Vector3 turned[3] = {axes[0], axes[1], axes[2]};
    axes_turn_all(turned);
    *shortest = INFINITY, *longest = 0;
    for (int i = 0; i < 3; i++) {
        *shortest = fmin(*shortest, vector_length(turned[i]));
        *longest = fmax(*longest, vector_length(turned[i]));
    }
}

void oval_stretches(const Object *oval, double *shortest, double *longest)
{
    axes_stretches(oval->as.oval.axes, shortest, longest);
}

bool axes_are_moderate(const Vector3 axes[3])
{
    double shortest, longest;
    axes_stretches(axes, &shortest, &longest);
    const Vector3 across = vector_cross(vector_normalize(axes[0]), vector_normalize(axes[1]));
    return shortest >= 1e-6 * longest &&
           fabs(vector_dot(across, vector_normalize(axes[2]))) >= 0.00175; // the sine of 0.1 degrees
}

Object oval_unit(const Object *oval)
{
    const bool finite = oval->as.oval.finite, caps = oval->as.oval.caps;
    const double half = oval->as.oval.half_height, *radii = oval->as.oval.radii, rise = oval->as.oval.rise;
    const Vector3 low = {0, 0, finite ? -half : 0}, z = {0, 0, 1}, up = {0, 0, finite ? 2 * half : 1};
    Object unit = {.type = oval->as.oval.unit, .material = oval->material};
    const ShapeMembers members = shape_members(&unit);
    *members.points[0] = low;
    if (members.directions[0]) *members.directions[0] = z;
    *members.lengths[0] = 1;
    switch (unit.type) {
    case SHAPE_CYLINDER:
        unit.as.cylinder.axis = up;
        unit.as.cylinder.finite = finite;
        unit.as.cylinder.caps = caps;
        break;
    case SHAPE_CONE:
        unit.as.cone.axis = up;
        unit.as.cone.radius[0] = radii[0];
        unit.as.cone.radius[1] = radii[1];
        unit.as.cone.slope = rise;
        unit.as.cone.finite = finite;
        unit.as.cone.caps = caps;
        break;
    case SHAPE_TORUS:
        unit.as.torus.major = radii[0];
        unit.as.torus.minor = radii[1];
        break;
    case SHAPE_PARABOLOID:
        unit.as.paraboloid.focal_length = finite ? 0.125 / half : 0.25 * rise;
        unit.as.paraboloid.height = finite ? 2 * half : 0;
        unit.as.paraboloid.finite = finite;
        unit.as.paraboloid.caps = caps;
        break;
    default: // a sphere or a disc
        break;
    }
    return unit;
}

Affine oval_map(const Object *oval)
{
    const Vector3 *axes = oval->as.oval.axes, center = oval->as.oval.center;
    return (Affine){{{axes[0].x, axes[1].x, axes[2].x, center.x},
                     {axes[0].y, axes[1].y, axes[2].y, center.y},
                     {axes[0].z, axes[1].z, axes[2].z, center.z}}};
}

bool oval_is_bounded(const Object *oval)
{
    const ShapeType unit = oval->as.oval.unit;
    return oval->as.oval.finite || unit == SHAPE_SPHERE || unit == SHAPE_DISC || unit == SHAPE_TORUS;
}
