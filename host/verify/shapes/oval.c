#include "host/scene/oval.h"
#include "host/verify/random_shape.h"
#include "host/verify/reference_shape.h"

// The rows of the inverse of the map, by Cramer's rule, and a bound on its norm.
typedef struct {
    Quad3 rows[3];
    Quad norm;
} Inverse;

static Inverse inverse_of(const Object *object)
{
    const Vector3 *axes = object->as.oval.axes;
    Inverse inverse;
    Quad squares = 0;
    for (int i = 0; i < 3; i++) {
        const Quad3 cross = quad3_cross(quad3(axes[(i + 1) % 3]), quad3(axes[(i + 2) % 3]));
        inverse.rows[i] = quad3_scale(cross, 1 / quad3_dot(quad3(axes[i]), cross));
        squares += quad3_dot(inverse.rows[i], inverse.rows[i]);
    }
    inverse.norm = quad_root(squares);
    return inverse;
}

// Returns the normal of the oval and, in *length, how fast the unit shape's distance grows along it.
static Quad3 mapped_normal(const Inverse *inverse, Quad3 normal, Quad *length)
{
    const Quad3 along = axes_vector(inverse->rows, normal);
    *length = quad3_length(along);
    return quad3_scale(along, 1 / *length);
}

// Returns a radius of curvature. A surface bends at most |inverse|^2 / length times as much as the unit's.
static Quad mapped_radius(const Inverse *inverse, Quad radius, Quad length)
{
    return radius == UNBOUNDED ? radius : radius * length / (inverse->norm * inverse->norm);
}

static void hit_oval(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    const Inverse inverse = inverse_of(object);
    const Object unit = oval_unit(object);
    const Quad3 from = quad3_subtract(ray->origin, quad3(object->as.oval.center));
    const ReferenceRay unit_ray = {axes_coordinates(inverse.rows, from),
                                   axes_coordinates(inverse.rows, ray->direction), ray->tmin, ray->tmax};
    reference_shapes[unit.type]->hit(&unit, &unit_ray, hit);
    hit->margin = hit->margin == UNBOUNDED ? UNBOUNDED : hit->margin / inverse.norm;
    if (!hit->found) return;
    Quad length;
    hit->normal = hit->shading_normal = mapped_normal(&inverse, hit->normal, &length);
    hit->cosine = plane_cosine(ray, hit->normal);
    hit->curvature_radius = mapped_radius(&inverse, hit->curvature_radius, length);
}

// Measures the surface to first order, which suffices for points nearer to it than its radius of curvature.
static void surface_oval(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    const Inverse inverse = inverse_of(object);
    const Object unit = oval_unit(object);
    reference_shapes[unit.type]->surface(
        &unit, axes_coordinates(inverse.rows, quad3_subtract(point, quad3(object->as.oval.center))), surface);
    Quad squares = 0;
    for (int i = 0; i < 3; i++)
        squares += quad3_dot(quad3(object->as.oval.axes[i]), quad3(object->as.oval.axes[i]));
    surface_measure(surface, object->as.oval.center, surface->bounding_radius * (double)quad_root(squares),
                    surface->feature_radius / (double)inverse.norm);
    for (int i = 0; i < surface->count; i++) {
        ReferenceSheet *sheet = &surface->sheets[i];
        Quad length;
        sheet->normal = mapped_normal(&inverse, sheet->normal, &length);
        sheet->distance /= length;
        sheet->curvature_radius = mapped_radius(&inverse, sheet->curvature_radius, length);
    }
}

const ReferenceShape reference_oval = {hit_oval, surface_oval, 16};

// Lacks random shapes; tests/test_ovals.c transforms others.
const RandomForms oval_forms = {{NULL}, NULL};
