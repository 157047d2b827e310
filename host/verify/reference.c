#include "host/verify/reference.h"
#include "host/compile/compiled_scene.h"
#include "host/scene/shape_members.h"
#include "host/verify/reference_shape.h"
#include <math.h>

#define SHAPE_DECLARE(feature, Type, name, names) extern const ReferenceShape reference_##name;
SHAPE_LIST(SHAPE_DECLARE)
#undef SHAPE_DECLARE

#define SHAPE_ROW(feature, Type, name, names) &reference_##name,
const ReferenceShape *const reference_shapes[SHAPE_COUNT] = {SHAPE_LIST(SHAPE_ROW)};
#undef SHAPE_ROW

ReferenceRay reference_ray(Vector3 origin, Vector3 direction)
{
    return (ReferenceRay){quad3(origin), quad3(direction), 0, (Quad)FLT_MAX};
}

static void round_numbers(double *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++)
        numbers[i] = rounded_to_float(numbers[i]);
}

ReferenceRay reference_ray_rounded(Vector3 origin, Vector3 direction)
{
    round_numbers(&origin.x, 3);
    round_numbers(&direction.x, 3);
    return reference_ray(origin, direction);
}

Quad3 reference_point(const ReferenceRay *ray, Quad t)
{
    return quad3_add(ray->origin, quad3_scale(ray->direction, t));
}

Quad reference_highlight(Quad3 normal, Quad3 to_light, Quad3 to_eye, double shininess)
{
    Quad facing = quad3_dot(normal, to_light);
    if (facing <= 0) return 0;
    Quad alignment = quad3_dot(quad3_subtract(quad3_scale(normal, 2 * facing), to_light), to_eye);
    return alignment > 0 ? QUAD_CALL(pow)(alignment, (Quad)shininess) : shininess == 0;
}

Object reference_round_object(const Object *object)
{
    Object result = *object;
    Vector3 *points = (Vector3 *)(void *)&result.as;
    bool finite = (object->type == SHAPE_CYLINDER && object->as.cylinder.finite) ||
                  (object->type == SHAPE_CONE && object->as.cone.finite);
    Vector3 end = finite ? vector_add(points[0], points[1]) : points[0];
    round_numbers(&points[0].x, reference_shapes[object->type]->number_count);
    round_numbers(&end.x, 3);
    if (finite) points[1] = vector_subtract(end, points[0]);
    return result;
}

Object reference_object_from(const Object *object, Vector3 eye)
{
    Object result = *object;
    const ShapeMembers members = shape_members(&result);
    for (Vector3 *const *point = members.points; *point; point++)
        **point = vector_subtract(**point, eye);
    return result;
}

void reference_grow_object(Object *object, const Object *start, const Object *growth, double size)
{
    const double *from = (const double *)(const void *)&start->as,
                 *rate = (const double *)(const void *)&growth->as;
    double *numbers = (double *)(void *)&object->as;
    for (unsigned i = 0; i < reference_shapes[start->type]->number_count; i++)
        numbers[i] = from[i] + size * rate[i];
}

ReferenceHit reference_miss(void)
{
    return (ReferenceHit){.object = UINT32_MAX, .margin = UNBOUNDED};
}

static ReferenceHit hit_from(const Object *object, const ReferenceRay *ray)
{
    ReferenceHit hit = reference_miss();
    reference_shapes[object->type]->hit(object, ray, &hit);
    return hit;
}

ReferenceHit reference_hit_object(const Object *object, const ReferenceRay *ray)
{
    const ReferenceHit hit = hit_from(object, ray);
    if (!hit.found || quad_absolute(hit.t) * quad3_length(ray->direction) <= 1024 * hit.curvature_radius)
        return hit;
    // The relative error of the roots grows with the square of the distance over the radius, so a distant
    // hit is recomputed with the hit point as the ray's origin.
    const ReferenceRay nearby = {reference_point(ray, hit.t), ray->direction, ray->tmin - hit.t,
                                 ray->tmax - hit.t};
    ReferenceHit refined = hit_from(object, &nearby);
    if (refined.found) refined.t += hit.t;
    return refined;
}

void reference_hit_record(ReferenceHit *nearest, ReferenceHit hit, uint32_t object, const ReferenceRay *ray)
{
    Quad margin = quad_minimum(nearest->margin, hit.margin);
    if (hit.found && nearest->found)
        margin = quad_minimum(margin, quad_absolute(hit.t - nearest->t) * quad3_length(ray->direction));
    if (hit.found && !(nearest->found && hit.t >= nearest->t)) {
        *nearest = hit;
        nearest->object = object;
    }
    nearest->margin = margin;
}

ReferenceSurface reference_surface(const Object *object, Quad3 point)
{
    ReferenceSurface surface = {.normal_condition = 1};
    reference_shapes[object->type]->surface(object, point, &surface);
    return surface;
}

Quad reference_surface_distance(const ReferenceSurface *surface)
{
    Quad distance = UNBOUNDED;
    for (int i = 0; i < surface->count; i++)
        distance = quad_minimum(distance, surface->sheets[i].distance);
    return distance;
}
