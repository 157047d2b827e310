#include "host/verify/random_shape.h"
#include "host/verify/reference_shape.h"

// Finds the hit with a disc. Its margin is twice the distance from the rim, which within the plane is about
// (d^2 / r^2 - 1) r. Between the ray's line and the rim's nearest tangent it is shorter by approach / spread.
void hit_disc_at(Quad3 center, Quad3 normal, Quad radius, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad t;
    if (radius <= 0 || !plane_crossing(ray, center, normal, &t)) return;
    Quad3 from_center = quad3_subtract(reference_point(ray, t), center);
    Quad excess = quad3_dot(from_center, from_center) / (radius * radius) - 1;
    Quad3 across = quad3_cross(ray->direction, quad3_unit(quad3_cross(normal, from_center)));
    Quad approach = quad3_dot(ray->direction, quad3_unit(normal)), spread = quad3_length(across);
    hit_reduce_margin(hit, excess * radius * (spread > 0 ? approach / spread : 1));
    if (excess <= 0) hit_keep_nearest(hit, ray, t, normal, UNBOUNDED);
}

static void hit_disc(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 center = quad3(object->as.disc.center), normal = quad3(object->as.disc.normal);
    // A disc that is seen edge on is hit or missed by the sign of the eye's height over it.
    hit_reduce_margin(hit, plane_cosine(ray, normal) * quad3_length(quad3_subtract(center, ray->origin)));
    hit_disc_at(center, normal, object->as.disc.radius, ray, hit);
}

static void surface_disc(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    double radius = object->as.disc.radius;
    Quad3 from_center = quad3_subtract(point, quad3(object->as.disc.center));
    Quad3 normal = quad3_unit(quad3(object->as.disc.normal));
    Quad height = quad3_dot(from_center, normal);
    Quad off = quad3_length(quad3_subtract(from_center, quad3_scale(normal, height)));
    surface_measure(surface, object->as.disc.center, radius, radius);
    surface_add(surface, quad_hypotenuse(height, quad_outside(off, 0, radius)), normal, UNBOUNDED);
}

const ReferenceShape reference_disc = {hit_disc, surface_disc, 7};

static void disc_randomize(RandomShape *made, unsigned form, Random *random)
{
    (void)form, (void)random;
    made->object.as.disc.center = made->center;
    made->object.as.disc.normal = made->axis;
    made->object.as.disc.radius = made->radius;
}

const RandomForms disc_forms = {{"disc"}, disc_randomize};
