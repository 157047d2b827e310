#include "host/verify/random_shape.h"
#include "host/verify/reference_shape.h"

static void hit_plane(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 point = quad3(object->as.plane.point), normal = quad3(object->as.plane.normal);
    // The ray has to turn by this angle to be parallel, which moves it by this margin at the distance of
    // `point`.
    hit_reduce_margin(hit, plane_cosine(ray, normal) * quad3_length(quad3_subtract(point, ray->origin)));
    // Twice the height of the ray's start, because the hit ends on the plane itself.
    hit_reduce_margin(hit, 2 * quad3_dot(quad3_unit(normal), quad3_subtract(point, ray->origin)));
    Quad t;
    if (plane_crossing(ray, point, normal, &t)) hit_keep_nearest(hit, ray, t, normal, UNBOUNDED);
}

static void surface_plane(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    Quad3 normal = quad3_unit(quad3(object->as.plane.normal));
    Quad height = quad3_dot(quad3_subtract(point, quad3(object->as.plane.point)), normal);
    surface_measure(surface, object->as.plane.point, 0, 0);
    surface_add(surface, height, normal, UNBOUNDED);
}

const ReferenceShape reference_plane = {hit_plane, surface_plane, 6};

static void plane_randomize(RandomShape *made, unsigned form, Random *random)
{
    (void)form, (void)random;
    made->object.as.plane.point = made->center;
    made->object.as.plane.normal = made->axis;
}

const RandomForms plane_forms = {{"plane"}, plane_randomize};
