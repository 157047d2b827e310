// Intersects discs, the parts of planes within circles.
#ifndef DISC_H
#define DISC_H

#include "shapes/certain_sphere.h"
#include "shapes/eye_power.h"
#include "shapes/plane.h"

// t = height / along. across / along leads from the center to the crossing, up to its sign, since only its
// square is used.
typedef struct {
    real height, along;
    Vector across;
} DiscCrossing;

// Returns a point of the disc's plane.
static inline Vector disc_foot(const Disc *disc)
{
    return vector_of(has_eye_power(disc->id) ? disc->foot : disc->center_radius);
}

static inline DiscCrossing disc_crossing(const Disc *disc, const Ray *ray)
{
    Vector normal = vector_of(disc->normal), foot = disc_foot(disc);
    Vector f = vector_subtract(ray->origin, vector_of(disc->center_radius));
    return (DiscCrossing){vector_dot(normal, vector_subtract(foot, ray->origin)),
                          vector_dot(normal, ray->direction),
                          vector_cross(normal, vector_cross(f, ray->direction))};
}

static inline DiscCrossing disc_crossing_compensated(const Disc *disc, const Ray *ray)
{
    Vector normal = vector_of(disc->normal);
    PairVector f = pair_vector_difference(ray->origin, vector_of(disc->center_radius));
    return (DiscCrossing){
        pair_vector_dot_vector(pair_vector_difference(disc_foot(disc), ray->origin), normal).high,
        pair_vector_dot_vector(pair_vector_of(normal), ray->direction).high,
        pair_vector_high(pair_vector_cross(pair_vector_cross(f, ray->direction), normal)),
    };
}

// Decides whether the crossing is inside the rim. With v the crossing from the center, (n . d) v = n x E for
// the moment E = f x d, so that |n x E|^2 <= r^2 (n . d)^2 decides without t and without cancellation at a
// distance. At less than 4 degrees to the plane all three cancel, so pairs are used there at any precision.
// Next to the eye, the power of the crossing with respect to the sphere around the disc decides.
static inline mask disc_hit(const Disc *disc, const Ray *ray, real *t)
{
    Vector center = vector_of(disc->center_radius), normal = vector_of(disc->normal);
    DiscCrossing crossing = IS_COMPENSATED ? disc_crossing_compensated(disc, ray) : disc_crossing(disc, ray);
    if (!IS_COMPENSATED) {
        real steepest_squared = vector_dot(normal, normal) * ray->squared;
        mask grazing = RAY_ACTIVE(ray) & (crossing.along * crossing.along < 0x1p-8f * steepest_squared);
        if (lanes_any(grazing)) {
            DiscCrossing compensated = disc_crossing_compensated(disc, ray);
            real_replace(&crossing.height, grazing, compensated.height);
            real_replace(&crossing.along, grazing, compensated.along);
            vector_replace(&crossing.across, grazing, compensated.across);
        }
    }
    mask hit = plane_quotient(crossing.height, crossing.along, ray, t);
    if (!lanes_any(hit)) return hit;
    if (has_eye_power(disc->id))
        return hit & (eye_power_at(disc->id, center, ray_point(ray, *t)) <= 0) & (*t > ray->tmin);
    real radius = (real)(disc->center_radius.w);
    // nearly in the plane n . d hardly determines t, but the crossing is not farther from the center than the
    // rim
    real nearest = -vector_dot(vector_subtract(ray->origin, center), ray->direction) * ray->inverse_squared;
    real half_chord = radius * real_sqrt(ray->inverse_squared);
    *t = real_clamp(*t, nearest - half_chord, nearest + half_chord);
    real scaled_radius = radius * crossing.along;
    return hit & (vector_dot(crossing.across, crossing.across) <= scaled_radius * scaled_radius) &
           (*t > ray->tmin);
}

static inline SurfacePoint disc_surface_point(const Disc *disc, const Ray *ray, real t)
{
    return plane_crossing_point(disc_foot(disc), disc->normal, ray, t);
}

// Returns the hit with bounds. Most rays miss the bounding sphere. For the others, the crossing with the
// plane is tested against the rim.
static inline CertainHit disc_certain_hit(const Disc *disc, const Ray *ray)
{
    Vector center = vector_of(disc->center_radius);
    real radius = (real)(disc->center_radius.w);
    CertainSphere bounding = certain_sphere(center, radius, ray, RAY_ACTIVE(ray));
    mask lanes = bounding.perhaps & !ray_starts_on(ray, disc->id.x);
    if (!lanes_any(lanes)) return certain_miss();
    Interval crossing;
    mask crosses = certain_plane_of(disc_foot(disc), disc->normal, ray, &crossing);
    // nearly parallel to it, the hit is not nearer than the sphere
    if (!lanes_all(crosses)) {
        real near = real_max(crossing.near, sphere_near(&bounding, ray) - bounding.t_error),
             far = sphere_far(&bounding, ray) + bounding.t_error;
        crossing.near = lanes_select(crosses, crossing.near, near);
        crossing.far = lanes_select(crosses, crossing.far, far);
    }
    CertainHit hit = certain_crossing(ray, lanes & crosses, lanes, crossing.near, crossing.far);
    Vector f = vector_subtract(ray->origin, center);
    Vector across = vector_fma(ray->direction, hit.t, f);
    real path = ray->length * fabs(hit.t);
    // 3 u of f and the path are needed, and 4 u of the radius, as for a sphere
    real position_error =
        ray_position_error(ray, path) + ray->length * (0.5f * (hit.high - hit.low)) +
        UNIT_ROUNDOFF * (4 * (vector_norm1(f) + path) + 8 * radius + vector_norm1(ray->origin));
    real squared = real_fma(radius, radius, -vector_dot(across, across));
    real band = position_error * (radius + radius + position_error);
    mask within = squared > band, beyond = crosses & (squared < -band);
    hit.uncertain = (hit.uncertain | (hit.found & !within)) & !beyond;
    hit.found = hit.found & within;
    return hit;
}

static inline mask disc_set_errors(const Disc *disc, const Ray *ray, real t, real position_error,
                                   SurfacePoint *point)
{
    return plane_point_set_height(disc_foot(disc), disc->normal, point);
}

#endif
