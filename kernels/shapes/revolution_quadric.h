// A cylinder or cone, |p x w| = R + k (p . w) for the axis w from the base, with R = |w| times the radius
// there and k the tangent of the half-angle.
//
// Along a ray p = f + t d, with q = d x w, m = f x w, g = R + k f . w and h = k d . w:
//     a = q . q - h^2,   b = m . q - g h,   c = m . m - g^2,
// and by Lagrange's identity b^2 - a c = |g q - h m|^2 - |w|^2 (w . E)^2 with the moment E = f x d, a
// difference of two numbers near a r^2 whatever the distance, where b^2 - a c itself cancels.
//
// With the eye's power C, f = o - F for the axis' point F nearest to the eye, so that f . w = o . w, and
//     c = C + (o x w) . ((o - 2 F) x w) - k (o . w) (2 R + k o . w),
// in which roundings of F and R count only by the origin's distance from the eye. Next to the side b^2 - a c
// then decides.
#ifndef REVOLUTION_QUADRIC_H
#define REVOLUTION_QUADRIC_H

#include "shapes/eye_power.h"

typedef struct {
    real a, b, c, discriminant;
    Vector q, m;
    real g, h;
    mask compensated; // all of these are rounded about once
} RevolutionQuadric;

// Returns f . w, rounded about once.
static inline Pair revolution_height(const Revolution *shape, const Ray *ray)
{
    Vector axis = vector_of(shape->axis_slope);
    if (has_eye_power(shape->id)) return pair_vector_dot_vector(pair_vector_of(ray->origin), axis);
    return pair_vector_dot_vector(pair_vector_difference(ray->origin, vector_of(shape->base_radius)), axis);
}

static inline mask revolution_near_side(real c, Vector m)
{
    return fabs(c) < (real)(0.5f) * vector_dot(m, m);
}

// Computes c by the eye's power, and next to the side the discriminant.
static inline void revolution_quadric_from_eye(RevolutionQuadric *quadric, const Revolution *shape,
                                               bool sloped, const Ray *ray, Pair a, Pair b)
{
    Vector base = vector_of(shape->base_radius), axis = vector_of(shape->axis_slope);
    PairVector beyond = pair_vector_difference(ray->origin, vector_scale(base, (real)(2)));
    Pair c = pair_vector_dot(pair_vector_cross(pair_vector_of(ray->origin), axis),
                             pair_vector_cross(beyond, axis));
    if (sloped) {
        real slope = (real)(shape->axis_slope.w), twice_radius = (real)(2) * (real)(shape->base_radius.w);
        Pair rise = pair_scale(revolution_height(shape, ray), slope);
        c = pair_subtract(c, pair_multiply(rise, pair_add(pair_of(twice_radius), rise)));
    }
    c = pair_add(pair_of(eye_power_of(shape->id)), c);
    mask near_side = revolution_near_side(c.high, quadric->m);
    real discriminant = pair_subtract(pair_multiply(b, b), pair_multiply(a, c)).high;
    quadric->c = c.high;
    real_replace(&quadric->discriminant, near_side, discriminant);
}

static inline RevolutionQuadric revolution_quadric_compensated(const Revolution *shape, bool sloped,
                                                               const Ray *ray)
{
    Vector base = vector_of(shape->base_radius), axis = vector_of(shape->axis_slope);
    Vector d = ray->direction;
    real radius = (real)(shape->base_radius.w), slope = (real)(shape->axis_slope.w);
    PairVector f = pair_vector_difference(ray->origin, base);
    PairVector m = pair_vector_cross(f, axis);
    PairVector q = pair_vector_cross(pair_vector_of(d), axis);
    PairVector moment = pair_vector_cross(f, d);
    Pair g = pair_of(radius), h = pair_of((real)(0));
    PairVector v;
    if (sloped) {
        g = pair_add(g, pair_scale(revolution_height(shape, ray), slope));
        h = pair_scale(pair_vector_dot_vector(pair_vector_of(d), axis), slope);
        v = (PairVector){pair_difference_of_products(g, q.x, h, m.x),
                         pair_difference_of_products(g, q.y, h, m.y),
                         pair_difference_of_products(g, q.z, h, m.z)};
    } else {
        v = (PairVector){pair_scale(q.x, radius), pair_scale(q.y, radius), pair_scale(q.z, radius)};
    }
    Pair moment_on_axis = pair_vector_dot_vector(moment, axis);
    Pair squared_axis = pair_vector_dot(pair_vector_of(axis), pair_vector_of(axis));
    Pair a = pair_subtract(pair_vector_dot(q, q), pair_multiply(h, h));
    Pair b = pair_subtract(pair_vector_dot(m, q), pair_multiply(g, h));
    RevolutionQuadric quadric;
    quadric.a = a.high;
    quadric.b = b.high;
    quadric.c = pair_subtract(pair_vector_dot(m, m), pair_multiply(g, g)).high;
    quadric.discriminant =
        pair_subtract(pair_vector_dot(v, v),
                      pair_multiply(squared_axis, pair_multiply(moment_on_axis, moment_on_axis)))
            .high;
    quadric.q = pair_vector_high(q);
    quadric.m = pair_vector_high(m);
    quadric.g = g.high;
    quadric.h = h.high;
    quadric.compensated = mask_all();
    if (has_eye_power(shape->id)) revolution_quadric_from_eye(&quadric, shape, sloped, ray, a, b);
    return quadric;
}

