// Hits with bounds of a torus. The quartic's derivative separates intervals where the distance to the tube
// has at most one zero (shapes/torus.h); the distance at their ends and around its zero, beyond all errors,
// says what is certain.
#ifndef CERTAIN_TORUS_H
#define CERTAIN_TORUS_H

#include "shapes/certain.h"
#include "shapes/torus.h"

#if IS_CERTIFIED

typedef struct {
    Vector start, axis; // the ray's origin, seen from the center
    real major, minor;
    real place0, place1; // a point at t is off by place0 + place1 |t|
} CertainTorus;

typedef struct {
    real distance, slope, rho, place;
} TorusPoint;

static inline CertainTorus certain_torus(const Torus *torus, const Ray *ray)
{
    CertainTorus certain;
    certain.start = vector_subtract(ray->origin, vector_of(torus->center_major));
    certain.axis = vector_of(torus->axis_minor);
    certain.major = (real)(torus->center_major.w);
    certain.minor = (real)(torus->axis_minor.w);
    certain.place0 =
        ray->origin_error + (real)(UNIT_ROUNDOFF) * ((real)(3) * vector_norm1(certain.start) +
                                                     (real)(2) * vector_norm1(ray->origin) +
                                                     (real)(28) * (certain.major + certain.minor));
    certain.place1 =
        real_fma(ray->length, ray->direction_error, (real)(3 * UNIT_ROUNDOFF) * vector_norm1(ray->direction));
    return certain;
}

static inline TorusPoint torus_point(const CertainTorus *torus, const Ray *ray, real t)
{
    TorusPoint point;
    Vector x = vector_fma(ray->direction, t, torus->start);
    real z = vector_dot(torus->axis, x), rise = vector_dot(torus->axis, ray->direction);
    Vector across = vector_fma(torus->axis, -z, x);
    point.rho = vector_norm(across);
    real off = point.rho - torus->major, from_circle = real_sqrt(real_fma(off, off, z * z));
    real rho_slope = vector_dot(across, ray->direction) * real_inverse_or_zero(point.rho);
    point.slope = real_fma(off, rho_slope, z * rise) * real_inverse_or_zero(from_circle);
    point.distance = from_circle - torus->minor;
    point.place = real_fma(torus->place1, fabs(t), torus->place0);
    return point;
}

// How fast the normal turns along the surface, at most.
static inline real torus_curvature(const CertainTorus *torus, real rho)
{
    real least = real_min(rho, torus->minor);
    mask flat = least > (real)(SMALLEST_RATIO);
    return lanes_select(flat, real_divide((real)(2), lanes_select(flat, least, (real)(1))),
                        (real)(1 / SMALLEST_RATIO));
}

// A ray that starts on the torus: until when it cannot return, 0 if that is unknown. Within half of the
// smaller radius the distance bends by no more than 2 over that.
static inline real torus_departure(const CertainTorus *torus, const Ray *ray)
{
    TorusPoint start = torus_point(torus, ray, (real)(0));
    real curvature = torus_curvature(torus, start.rho), cosine = fabs(start.slope) * ray->inverse_length;
    real error =
        real_fma((real)(2) * start.place, curvature, ray->direction_error) + (real)(32 * UNIT_ROUNDOFF);
    real least = real_divide((real)(2), curvature);
    mask known = cosine > (real)(4) * error;
    return lanes_select(known, (real)(0.5f) * cosine * least * ray->inverse_length, (real)(0));
}

// Narrows a bracket at whose ends the exact ray is certainly on different sides.
static inline Interval torus_bracket(const CertainTorus *torus, const Ray *ray, Interval bracket,
                                     mask entering)
{
    real low = bracket.near, high = bracket.far, t = (real)(0.5f) * (low + high);
    TorusPoint point;
    for (uint i = 0; i < TORUS_ZERO_STEPS; i++) {
        point = torus_point(torus, ray, t);
        mask before = (point.distance > (real)(0)) == entering, certain = fabs(point.distance) > point.place;
        bracket.near = lanes_select(before & certain, real_max(bracket.near, t), bracket.near);
        bracket.far = lanes_select(certain & !before, real_min(bracket.far, t), bracket.far);
        low = lanes_select(before, t, low);
        high = lanes_select(before, high, t);
        real next = bracket_next(low, high, t, point.distance, point.slope);
        mask settled = !certain | (fabs(next - t) * fabs(point.slope) <= (real)(0.25f) * point.place);
        next = lanes_select(settled, t, next);
        if (lanes_all(next == t)) break;
        t = next;
    }
    mask steep = fabs(point.slope) * ray->inverse_length > (real)(0x1p-10f);
    real width = real_divide((real)(2.5f) * point.place, lanes_select(steep, fabs(point.slope), (real)(1)));
    const real sides[2] = {t - width, t + width};
    for (uint i = 0; i < 2; i++) {
        TorusPoint side = torus_point(torus, ray, sides[i]);
        mask certain =
            steep & (fabs(side.distance) > side.place) & (sides[i] > bracket.near) & (sides[i] < bracket.far);
        mask before = (side.distance > (real)(0)) == entering;
        bracket.near = lanes_select(certain & before, sides[i], bracket.near);
        bracket.far = lanes_select(certain & !before, sides[i], bracket.far);
    }
    return bracket;
}

