// Finds hits on tori with bounds (docs/numerics.md).
#ifndef CERTAIN_TORUS_H
#define CERTAIN_TORUS_H

#include "shapes/certain_sphere.h"
#include "shapes/torus.h"

// A torus prepared for hits with bounds. The quartic's derivative separates intervals where the distance to
// the tube has at most one zero. The distances at their ends and around the zero, beyond all errors, decide
// what is certain.
typedef struct {
    Vector start, axis; // the ray's origin, seen from the center
    real major, minor;
    real start_rounding, rounding_per_t; // bound roundings at t: start_rounding + rounding_per_t |t|
} CertainTorus;

typedef struct {
    TorusDistance distance;
    real rounding, position_error; // bounds of its error: of roundings alone, and with the ray's error
    mask outside, known;           // known: the exact ray's point is on the same side
} TorusPoint;

static inline CertainTorus certain_torus(const Torus *torus, const Ray *ray)
{
    const Vector start = vector_subtract(ray->origin, vector_of(torus->center_major));
    const real major = (real)(torus->center_major.w), minor = (real)(torus->axis_minor.w),
               per_t = 3 * UNIT_ROUNDOFF * vector_norm1(ray->direction),
               at_start = UNIT_ROUNDOFF *
                          (3 * vector_norm1(start) + 2 * vector_norm1(ray->origin) + 28 * (major + minor));
    return (CertainTorus){start, vector_of(torus->axis_minor), major, minor, at_start, per_t};
}

static inline TorusPoint torus_point(const CertainTorus *torus, const Ray *ray, real t)
{
    TorusPoint point;
    Vector x = vector_fma(ray->direction, t, torus->start);
    real z = vector_dot(torus->axis, x), rise = vector_dot(torus->axis, ray->direction);
    point.distance =
        torus_distance(vector_fma(torus->axis, -z, x), ray->direction, z, rise, torus->major, torus->minor);
    point.rounding = real_fma(torus->rounding_per_t, fabs(t), torus->start_rounding);
    point.position_error = point.rounding + ray_position_error(ray, ray->length * fabs(t));
    point.outside = point.distance.value > 0;
    point.known = fabs(point.distance.value) > point.position_error;
    return point;
}

// Returns a bound on how fast the normal turns along the surface.
static inline real torus_curvature(const CertainTorus *torus, real rho)
{
    return divide_or((real)(2), real_min(rho, torus->minor), (real)(2 / SMALLEST_RATIO));
}

// Returns the t before which a ray that starts on the torus cannot return to it, or 0 if that is unknown.
// Within half of the smaller radius the distance bends by no more than 2 over that.
static inline real torus_departure(const CertainTorus *torus, const Ray *ray)
{
    TorusPoint start = torus_point(torus, ray, (real)(0));
    real curvature = torus_curvature(torus, start.distance.rho),
         cosine = fabs(start.distance.slope) * ray_inverse_length(ray);
    real error = real_fma(2 * start.position_error, curvature, ray->direction_error) + 32 * UNIT_ROUNDOFF;
    real least = real_divide((real)(2), curvature);
    mask known = cosine > 4 * error; // the exact one is more than the half that is used
    return lanes_select(known, 0.5f * cosine * least * ray_inverse_length(ray), (real)(0));
}

// The search of a crossing, whose constants only choose points: the part of a point's error below which a
// step ends it; the least slope per length at which points next to the zero are evaluated; and their
// distance, in errors over the slope, where a quarter allows for a rough zero and for the curvature.
#define TORUS_SETTLED     ((real)(0x1p-4f))
#define TORUS_STEEPNESS   ((real)(0x1p-10f))
#define TORUS_SIDE_ERRORS ((real)(1.25f))
// At a break, a turning point within rounding, the distance is off by BREAK_ERRORS times a point's error and
// by BREAK_BEND (R + r) / r times it, for the torus' radii.
#define BREAK_ERRORS ((real)(2))
#define BREAK_BEND   ((real)(0.125f))

