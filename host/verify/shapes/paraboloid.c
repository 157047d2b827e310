#include "host/verify/random_shape.h"
#include "host/verify/reference_shape.h"

static void hit_paraboloid(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad focal_length = object->as.paraboloid.focal_length, height = object->as.paraboloid.height;
    Quad3 apex = quad3(object->as.paraboloid.apex), axis = quad3_unit(quad3(object->as.paraboloid.axis));
    Quad3 from = quad3_subtract(ray->origin, apex);
    Quad3 m = quad3_cross(from, axis), q = quad3_cross(ray->direction, axis);
    Quad a = quad3_dot(q, q), b = quad3_dot(m, q) - 2 * focal_length * quad3_dot(ray->direction, axis);
    Quad c = quad3_dot(m, m) - 4 * focal_length * quad3_dot(from, axis);

    // The distance of the line from a tangent is the discriminant over its gradient, or less where it bends
    // away.
    Quad discriminant = b * b - a * c;
    Quad3 gradient = quad3_add(quad3_scale(quad3_cross(ray->direction, q), 4 * focal_length),
                               quad3_scale(q, 2 * quad3_dot(from, q)));
    if (quad3_dot(gradient, gradient) > 0) hit_reduce_margin(hit, 2 * discriminant / quad3_length(gradient));
    if (discriminant > 0 && a > 0) hit_reduce_margin(hit, quad_root(discriminant / a));

    Quad roots[2];
    int count = quadratic_roots(a, b, c, roots);
    for (int i = 0; i < count; i++) {
        Quad3 p = quad3_add(from, quad3_scale(ray->direction, roots[i]));
        Quad z = quad3_dot(p, axis);
        Quad3 across = quad3_subtract(p, quad3_scale(axis, z));
        Quad3 normal = quad3_subtract(across, quad3_scale(axis, 2 * focal_length));
        if (object->as.paraboloid.finite) {
            hit_reduce_margin(hit, 2 * (height - z) * plane_cosine(ray, normal));
            if (z > height) continue;
        }
        hit_keep_nearest(hit, ray, roots[i], normal, quad3_length(normal));
    }
    if (object->as.paraboloid.finite && object->as.paraboloid.caps)
        hit_disc_at(quad3_add(apex, quad3_scale(axis, height)), axis, 2 * quad_root(focal_length * height),
                    ray, hit);
}

// Measures the surface to first order, which suffices for points nearer to it than its radius of curvature.
static void surface_paraboloid(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    Quad focal_length = object->as.paraboloid.focal_length, height = object->as.paraboloid.height;
    Quad3 apex = quad3(object->as.paraboloid.apex), axis = quad3_unit(quad3(object->as.paraboloid.axis));
    Quad3 from = quad3_subtract(point, apex);
    Quad z = quad3_dot(from, axis);
    Quad3 across = quad3_subtract(from, quad3_scale(axis, z));
    Quad3 normal = quad3_subtract(across, quad3_scale(axis, 2 * focal_length));
    Quad off = quad3_length(across), curvature_radius = quad3_length(normal);
    bool finite = object->as.paraboloid.finite;
    Quad rim = finite ? 2 * quad_root(focal_length * height) : 2 * focal_length;
    Quad3 middle = quad3_add(apex, quad3_scale(axis, finite ? height / 2 : 0));
    surface_measure(surface, quad3_rounded(middle), (double)quad_hypotenuse(rim, height / 2), (double)rim);
    Quad beyond = finite && z > height ? (z - height) * curvature_radius / off : 0;
    surface_add(surface, quad_hypotenuse((off * off - 4 * focal_length * z) / (2 * curvature_radius), beyond),
                quad3_scale(normal, 1 / curvature_radius), curvature_radius);
    if (finite && object->as.paraboloid.caps)
        surface_add(surface, quad_hypotenuse(z - height, quad_outside(off, 0, rim)), axis, UNBOUNDED);
}

const ReferenceShape reference_paraboloid = {hit_paraboloid, surface_paraboloid, 8};

enum { PARABOLOID_CAPPED, PARABOLOID_OPEN, PARABOLOID_INFINITE };

// Makes a random paraboloid whose rim is from a fifth to twice as wide as it is high.
static void paraboloid_randomize(RandomShape *made, unsigned form, Random *random)
{
    double height = made->radius * random_between(random, 0.5, 3);
    double rim = height * random_between(random, 0.1, 1);
    made->axis = random_coin(random) ? random_world_axis(random) : vector_on_grid(random_unit_vector(random));
    Vector3 to_center = vector_scale(vector_normalize(made->axis), height / 2);
    made->object.as.paraboloid.apex = vector_subtract(made->center, to_center);
    made->object.as.paraboloid.axis = made->axis;
    made->object.as.paraboloid.focal_length = rim * rim / (4 * height);
    made->object.as.paraboloid.height = height;
    made->object.as.paraboloid.finite = form != PARABOLOID_INFINITE;
    made->object.as.paraboloid.caps = form == PARABOLOID_CAPPED;
    made->radius = hypotenuse(height / 2, rim);
}

const RandomForms paraboloid_forms = {{"capped paraboloid", "open paraboloid", "infinite paraboloid"},
                                      paraboloid_randomize};
