// Computes the quadratic of a ray and a cylinder or cone, |p x w| = R + k (p . w) for the axis w from the
// base, with R = |w| times the radius there and k the tangent of the half-angle.
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

#include "shapes/axial_ray.h"

typedef struct {
    real a, b, c, discriminant;
    Vector q, m;
    real g, h;
    mask compensated; // all of these are rounded about once
} RevolutionQuadric;

static inline mask revolution_near_side(real c, Vector m)
{
    return fabs(c) < 0.5f * vector_dot(m, m);
}

// Returns c, computed from the eye's power.
static inline Pair revolution_power(const Revolution *shape, bool sloped, const AxialRay *axial,
                                    const Ray *ray)
{
    Pair c = axial_power_change(vector_of(shape->base_radius), vector_of(shape->axis_slope), ray);
    if (sloped) {
        const real twice_radius = 2 * (real)(shape->base_radius.w);
        const Pair rise = pair_scale(axial->height, (real)(shape->axis_slope.w));
        c = pair_subtract(c, pair_multiply(rise, pair_add(pair_of(twice_radius), rise)));
    }
    return pair_add(pair_of(eye_power_of(shape->id)), c);
}

static inline RevolutionQuadric revolution_quadric_compensated(const Revolution *shape, bool sloped,
                                                               const Ray *ray)
{
    const real radius = (real)(shape->base_radius.w), slope = (real)(shape->axis_slope.w);
    AxialRay axial;
    axial_ray_set(&axial, shape->id, vector_of(shape->base_radius), vector_of(shape->axis_slope), ray);
    const PairVector m = axial.m, q = axial.q;
    Pair g = pair_of(radius), h = pair_of((real)(0));
    PairVector v = {pair_scale(q.x, radius), pair_scale(q.y, radius), pair_scale(q.z, radius)};
    if (sloped) {
        g = pair_add(g, pair_scale(axial.height, slope));
        h = pair_scale(axial.rise, slope);
        v = (PairVector){pair_difference_of_products(g, q.x, h, m.x),
                         pair_difference_of_products(g, q.y, h, m.y),
                         pair_difference_of_products(g, q.z, h, m.z)};
    }
    const Pair a = pair_subtract(pair_vector_dot(q, q), pair_multiply(h, h)),
               b = pair_subtract(pair_vector_dot(m, q), pair_multiply(g, h)),
               squared_moment = pair_multiply(axial.moment_on_axis, axial.moment_on_axis);
    Pair c = pair_subtract(pair_vector_dot(m, m), pair_multiply(g, g));
    real discriminant =
        pair_subtract(pair_vector_dot(v, v), pair_multiply(axial.squared_axis, squared_moment)).high;
    if (has_eye_power(shape->id)) {
        c = revolution_power(shape, sloped, &axial, ray);
        const mask near_side = revolution_near_side(c.high, pair_vector_high(m));
        real_replace(&discriminant, near_side, pair_subtract(pair_multiply(b, b), pair_multiply(a, c)).high);
    }
    return (RevolutionQuadric){
        a.high, b.high, c.high,    discriminant, pair_vector_high(q), pair_vector_high(m),
        g.high, h.high, mask_all()};
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
    const real scaled_moment = (real)(shape->range.y) * fabs(vector_dot(vector_cross(f, d), axis));
    const real a = real_fma(-h, h, vector_dot(q, q)), b = real_fma(-g, h, vector_dot(m, q)),
               c = real_fma(-g, g, vector_dot(m, m)),
               discriminant = (scaled_radius - scaled_moment) * (scaled_radius + scaled_moment);
    return (RevolutionQuadric){a, b, c, discriminant, q, m, g, h, mask_none()};
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
    return (quadric->a > least_a) & (quadric->b > 0) & (quadric->c > least_c) & (ray->tmin >= 0);
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
