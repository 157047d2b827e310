// Intersects paraboloids, |p x w|^2 = k (p . w) for the axis w from the apex, with k = 4 |w| times the focal
// length.
//
// Along a ray p = f + t d, with q = d x w and m = f x w:
//     a = q . q,   b = m . q - k/2 (d . w),   c = m . m - k (f . w),
// and by Lagrange's identity b^2 - a c = (k/2 d . w)^2 - |w|^2 (k E . q + (w . E)^2) with the moment E = f x
// d, whose terms do not grow with the distance where b^2 and a c do. Everything is computed in pairs, because
// c cancels next to the surface and b along it.
//
// With the eye's power C, m = (o - F) x w for the axis' point F nearest to the eye, and
//     c = C + (o x w) . ((o - 2 F) x w) - k o . w.
// Next to the surface b^2 - a c then decides. Elsewhere, with the moment M = (o - F) x d and F at h w from
// the apex, E . q = M . q - h q . q and w . E = w . M.
#ifndef PARABOLOID_H
#define PARABOLOID_H

#include "shapes/axial_ray.h"
#include "shapes/certain_solid.h"
#include "shapes/ends.h"
#include "shapes/quadratic.h"
#include "shapes/surface_point.h"

// Returns the interval of t where the ray is on the apex' side of the shape's end plane.
static inline Interval paraboloid_slab(real end, Pair from, real towards)
{
    mask parallel = towards == 0, leaving = towards > 0;
    real gap = pair_subtract(pair_of(end), from).high;
    real t = real_divide(gap, lanes_select(parallel, (real)(1), towards));
    t = lanes_select(parallel, lanes_select(gap >= 0, (real)(LARGEST), (real)(-LARGEST)), t);
    return (Interval){lanes_select(leaving | parallel, (real)(-LARGEST), t),
                      lanes_select(leaving | parallel, t, (real)(LARGEST))};
}

// Returns the apex or, with the eye's power, the axis' point nearest to the eye.
static inline Vector paraboloid_foot(const Paraboloid *shape)
{
    return vector_of(has_eye_power(shape->id) ? shape->foot_lift : shape->apex_k);
}

static inline EndedCrossings paraboloid_crossings(const Paraboloid *shape, const Ray *ray)
{
    const Vector axis = vector_of(shape->axis_end), foot = paraboloid_foot(shape);
    const real half_k = (real)(0.5f * shape->apex_k.w), k = (real)(shape->apex_k.w);
    const bool has_power = has_eye_power(shape->id);
    AxialRay axial;
    axial_ray_set(&axial, shape->id, foot, axis, ray);
    const PairVector m = axial.m, q = axial.q;
    const Pair squared_m = pair_vector_dot(m, m), a = pair_vector_dot(q, q),
               bend = pair_scale(axial.rise, half_k), b = pair_subtract(pair_vector_dot(m, q), bend);
    Pair c = squared_m;
    Pair off = pair_add(pair_scale(pair_vector_dot(axial.moment, q), k),
                        pair_multiply(axial.moment_on_axis, axial.moment_on_axis));
    if (has_power) {
        c = pair_add(pair_of(eye_power_of(shape->id)), axial_power_change(foot, axis, ray));
        real lift = real_divide(k * (real)(shape->foot_lift.w), axial.squared_axis.high);
        off = pair_subtract(off, pair_scale(a, lift));
    }
    c = pair_subtract(c, pair_scale(axial.height, k));
    real discriminant = pair_subtract(pair_multiply(bend, bend), pair_multiply(axial.squared_axis, off)).high;
    if (has_power) {
        const mask near_side = fabs(c.high) < 0.5f * squared_m.high;
        real_replace(&discriminant, near_side, pair_subtract(pair_multiply(b, b), pair_multiply(a, c)).high);
    }

    EndedCrossings crossings;
    crossings.real_roots = discriminant >= 0;
    // a ray along the axis has a = 0 and one root, since the other is infinitely far on the open side
    crossings.side = quadratic_interval(quadratic_roots(a.high, b.high, c.high, discriminant));
    crossings.slab = (Interval){(real)(-LARGEST), (real)(LARGEST)};
    if (shape->id.y & REVOLUTION_FINITE)
        crossings.slab = paraboloid_slab((real)(shape->axis_end.w), axial.height, axial.rise.high);
    return crossings;
}

// Returns the lanes whose line stays clearly off the axis of a finite shape, without pairs. The squared
// radius at the end e is k e / |w|^2.
static inline mask paraboloid_is_off_line(const Paraboloid *shape, const Ray *ray)
{
    if (!(shape->id.y & REVOLUTION_FINITE) || has_eye_power(shape->id)) return mask_none();
    const Vector axis = vector_of(shape->axis_end);
    const real squared_axis = vector_dot(axis, axis),
               squared_reach = real_divide((real)(shape->apex_k.w * shape->axis_end.w), squared_axis);
    return line_is_off_axis(vector_subtract(ray->origin, vector_of(shape->apex_k)), squared_reach, axis,
                            squared_axis, (real)(0), ray);
}

