// Cylinders and cones.
#include "host/verify/random_shape.h"
#include "host/verify/reference_shape.h"

#include <math.h>

// A cylinder or cone, whose radius is `base` at `from` and grows by `slope` along the unit axis, up to
// `height` if it is finite. An infinite cone has both nappes.
typedef struct {
    Quad3 from, axis;
    Quad base, slope, height;
    bool finite, caps, only_inside;
} RevolutionBody;

static RevolutionBody revolution_of(const Object *object)
{
    bool is_cylinder = object->type == SHAPE_CYLINDER;
    Quad3 axis = quad3(is_cylinder ? object->as.cylinder.axis : object->as.cone.axis);
    Quad height = quad3_length(axis);
    axis = quad3_scale(axis, 1 / height);
    if (is_cylinder)
        return (RevolutionBody){.from = quad3(object->as.cylinder.from),
                                .axis = axis,
                                .base = object->as.cylinder.radius,
                                .height = height,
                                .finite = object->as.cylinder.finite,
                                .caps = object->as.cylinder.caps,
                                .only_inside = object->as.cylinder.only_inside};
    Quad first = object->as.cone.radius[0], second = object->as.cone.radius[1];
    bool finite = object->as.cone.finite;
    return (RevolutionBody){.from = quad3(object->as.cone.from),
                            .axis = axis,
                            .base = finite ? first : 0,
                            .slope = finite ? (second - first) / height : object->as.cone.slope,
                            .height = height,
                            .finite = finite,
                            .caps = object->as.cone.caps,
                            .only_inside = object->as.cone.only_inside};
}

static void hit_side(const RevolutionBody *body, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 axes[3];
    axes_around(body->axis, axes);
    Quad3 p = axes_coordinates(axes, quad3_subtract(ray->origin, body->from)),
          q = axes_coordinates(axes, ray->direction);
    // What the rounding of the axes leaves in a ray along the axis is not a direction.
    if (q.x * q.x + q.y * q.y < (Quad)1e-60L * q.z * q.z) q.x = q.y = 0;
    Quad radius = body->base + body->slope * p.z, growth = body->slope * q.z;
    Quad a = q.x * q.x + q.y * q.y - growth * growth;
    Quad b = p.x * q.x + p.y * q.y - radius * growth;
    Quad c = p.x * p.x + p.y * p.y - radius * radius;

    // With e the distance of the ray from the axis, seen along it, and s the radius of the body there,
    // the discriminant is proportional to s^2 - e^2.
    Quad steepness = quad_root(q.x * q.x + q.y * q.y);
    Quad3 outline = {radius * q.x - growth * p.x, radius * q.y - growth * p.y, 0};
    Quad silhouette = quad3_length(outline);
    if (steepness > 0 && silhouette > 0) hit_reduce_margin(hit, (b * b - a * c) / (silhouette * steepness));
    if (body->slope != 0) {
        Quad apex = -body->base / body->slope;
        if (!body->finite || (apex >= 0 && apex <= body->height)) {
            Quad3 apex_point = quad3_add(body->from, quad3_scale(body->axis, apex));
            hit_reduce_margin(hit, 2 * point_line_distance(apex_point, ray->origin, ray->direction));
        }
    }

    Quad roots[2];
    int count = quadratic_roots(a, b, c, roots);
    for (int i = 0; i < count; i++) {
        Quad x = p.x + roots[i] * q.x, y = p.y + roots[i] * q.y, z = p.z + roots[i] * q.z;
        Quad3 gradient = {x, y, -body->slope * (body->base + body->slope * z)};
        if (quad3_dot(gradient, gradient) == 0) gradient.z = -1;
        Quad3 normal = axes_vector(axes, gradient);
        if (body->finite) {
            Quad cosine = plane_cosine(ray, normal);
            hit_reduce_margin(hit, 2 * z * cosine);
            hit_reduce_margin(hit, 2 * (body->height - z) * cosine);
            if (z < 0 || z > body->height) continue;
        }
        if (body->only_inside && quad3_dot(normal, ray->direction) < 0) continue;
        hit_keep_nearest(hit, ray, roots[i], normal, quad_root(x * x + y * y));
    }
}

static void hit_revolution(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    RevolutionBody body = revolution_of(object);
    hit_side(&body, ray, hit);
    if (!body.finite || !body.caps) return;
    hit_disc_at(body.from, quad3_scale(body.axis, -1), body.base, ray, hit);
    hit_disc_at(quad3_add(body.from, quad3_scale(body.axis, body.height)), body.axis,
                body.base + body.slope * body.height, ray, hit);
}

// Measures in the half-plane of the axis and the point, `along` the axis from the base and `off` it.
static void surface_revolution(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    RevolutionBody body = revolution_of(object);
    Quad3 from = quad3_subtract(point, body.from), axis = body.axis;
    Quad along = quad3_dot(from, axis);
    if (!body.finite && body.slope != 0 && along < 0) {
        along = -along;
        axis = quad3_scale(axis, -1);
    }
    Quad3 across = quad3_subtract(from, quad3_scale(axis, along));
    Quad off = quad3_length(across), cosine = 1 / quad_hypotenuse(1, body.slope); // of the side with the axis
    Quad3 radial = off > 0 ? quad3_scale(across, 1 / off) : axis;
    Quad end_radius = body.base + body.slope * body.height;
    double largest = (double)quad_maximum(body.base, end_radius), half = (double)body.height / 2;
    if (!body.finite) half = 0;
    Vector3 middle = vector_add(quad3_rounded(body.from), vector_scale(quad3_rounded(body.axis), half));
    surface_measure(surface, middle, hypot(largest, half), largest);

    Quad place = (along + body.slope * (off - body.base)) * cosine; // along the side's line
    Quad away = (off - body.base - body.slope * along) * cosine;    // from it
    Quad beyond = 0;
    if (body.finite) beyond = quad_outside(place, 0, body.height / cosine);
    if (!body.finite && body.slope != 0) beyond = quad_outside(place, 0, UNBOUNDED);
    Quad3 normal = quad3_scale(quad3_subtract(radial, quad3_scale(axis, body.slope)), cosine);
    surface_add(surface, quad_hypotenuse(away, beyond), normal, quad_maximum(off, (Quad)1e-30L) / cosine);
    if (!body.finite || !body.caps) return;
    surface_add(surface, quad_hypotenuse(along, quad_outside(off, 0, body.base)), axis, UNBOUNDED);
    surface_add(surface, quad_hypotenuse(along - body.height, quad_outside(off, 0, end_radius)), axis,
                UNBOUNDED);
}

const ReferenceShape reference_cylinder = {hit_revolution, surface_revolution, 7};

const ReferenceShape reference_cone = {hit_revolution, surface_revolution, 9};

// Chooses a random axis and the two radii at its ends. Returns where the axis starts.
static Vector3 random_axis(RandomShape *made, double radii[2], Random *random)
{
    double size = made->radius, length = size * random_between(random, 0.5, 3);
    radii[0] = size * random_between(random, 0.2, 1);
    radii[1] = size * random_between(random, 0.2, 1);
    made->axis = vector_on_grid(vector_scale(random_unit_vector(random), length));
    made->radius = hypotenuse(length / 2, fmax(radii[0], radii[1]));
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

const RandomForms cylinder_forms = {{"capped cylinder", "open cylinder", "infinite cylinder"},
                                    cylinder_randomize};

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

const RandomForms cone_forms = {{"capped cone", "open cone", "pointed cone", "infinite cone"},
                                cone_randomize};
