// Cylinders and cones.
#include "host/compile/shapes.h"

static Revolution revolution_make(const Rounding *rounding, Vector3 from, Vector3 whole_axis,
                                  double radius_from, double radius_to, double infinite_slope, bool finite,
                                  bool caps)
{
    Vector3 base = point_from_eye(rounding, from);
    Vector3 axis = whole_axis;
    // both ends are rounded as points, so that they stay where the points of other objects are rounded to
    if (finite) axis = vector_subtract(point_from_eye(rounding, vector_add(from, whole_axis)), base);
    Vector3 scaled = vector_rounded(rounding, axis_scaled(axis));
    double length = vector_length(scaled);
    double radius = rounded(rounding, radius_from);
    double slope = finite ? (rounded(rounding, radius_to) - radius) / vector_length(axis) : infinite_slope;
    return (Revolution){
        .base_radius = scalar4_of(base, radius * length),
        .axis_slope = scalar4_of(scaled, slope),
        .range = {finite ? vector_dot(axis, scaled) : 0, length, vector_dot(scaled, scaled), 0},
        .id.y = (finite ? REVOLUTION_FINITE : 0u) | (finite && caps ? REVOLUTION_CAPPED : 0u),
    };
}

static void cylinder_flatten(Flattening *flattening, const Object *object)
{
    const double radius = object->as.cylinder.radius;
    Cylinder cylinder =
        revolution_make(&flattening->rounding, object->as.cylinder.from, object->as.cylinder.axis, radius,
                        radius, 0, object->as.cylinder.finite, object->as.cylinder.caps);
    if (object->as.cylinder.only_inside) cylinder.id.y |= IGNORES_FRONT_FACES;
    primitive_add(flattening, KIND_CYLINDERS, &cylinder, object->material);
}

static void cone_flatten(Flattening *flattening, const Object *object)
{
    const bool finite = object->as.cone.finite;
    const double *radius = object->as.cone.radius;
    Cone cone = revolution_make(&flattening->rounding, object->as.cone.from, object->as.cone.axis,
                                finite ? radius[0] : 0, radius[1], object->as.cone.slope, finite,
                                object->as.cone.caps);
    if (object->as.cone.only_inside) cone.id.y |= IGNORES_FRONT_FACES;
    primitive_add(flattening, KIND_CONES, &cone, object->material);
}

// Sides without caps reach as far as the discs that end them.
static Bounds frustum_bounds(Vector3 from, Vector3 axis, double radius_from, double radius_to)
{
    return bounds_join(bounds_of_disc(from, axis, radius_from),
                       bounds_of_disc(vector_add(from, axis), axis, radius_to));
}

static bool cylinder_bounds(const Scene *scene, const Object *object, Bounds *bounds)
{
    (void)scene;
    const double radius = object->as.cylinder.radius;
    if (!object->as.cylinder.finite) return false;
    *bounds = frustum_bounds(object->as.cylinder.from, object->as.cylinder.axis, radius, radius);
    return true;
}

static bool cone_bounds(const Scene *scene, const Object *object, Bounds *bounds)
{
    (void)scene;
    const double *radius = object->as.cone.radius;
    if (!object->as.cone.finite) return false;
    *bounds = frustum_bounds(object->as.cone.from, object->as.cone.axis, radius[0], radius[1]);
    return true;
}

static bool revolution_bounds(const void *primitive, Bounds *bounds)
{
    const Revolution *shape = primitive;
    if (!(shape->id.y & REVOLUTION_FINITE)) return false;
    Vector3 base = vector3_of(&shape->base_radius), axis = vector3_of(&shape->axis_slope);
    double length = shape->range.y, radius = shape->base_radius.w / length;
    double height = shape->range.x / shape->range.z; // in units of the stored axis
    double end_radius = radius + shape->axis_slope.w * height * length;
    Vector3 half_extents = circle_half_extents(vector_scale(axis, 1 / length));
    *bounds = bounds_join(bounds_around(base, vector_scale(half_extents, fabs(radius))),
                          bounds_around(vector_add(base, vector_scale(axis, height)),
                                        vector_scale(half_extents, fabs(end_radius))));
    return true;
}

static double revolution_largest_coordinate(const void *primitive)
{
    const Revolution *shape = primitive;
    return vector_largest(vector3_of(&shape->base_radius)) + shape->base_radius.w / shape->range.y;
}

// A random axis and the two radii at its ends. Returns where it starts.
static Vector3 random_axis(RandomShape *made, double radii[2], Random *random)
{
    double size = made->radius, length = size * random_between(random, 0.5, 3);
    radii[0] = size * random_between(random, 0.2, 1);
    radii[1] = size * random_between(random, 0.2, 1);
    made->axis = vector_on_grid(vector_scale(random_unit_vector(random), length));
    made->radius = hypot(length / 2, fmax(radii[0], radii[1]));
    return vector_on_grid(vector_subtract(made->center, vector_scale(made->axis, 0.5)));
}

enum { CYLINDER_CAPPED, CYLINDER_OPEN, CYLINDER_INFINITE };

static void cylinder_randomize(RandomShape *made, unsigned form, Random *random)
{
    double radii[2];
    Vector3 from = random_axis(made, radii, random);
    made->object.as.cylinder.from = from;
    made->object.as.cylinder.axis = made->axis;
    made->object.as.cylinder.radius = radii[0];
    made->object.as.cylinder.finite = form != CYLINDER_INFINITE;
    made->object.as.cylinder.caps = form == CYLINDER_CAPPED;
}

const ShapeOps cylinder_ops = {
    .kind = KIND_CYLINDERS,
    .vectors = {offsetof(Object, as.cylinder.from), offsetof(Object, as.cylinder.axis)},
    .lengths = {offsetof(Object, as.cylinder.radius)},
    .bounds = cylinder_bounds,
    .flatten = cylinder_flatten,
    .forms = {"capped cylinder", "open cylinder", "infinite cylinder"},
    .randomize = cylinder_randomize,
    .primitive_bounds = revolution_bounds,
    .largest_coordinate = revolution_largest_coordinate,
    .test_flops = 40,
};

enum { CONE_CAPPED, CONE_OPEN, CONE_POINTED, CONE_INFINITE };

static void cone_randomize(RandomShape *made, unsigned form, Random *random)
{
    double radii[2];
    Vector3 from = random_axis(made, radii, random);
    if (form == CONE_POINTED) radii[random_coin(random) ? 0 : 1] = 0;
    made->object.as.cone.from = from;
    made->object.as.cone.axis = made->axis;
    if (form == CONE_INFINITE) {
        made->object.as.cone.from = vector_on_grid(made->center);
        made->object.as.cone.slope = random_between(random, 0.1, 3);
        return;
    }
    made->object.as.cone.radius[0] = radii[0];
    made->object.as.cone.radius[1] = radii[1];
    made->object.as.cone.finite = true;
    made->object.as.cone.caps = form != CONE_OPEN;
}

const ShapeOps cone_ops = {
    .kind = KIND_CONES,
    .vectors = {offsetof(Object, as.cone.from), offsetof(Object, as.cone.axis)},
    .lengths = {offsetof(Object, as.cone.radius[0]), offsetof(Object, as.cone.radius[1])},
    .bounds = cone_bounds,
    .flatten = cone_flatten,
    .forms = {"capped cone", "open cone", "pointed cone", "infinite cone"},
    .randomize = cone_randomize,
    .primitive_bounds = revolution_bounds,
    .largest_coordinate = revolution_largest_coordinate,
    .test_flops = 50,
};