static inline mask paraboloid_hit(const Paraboloid *shape, const Ray *ray, real *t)
{
    mask hit = RAY_ACTIVE(ray) & !paraboloid_is_off_line(shape, ray);
    if (!lanes_any(hit)) return hit;
    const EndedCrossings crossings = paraboloid_crossings(shape, ray);
    hit = hit & ends_first_hit(shape->id.y, ray, &crossings, t);
    return hit & (*t > ray->tmin) & (*t < LARGEST);
}

// Returns the surface point. On the cap it is moved along the axis, on the side by two Newton steps along the
// gradient of rho^2 - 4 f z, which is 2 (rho - 2 f w), for the unit axis w.
static inline SurfacePoint paraboloid_surface_point(const Paraboloid *shape, const Ray *ray, real t)
{
    const EndedCrossings crossings = paraboloid_crossings(shape, ray);
    Vector apex = vector_of(shape->apex_k), axis = vector_of(shape->axis_end);
    real squared_axis = vector_dot(axis, axis);
    real half_lift = real_divide((real)(0.5f * shape->apex_k.w), squared_axis); // 2 f / |w|
    Vector p = ray_point_from(ray, apex, t), position = p, normal = axis;
    for (uint i = 0; i < 2; i++) {
        real height = vector_dot(position, axis);
        Vector across = vector_fma(axis, -real_divide(height, squared_axis), position);
        Vector gradient = vector_fma(axis, -half_lift, across);
        real excess = real_fma(-2 * half_lift, height, vector_dot(across, across));
        real step = real_divide(excess, 2 * vector_dot(gradient, gradient));
        position = vector_fma(gradient, -step, position);
        normal = gradient;
    }
    const bool has_power = has_eye_power(shape->id);
    if (has_power) { // the foot is near the eye, the apex may be far
        Vector from_foot = ray_point_from(ray, vector_of(shape->foot_lift), t);
        real height = real_divide(vector_dot(from_foot, axis), squared_axis);
        normal = vector_fma(axis, -(height + half_lift), from_foot);
    }
    real size = vector_norm1(p) + vector_norm1(apex);
    SurfacePoint point = surface_point_make(vector_add(position, apex), vector_normalize(normal), size);
    surface_point_move_to_ray(&point, ray, t, size);

    if (shape->id.y & REVOLUTION_CAPPED) {
        real end = (real)(shape->axis_end.w), height = vector_dot(p, axis);
        if (has_power) height -= (real)(shape->foot_lift.w);
        real gap = real_divide(end - height, squared_axis);
        Vector on_plane = vector_fma(axis, gap, p);
        SurfacePoint cap = surface_point_make(vector_add(on_plane, apex), vector_normalize(axis), size);
        if (has_power) surface_point_move_to_ray(&cap, ray, t, size);
        surface_point_replace(&point, ends_on_cap(&crossings, t), &cap);
    }
    return point;
}

static inline RoundSolid paraboloid_round(const Paraboloid *shape, const Ray *ray)
{
    RoundSolid solid;
    Round *round = &solid.round;
    const Vector axis = vector_of(shape->axis_end), foot = paraboloid_foot(shape);
    real inverse = real_divide((real)(1), vector_norm(axis));
    solid.is_finite = shape->id.y & REVOLUTION_FINITE;
    solid.is_straight = false;
    *round = round_around(shape->id, foot, axis, inverse, ray);
    round->curves = true;
    round->k = (real)(shape->apex_k.w) * inverse;
    real lift = round->has_power ? (real)(shape->foot_lift.w) * inverse : (real)(0);
    solid.high = (real)(shape->axis_end.w) * inverse;
    solid.half_height = 0.5f * (solid.high + lift);
    solid.low = solid.high - 4 * solid.half_height; // well below the apex
    solid.widest = solid.is_finite ? real_sqrt(2 * solid.half_height * round->k) : round->k;
    solid.middle = vector_fma(round->axis, solid.high - solid.half_height, round->foot);
    solid.axis_error = (real)(16 * UNIT_ROUNDOFF);
    const real size = round->has_power ? (real)(0) : solid.widest + solid.half_height;
    round_set_position_errors(round, ray, solid.axis_error * size, SLOPED_ROUND_ERROR);
    return solid;
}

ROUND_SHAPE(paraboloid, Paraboloid, false, paraboloid_round(shape, ray))

#endif
