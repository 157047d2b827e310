#include "host/compile/shapes.h"

static Bounds sphere_bounds(const Object *object)
{
    return bounds_around(object->as.sphere.center, vector_all(object->as.sphere.radius));
}

typedef struct {
    double power; // |center - eye|^2 - radius^2
    double moved; // the distance that the rounding of center and radius moves the surface
} EyePower;

// Computes the power in pairs of doubles (Ogita, Rump, Oishi, Accurate sum and dot product, 2005), because
// its terms cancel to 2^-60 of them if the eye is 2^-60 radii from the surface.
static EyePower eye_power(const Rounding *rounding, const Object *object, Vector3 center)
{
    const Vector3 from = rounding->eye, to = object->as.sphere.center;
    const double radius = object->as.sphere.radius, square = radius * radius;
    const double starts[] = {from.x, from.y, from.z}, ends[] = {to.x, to.y, to.z},
                 stored[] = {center.x, center.y, center.z};
    double sum = -square, rest = -fma(radius, radius, -square), moved_square = 0;
    for (int axis = 0; axis < 3; axis++) {
        const ExactSum step = two_sum(ends[axis], -starts[axis]);
        const double product = step.sum * step.sum;
        const ExactSum next = two_sum(sum, product);
        rest += next.error + fma(step.sum, step.sum, -product) + step.error * (2 * step.sum + step.error);
        sum = next.sum;
        const double moved = (step.sum - stored[axis]) + step.error;
        moved_square += moved * moved;
    }
    return (EyePower){sum + rest, sqrt(moved_square) + fabs(radius - rounded(rounding, radius))};
}

// Sets the sphere's power if needed. The surface of most moves by less than 4 roundings of its distance.
static void sphere_set_power(Sphere *sphere, Flattening *flattening, const Object *object, Vector3 center)
{
    const Rounding *rounding = &flattening->rounding;
    const EyePower eye = eye_power(rounding, object, center);
    const double size = vector_length(center) + object->as.sphere.radius, distance = fabs(eye.power) / size;
    if (eye.moved > 4 * roundoff_of(rounding) * distance ||
        (rounding->certifies && distance < NEAR_EYE * size))
        primitive_set_power(flattening, eye.power, &sphere->id);
}

static void sphere_flatten(Flattening *flattening, const Object *object)
{
    const Vector3 center = point_from_eye(&flattening->rounding, object->as.sphere.center);
    Sphere sphere = {.center_radius = scalar4_of(center, object->as.sphere.radius),
                     .id.y = object->as.sphere.only_inside ? IGNORES_FRONT_FACES : 0u};
    sphere_set_power(&sphere, flattening, object, center);
    primitive_add(flattening, TYPE_SPHERES, &sphere, object->material);
}

static BoundingSphere sphere_bounding_sphere(const void *primitive)
{
    const Sphere *sphere = primitive;
    return (BoundingSphere){vector3_of(&sphere->center_radius), sphere->center_radius.w};
}

const ShapeOps sphere_ops = {
    .bounds = sphere_bounds,
    .flatten = sphere_flatten,
    .bounding_sphere = sphere_bounding_sphere,
};