static inline RevolutionQuadric revolution_quadric_plain(const Revolution *shape, bool sloped, const Ray *ray)
{
    Vector axis = vector_of(shape->axis_slope), d = ray->direction;
    real radius = (real)(shape->base_radius.w), slope = (real)(shape->axis_slope.w);
    Vector f = vector_subtract(ray->origin, vector_of(shape->base_radius));
    Vector m = vector_cross(f, axis);
    Vector q = vector_cross(d, axis);
    real g = radius, h = (real)(0), scaled_radius;
    if (sloped) {
        g = real_fma(slope, vector_dot(f, axis), radius);
        h = slope * vector_dot(d, axis);
        Vector v = {difference_of_products(g, q.x, h, m.x), difference_of_products(g, q.y, h, m.y),
                    difference_of_products(g, q.z, h, m.z)};
        scaled_radius = vector_norm(v);
    } else {
        scaled_radius = radius * vector_norm(q);
    }
    real scaled_moment = (real)(shape->range.y) * fabs(vector_dot(vector_cross(f, d), axis));
    RevolutionQuadric quadric;
    quadric.a = real_fma(-h, h, vector_dot(q, q));
    quadric.b = real_fma(-g, h, vector_dot(m, q));
    quadric.c = real_fma(-g, g, vector_dot(m, m));
    quadric.discriminant = (scaled_radius - scaled_moment) * (scaled_radius + scaled_moment);
    quadric.q = q;
    quadric.m = m;
    quadric.g = g;
    quadric.h = h;
    quadric.compensated = mask_none();
    return quadric;
}

static inline RevolutionQuadric revolution_quadric_select(mask condition, RevolutionQuadric yes,
                                                          RevolutionQuadric no)
{
    return (RevolutionQuadric){lanes_select(condition, yes.a, no.a),
                               lanes_select(condition, yes.b, no.b),
                               lanes_select(condition, yes.c, no.c),
                               lanes_select(condition, yes.discriminant, no.discriminant),
                               vector_select(condition, yes.q, no.q),
                               vector_select(condition, yes.m, no.m),
                               lanes_select(condition, yes.g, no.g),
                               lanes_select(condition, yes.h, no.h),
                               lanes_select(condition, yes.compensated, no.compensated)};
}

// Returns the lanes that start outside, at least their roundings off the side, and do not approach it, so
// that no crossing is ahead. a > 0 and c must exceed their roundings, which grow with the slope. b may have
// any sign within its rounding.
static inline mask revolution_leaves_outward(const RevolutionQuadric *quadric, const Revolution *shape,
                                             const Ray *ray)
{
    real base_distance = vector_norm(vector_subtract(ray->origin, vector_of(shape->base_radius)));
    scalar steepness = 1 + fabs(shape->axis_slope.w);
    real least_c =
        (real)(32 * UNIT_ROUNDOFF * shape->range.y * steepness) * base_distance * vector_norm(quadric->m);
    real least_a = (real)(0x1p-10f * steepness) * vector_dot(quadric->q, quadric->q);
    return (quadric->a > least_a) & (quadric->b > (real)(0)) & (quadric->c > least_c) &
           (ray->tmin >= (real)(0));
}

// Refines lanes that start next to the side. Rejects those that leave it and compensates the others.
static OUT_OF_LINE void revolution_quadric_refine(RevolutionQuadric *quadric, const Revolution *shape,
                                                  bool sloped, const Ray *ray, mask near_side)
{
    mask leaves = near_side & revolution_leaves_outward(quadric, shape, ray);
    real_replace(&quadric->discriminant, leaves, (real)(-1));
    near_side = near_side & !leaves;
    if (!lanes_any(near_side)) return;
    *quadric =
        revolution_quadric_select(near_side, revolution_quadric_compensated(shape, sloped, ray), *quadric);
}

// Returns the quadric. Next to the side c cancels, and the discriminant is off by about 6 u a r^2, which
// would break the horizon of ground that is a cylinder. So pairs are used there at any precision.
static inline RevolutionQuadric revolution_quadric(const Revolution *shape, bool sloped, const Ray *ray)
{
    if (IS_COMPENSATED) return revolution_quadric_compensated(shape, sloped, ray);
    RevolutionQuadric quadric = revolution_quadric_plain(shape, sloped, ray);
    mask near_side = RAY_ACTIVE(ray) & revolution_near_side(quadric.c, quadric.m);
    if (RARELY(lanes_any(near_side))) {
        RevolutionQuadric refined = quadric; // its address would keep `quadric` itself out of registers
        revolution_quadric_refine(&refined, shape, sloped, ray, near_side);
        quadric = refined;
    }
    return quadric;
}

#endif