static inline CertainHit torus_certain_hit(const Torus *torus, const Ray *ray)
{
    const CertainTorus certain = certain_torus(torus, ray);
    const real radius = certain.major + certain.minor;
    CertainSphere bounding = certain_sphere(vector_of(torus->center_major),
                                            radius * (real)(1 + 64 * UNIT_ROUNDOFF), ray, RAY_ACTIVE(ray));
    real from = bounding.near_t - bounding.t_error, to = bounding.far_t + bounding.t_error;
    mask lanes = bounding.perhaps & (to >= ray->tmin);
    if (!lanes_any(lanes)) return certain_miss();

    Vector closest = vector_fma(ray->direction, bounding.middle_t, certain.start);
    Vector direction = vector_scale(ray->direction, ray->inverse_length);
    real squared_distance = vector_dot(closest, closest);
    real half_chord_squared = real_fma(radius * (real)(TORUS_ENLARGEMENT), radius, -squared_distance);
    TorusLine line = {vector_cross(closest, certain.axis),
                      vector_cross(direction, certain.axis),
                      vector_dot(closest, certain.axis),
                      vector_dot(direction, certain.axis),
                      certain.major,
                      certain.minor};
    real breaks[TORUS_BREAKS];
    torus_breaks(&line, squared_distance, real_sqrt(real_max(half_chord_squared, (real)(0))), breaks);

    mask left = ray->left == (integer)((scalar_integer)torus->id.x);
    real start = real_max(from, ray->tmin), departure = torus_departure(&certain, ray);
    start = lanes_select(left, departure, start);
    TorusPoint point = torus_point(&certain, ray, start);
    // a break is a turning point within rounding, whose distance that moves by less than this part of it
    const real margin = real_fma(radius, real_divide((real)(0.125f), certain.minor), (real)(2));
    mask outside = lanes_select(left, ray->leaves_outward, point.distance > (real)(0));
    mask known = fabs(point.distance) > point.place;
    known = lanes_select(left, known & (departure > (real)(0)) & (outside == (point.distance > (real)(0))),
                         known);
    mask enters = !left & (from > ray->tmin);
    outside = outside | enters;
    known = known | enters;

    CertainHit hit = certain_miss();
    real before = start;
    mask open = lanes;
    for (uint i = 1; i < TORUS_BREAKS; i++) {
        bool is_last = i + 1 == TORUS_BREAKS;
        real after = is_last ? to : real_min(real_fma(breaks[i], ray->inverse_length, bounding.middle_t), to);
        after = real_max(after, before);
        point = torus_point(&certain, ray, after);
        mask after_outside = point.distance > (real)(0),
             after_known = fabs(point.distance) > margin * point.place;
        if (is_last) after_outside = after_known = mask_all();
        mask same_place = after == before; // before the start
        after_outside = lanes_select(same_place, outside, after_outside);
        after_known = lanes_select(same_place, known, after_known);
        mask doubt = open & !(known & after_known), crosses = open & !doubt & (outside != after_outside);
        if (lanes_any(crosses)) {
            Interval bracket = torus_bracket(&certain, ray, (Interval){before, after}, outside);
            CertainHit crossing = certain_crossing(ray, crosses, crosses, bracket.near, bracket.far);
            hit = certain_select(crosses, crossing, hit);
        }
        CertainHit doubtful = certain_crossing(ray, mask_none(), doubt, before, to);
        hit = certain_select(doubt, doubtful, hit);
        open = open & !doubt & !crosses;
        if (!lanes_any(open)) break;
        before = after;
        outside = after_outside;
        known = after_known;
    }
    return hit;
}

static inline void torus_set_errors(const Torus *torus, const Ray *ray, real t, SurfacePoint *point)
{
    const CertainTorus certain = certain_torus(torus, ray);
    const TorusPoint at = torus_point(&certain, ray, t);
    point->curvature = torus_curvature(&certain, at.rho);
    point->normal_error = (real)(4) * at.place * point->curvature;
}

#endif

#endif