// Returns the crossing in a bracket at whose ends the exact ray is certainly on different sides. The bracket
// is narrowed. Only signs beyond `position_error` count.
static inline CertainHit torus_crossing(const CertainTorus *torus, const Ray *ray, Interval bracket,
                                        mask crosses, mask entering)
{
    Interval computed = bracket; // where the packet's ray crosses
    real t = interval_middle(bracket), steepness;
    TorusPoint point;
    for (uint i = 0; i < TORUS_ZERO_STEPS; i++) {
        point = torus_point(torus, ray, t);
        steepness = fabs(point.distance.slope);
        mask before = point.outside == entering;
        real_replace(&bracket.near, point.known & before, real_max(bracket.near, t));
        real_replace(&bracket.far, point.known & !before, real_min(bracket.far, t));
        real next = bracket_narrow(&computed, before, t, point.distance.value, point.distance.slope);
        mask settled = fabs(next - t) * steepness <= TORUS_SETTLED * point.position_error;
        next = lanes_select(settled, t, next);
        if (lanes_all(next == t)) break;
        t = next;
    }
    mask steep = steepness * ray_inverse_length(ray) > TORUS_STEEPNESS;
    real width =
        real_divide(TORUS_SIDE_ERRORS * point.position_error, lanes_select(steep, steepness, (real)(1)));
    const real sides[2] = {t - width, t + width};
    for (uint i = 0; i < 2; i++) {
        TorusPoint side = torus_point(torus, ray, sides[i]);
        mask certain = steep & side.known & (sides[i] > bracket.near) & (sides[i] < bracket.far);
        mask before = side.outside == entering;
        real_replace(&bracket.near, certain & before, sides[i]);
        real_replace(&bracket.far, certain & !before, sides[i]);
    }
    return certain_at(certain_crossing(ray, crosses, crosses, bracket.near, bracket.far), t);
}

static inline CertainHit torus_certain_hit(const Torus *torus, const Ray *ray)
{
    const CertainTorus certain = certain_torus(torus, ray);
    const real radius = certain.major + certain.minor;
    const BoundedLine bounded = line_within_bounds(vector_of(torus->center_major), radius, ray);
    if (!lanes_any(bounded.lanes)) return certain_miss();

    Vector closest = vector_fma(ray->direction, bounded.middle_t, certain.start);
    const TorusLine line = torus_line(torus, ray, closest, bounded.middle_t, (real)(1));
    real breaks[TORUS_BREAKS];
    torus_breaks(&line, breaks);

    mask leaves = ray_starts_on(ray, torus->id.x);
    real departure = torus_departure(&certain, ray);
    real before = lanes_select(leaves, departure, real_max(bounded.part.near, ray->tmin));
    TorusPoint point = torus_point(&certain, ray, before);
    const real margin = real_fma(radius, real_divide(BREAK_BEND, certain.minor), BREAK_ERRORS);
    mask outside = lanes_select(leaves, ray->leaves_outward, point.outside),
         known = point.known & (!leaves | ((departure > 0) & (outside == point.outside))),
         enters = !leaves & (bounded.part.near > ray->tmin);
    outside = outside | enters;
    known = known | enters;

    CertainHit hit = certain_miss();
    mask open = bounded.lanes;
    for (uint i = 1; i < TORUS_BREAKS; i++) {
        bool is_last = i + 1 == TORUS_BREAKS;
        real after = is_last ? bounded.part.far : real_min(torus_line_t(&line, breaks[i]), bounded.part.far);
        after = real_max(after, before);
        point = torus_point(&certain, ray, after);
        mask after_outside = point.outside,
             after_known = fabs(point.distance.value) > margin * point.position_error;
        if (is_last) after_outside = after_known = mask_all();
        mask same_place = after == before; // before the start
        after_outside = lanes_select(same_place, outside, after_outside);
        after_known = lanes_select(same_place, known, after_known);
        mask uncertain = open & !(known & after_known),
             crosses = open & !uncertain & (outside != after_outside);
        if (lanes_any(crosses)) {
            CertainHit crossing = torus_crossing(&certain, ray, (Interval){before, after}, crosses, outside);
            hit = certain_select(crosses, crossing, hit);
        }
        CertainHit perhaps = certain_crossing(ray, mask_none(), uncertain, before, bounded.part.far);
        hit = certain_select(uncertain, perhaps, hit);
        open = open & !uncertain & !crosses;
        if (!lanes_any(open)) break;
        before = after;
        outside = after_outside;
        known = after_known;
    }
    return hit;
}

static inline mask torus_set_errors(const Torus *torus, const Ray *ray, real t, real position_error,
                                    SurfacePoint *point)
{
    const CertainTorus certain = certain_torus(torus, ray);
    const TorusPoint at = torus_point(&certain, ray, t);
    point->curvature = torus_curvature(&certain, at.distance.rho);
    point->normal_error = 4 * at.rounding * point->curvature;
    return mask_none();
}

#endif
