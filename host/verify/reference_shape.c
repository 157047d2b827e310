// Crossings, margins and distances that the reference's shapes share.
#include "host/verify/reference_shape.h"

void hit_reduce_margin(ReferenceHit *hit, Quad margin)
{
    hit->margin = quad_minimum(hit->margin, quad_absolute(margin));
}

// Keeps the hit at t if it is the nearest. A hit starts or ceases to count when the ray's start or end
// crosses the surface, so the margin is twice the height of these over the tangent plane of the hit.
void hit_keep_nearest(ReferenceHit *hit, const ReferenceRay *ray, Quad t, Quad3 normal, Quad curvature_radius)
{
    if (hit->found && t >= hit->t) return;
    Quad inverse = 1 / quad3_length(normal), approach = -quad3_dot(normal, ray->direction) * inverse;
    hit_reduce_margin(hit, 2 * (t - ray->tmin) * approach);
    hit_reduce_margin(hit, 2 * approach * (t - ray->tmax)); // may overflow for an unbounded ray
    if (!(t > ray->tmin && t < ray->tmax)) return;
    hit->found = true;
    hit->object = 0;
    hit->t = t;
    hit->normal = quad3_scale(normal, approach < 0 ? -inverse : inverse);
    hit->shading_normal = hit->normal;
    hit->entering = approach >= 0;
    hit->cosine = quad_absolute(approach) / quad3_length(ray->direction);
    hit->curvature_radius = curvature_radius;
}

void surface_measure(ReferenceSurface *surface, Vector3 center, double bounding_radius, double feature_radius)
{
    surface->center = center;
    surface->bounding_radius = bounding_radius;
    surface->feature_radius = feature_radius;
}

void surface_add(ReferenceSurface *surface, Quad distance, Quad3 normal, Quad curvature_radius)
{
    surface->sheets[surface->count++] = (ReferenceSheet){quad_absolute(distance), normal, curvature_radius};
}

void axes_around(Quad3 axis, Quad3 axes[3])
{
    axes[0] = quad3_perpendicular(axis);
    axes[1] = quad3_cross(axis, axes[0]);
    axes[2] = axis;
}

Quad3 axes_coordinates(const Quad3 axes[3], Quad3 vector)
{
    return (Quad3){quad3_dot(vector, axes[0]), quad3_dot(vector, axes[1]), quad3_dot(vector, axes[2])};
}

Quad3 axes_vector(const Quad3 axes[3], Quad3 coordinates)
{
    const Quad3 level = quad3_add(quad3_scale(axes[0], coordinates.x), quad3_scale(axes[1], coordinates.y));
    return quad3_add(level, quad3_scale(axes[2], coordinates.z));
}

Quad point_line_distance(Quad3 point, Quad3 on_line, Quad3 direction)
{
    return quad3_length(quad3_cross(quad3_subtract(point, on_line), direction)) / quad3_length(direction);
}

Quad line_distance(const ReferenceRay *ray, Quad3 on_line, Quad3 direction)
{
    Quad3 across = quad3_cross(ray->direction, direction);
    if (quad3_dot(across, across) == 0) return point_line_distance(ray->origin, on_line, direction);
    return quad_absolute(quad3_dot(quad3_subtract(ray->origin, on_line), quad3_unit(across)));
}

bool plane_crossing(const ReferenceRay *ray, Quad3 point, Quad3 normal, Quad *t)
{
    Quad approach = quad3_dot(ray->direction, normal);
    if (approach == 0) return false;
    *t = quad3_dot(quad3_subtract(point, ray->origin), normal) / approach;
    return true;
}

Quad plane_cosine(const ReferenceRay *ray, Quad3 normal)
{
    return quad_absolute(quad3_dot(quad3_unit(ray->direction), quad3_unit(normal)));
}

int quadratic_roots(Quad a, Quad b, Quad c, Quad roots[2])
{
    Quad discriminant = b * b - a * c;
    if (discriminant < 0 || (a == 0 && b == 0)) return 0;
    Quad root = quad_root(discriminant);
    Quad sum = b < 0 ? root - b : -b - root;
    roots[0] = sum == 0 ? 0 : c / sum;
    if (quad_absolute(sum) > (Quad)1e32L * quad_absolute(a)) return 1;
    roots[1] = sum / a;
    return 2;
}
