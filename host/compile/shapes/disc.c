#include "host/compile/shapes.h"
#include "host/compile/texture_mapping.h"

static Bounds disc_bounds(const Object *object)
{
    return bounds_of_disc(object->as.disc.center, object->as.disc.normal, object->as.disc.radius);
}

// Sets the eye's power if the center's rounding would move the disc, or its rim, by more than 4 roundings of
// its distance from the eye. The disc is then where its plane intersects a sphere that the power defines.
static void disc_set_power(Disc *disc, Flattening *flattening, const Object *object)
{
    const Rounding *rounding = &flattening->rounding;
    const double radius = object->as.disc.radius, u = roundoff_of(rounding);
    const Vector3 stored = vector3_of(&disc->center_radius);
    if (vector_length(stored) > 2 * radius) return; // most discs
    const Quad3 center = exact_from_eye(rounding, object->as.disc.center),
                unit = quad3_unit(quad3(object->as.disc.normal));
    const Quad height = quad3_dot(unit, center), squared = quad3_dot(center, center);
    const Quad3 foot = quad3_scale(unit, height);
    const double to_rim = (double)quad3_length(quad3_subtract(center, foot)) - radius;
    const double from_rim = hypotenuse((double)height, to_rim),
                 from_disc = hypotenuse((double)height, fmax(to_rim, 0));
    const double rim_moved = (double)quad3_length(quad3_subtract(center, quad3(stored))) +
                             fabs(radius - rounded(rounding, radius));
    if (rim_moved <= 4 * u * from_rim && (double)quad3_dot_magnitude(unit, center) <= 4 * from_disc) return;
    if (!primitive_set_power(flattening, (double)(squared - (Quad)radius * radius), &disc->id)) return;
    disc->foot = scalar4_of(vector_rounded(rounding, quad3_rounded(foot)), 0);
}

static void disc_flatten(Flattening *flattening, const Object *object)
{
    const Vector3 normal = object->as.disc.normal;
    const Vector3 center = point_from_eye(&flattening->rounding, object->as.disc.center);
    Disc disc = {.center_radius = scalar4_of(center, object->as.disc.radius),
                 .normal = normal_and_inverse_length(&flattening->rounding, normal)};
    disc_set_power(&disc, flattening, object);
    surface_grid(flattening, object->material, normal, &disc.grid_u, &disc.grid_v);
    primitive_add(flattening, TYPE_DISCS, &disc, object->material);
}

// The disc's box is that of the sphere, because t is uncertain by as much for rays nearly in its plane.
static BoundingSphere disc_bounding_sphere(const void *primitive)
{
    const Disc *disc = primitive;
    return (BoundingSphere){vector3_of(&disc->center_radius), disc->center_radius.w};
}

static void disc_plane(const void *primitive, Vector3 *point, Vector3 *normal)
{
    const Disc *disc = primitive;
    *point = vector3_of(&disc->center_radius);
    *normal = vector3_of(&disc->normal);
}

const ShapeOps disc_ops = {
    .bounds = disc_bounds,
    .flatten = disc_flatten,
    .bounding_sphere = disc_bounding_sphere,
    .plane = disc_plane,
};
