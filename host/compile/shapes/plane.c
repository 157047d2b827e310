#include "host/compile/shapes.h"
#include "host/compile/texture_mapping.h"

// Returns a rounded point of a plane that is off the plane by at most some ulp of the plane's distance from
// the eye: the given one or, if that is too far away, the one nearest to the eye. In double without an eye,
// returns the given one unrounded. The rounding of the point and that of the kernels' sum n . (p - o) are
// each at most some u of the sum of |n p| over the axes.
static Vector3 plane_point_from_eye(const Rounding *rounding, Vector3 point, Vector3 normal)
{
    if (rounding->is_double && !rounding->has_eye && !rounding->certifies)
        return point; // exact, and so is the kernels' sum
    const Quad3 from_eye = exact_from_eye(rounding, point), n = quad3(axis_scaled(normal));
    const Quad height = quad3_dot(n, from_eye);
    if (quad3_dot_magnitude(n, from_eye) <= 4 * quad_absolute(height)) return point_from_eye(rounding, point);
    return vector_rounded(rounding, quad3_rounded(quad3_scale(n, height / quad3_dot(n, n))));
}

static void plane_flatten(Flattening *flattening, const Object *object)
{
    const Vector3 normal = object->as.plane.normal;
    const Vector3 point = plane_point_from_eye(&flattening->rounding, object->as.plane.point, normal);
    Plane plane = {.point = scalar4_of(point, 0),
                   .normal = normal_and_inverse_length(&flattening->rounding, normal)};
    surface_grid(flattening, object->material, normal, &plane.grid_u, &plane.grid_v);
    primitive_add(flattening, TYPE_PLANES, &plane, object->material);
}

static void plane_plane(const void *primitive, Vector3 *point, Vector3 *normal)
{
    const Plane *plane = primitive;
    *point = vector3_of(&plane->point);
    *normal = vector3_of(&plane->normal);
}

static double plane_largest_coordinate(const void *primitive)
{
    const Plane *plane = primitive;
    return fabs(vector_dot(vector_normalize(vector3_of(&plane->normal)), vector3_of(&plane->point)));
}

const ShapeOps plane_ops = {
    .flatten = plane_flatten,
    .plane = plane_plane,
    .largest_coordinate = plane_largest_coordinate,
};
