#include "host/verify/random_shape.h"
#include "host/verify/reference_shape.h"

static void hit_sphere(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad radius = object->as.sphere.radius;
    Quad3 from_center = quad3_subtract(ray->origin, quad3(object->as.sphere.center));
    Quad a = quad3_dot(ray->direction, ray->direction);
    Quad b = quad3_dot(from_center, ray->direction);
    Quad c = quad3_dot(from_center, from_center) - radius * radius;
    hit_reduce_margin(hit,
                      (b * b / a - c) / radius); // (r^2 - l^2) / r, l the line's distance from the center
    Quad roots[2];
    int count = quadratic_roots(a, b, c, roots);
    for (int i = 0; i < count; i++) {
        Quad3 normal = quad3_add(from_center, quad3_scale(ray->direction, roots[i]));
        if (object->as.sphere.only_inside && quad3_dot(normal, ray->direction) < 0) continue;
        hit_keep_nearest(hit, ray, roots[i], normal, radius);
    }
}

static void surface_sphere(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    double radius = object->as.sphere.radius;
    Quad3 from_center = quad3_subtract(point, quad3(object->as.sphere.center));
    Quad distance = quad3_length(from_center);
    surface_measure(surface, object->as.sphere.center, radius, radius);
    surface_add(surface, distance - radius, quad3_scale(from_center, 1 / distance), radius);
}

const ReferenceShape reference_sphere = {hit_sphere, surface_sphere, 4};

static void sphere_randomize(RandomShape *made, unsigned form, Random *random)
{
    (void)form, (void)random;
    made->object.as.sphere.center = made->center;
    made->object.as.sphere.radius = made->radius;
}

const RandomForms sphere_forms = {{"sphere"}, sphere_randomize};
