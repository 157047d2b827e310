// Disc: a plane within a circle.
#ifndef DISC_H
#define DISC_H

#include "plane.h"

// Inside the rim: with v the crossing from the center, (n . d) v = n x E for the moment E = f x d, so that
// |n x E|^2 <= r^2 (n . d)^2 decides without t and without cancellation at a distance.
static inline mask disc_hit(const Disc *disc, const Ray *ray, real *t)
{
    Vector center = vector_of(disc->center_radius);
    Vector normal = vector_of(disc->normal);
    mask hit = plane_crossing(center, normal, ray, t);
    if (!lanes_any(hit)) return mask_none();

    real along = vector_dot(normal, ray->direction);
    Vector moment;
    if (IS_COMPENSATED) {
        along = pair_vector_dot_vector(pair_vector_of(normal), ray->direction).high;
        moment =
            pair_vector_high(pair_vector_cross(pair_vector_difference(ray->origin, center), ray->direction));
    } else {
        moment = vector_cross(vector_subtract(ray->origin, center), ray->direction);
    }
    Vector across = vector_cross(normal, moment);
    real radius = (real)(disc->center_radius.w);
    // nearly in the disc's plane n . d says little about t, but it lies no farther from the center than the
    // rim
    real nearest = -vector_dot(vector_subtract(ray->origin, center), ray->direction) * ray->inverse_squared;
    real half_chord = radius * real_sqrt(ray->inverse_squared);
    *t = real_min(real_max(*t, nearest - half_chord), nearest + half_chord);
    real reach = radius * along;
    return hit & (vector_dot(across, across) <= reach * reach) & (*t > ray->near);
}

static inline Patch disc_patch(const Disc *disc, const Ray *ray, real t)
{
    return plane_crossing_patch(vector_of(disc->center_radius), vector_of(disc->normal), ray, t);
}

#endif
