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
#ifndef REVOLUTION_H
#define REVOLUTION_H

#include "shapes/box.h"
#include "shapes/certain_solid.h"
#include "shapes/ends.h"
#include "shapes/eye_power.h"
#include "shapes/quadratic.h"

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
    quadric->discriminant = lanes_select(near_side, discriminant, quadric->discriminant);
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
    quadric->discriminant = lanes_select(leaves, (real)(-1), quadric->discriminant);
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

// Polishes a root by two Newton steps on |m + t q| - |g + t h|. For a cone seen along its side or from afar
// a, b and c cancel and this does not. There the plain roots are off by up to 700 ulp at 2500 sizes.
static inline real revolution_polish(const RevolutionQuadric *quadric, real t)
{
    for (uint i = 0; i < 2; i++) {
        Vector across = vector_fma(quadric->q, t, quadric->m);
        real radius = real_fma(quadric->h, t, quadric->g);
        real norm = vector_norm(across);
        real excess = (norm - fabs(radius)) * (norm + fabs(radius));
        real steepness = (real)(2) * real_fma(-radius, quadric->h, vector_dot(across, quadric->q));
        mask steep = quotient_is_bounded(excess, steepness) & (fabs(t) < (real)(LARGEST));
        real step = real_divide(excess, lanes_select(steep, steepness, (real)(1)));
        t = lanes_select(steep, t - step, t);
    }
    return t;
}

// Returns the interval of t between the planes of a finite shape's ends.
static inline Interval revolution_slab(const Revolution *shape, const Ray *ray)
{
    Vector axis = vector_of(shape->axis_slope);
    real from, towards;
    if (IS_COMPENSATED) {
        from = revolution_height(shape, ray).high;
        towards = pair_vector_dot_vector(pair_vector_of(ray->direction), axis).high;
    } else {
        Vector f = vector_subtract(ray->origin, vector_of(shape->base_radius));
        from = vector_dot(has_eye_power(shape->id) ? ray->origin : f, axis);
        towards = vector_dot(ray->direction, axis);
    }
    return slab_crossings((real)(shape->range.w), (real)(shape->range.x), from, towards,
                          real_inverse_or_zero(towards));
}

// Returns the lanes whose line may cross the unbounded surface: those with roots, those within a cone except
// for an interval between its nappes, and those along the side.
static inline mask revolution_line_crosses(const RevolutionQuadric *quadric)
{
    return (quadric->discriminant >= (real)(0)) | (quadric->a <= (real)(0));
}

// Returns the roots, polished where they are not compensated. A ray along the side has a = 0, one root, c /
// q, and one at infinity.
static inline QuadraticRoots revolution_roots(const RevolutionQuadric *quadric, bool sloped)
{
    QuadraticRoots roots = quadratic_roots(quadric->a, quadric->b, quadric->c, quadric->discriminant);
    if (sloped && !IS_COMPENSATED) {
        roots.c_over_q =
            lanes_select(quadric->compensated, roots.c_over_q, revolution_polish(quadric, roots.c_over_q));
        // with a near 0 a step may pass through infinity, which would swap inside and outside
        real polished = revolution_polish(quadric, roots.q_over_a);
        mask same_side = (polished < roots.c_over_q) == (roots.q_over_a < roots.c_over_q);
        roots.q_over_a = lanes_select(same_side & !quadric->compensated, polished, roots.q_over_a);
    }
    return roots;
}

static inline EndedCrossings revolution_crossings(const Revolution *shape, bool sloped, const Ray *ray,
                                                  const RevolutionQuadric *quadric)
{
    const real zero = (real)(0), everywhere = (real)(LARGEST);
    const QuadraticRoots roots = revolution_roots(quadric, sloped);
    const mask has_roots = (quadric->discriminant >= zero) | (quadric->a < zero);
    EndedCrossings crossings = {quadratic_interval(roots), {-everywhere, everywhere}, has_roots};
    if (shape->id.y & REVOLUTION_FINITE) { // the ends bound one nappe
        crossings.side = quadratic_inside(roots, quadric->a, quadric->h);
        crossings.slab = revolution_slab(shape, ray);
    }
    // along a cylinder's axis, or along a cone's through its apex, the ray is inside everywhere or nowhere
    const mask along = (quadric->a == zero) & (quadric->b == zero) & (quadric->discriminant <= zero);
    crossings.side.near = lanes_select(along, -everywhere, crossings.side.near);
    crossings.side.far = lanes_select(along, everywhere, crossings.side.far);
    crossings.real_roots = (has_roots & !along) | (along & (quadric->c <= zero));
    return crossings;
}

// Returns the lanes whose point at t is not farther from the axis than the shape's largest radius, within 8 u
// of the distance. A ray along a cone's side has a root near infinity with a random sign, and the wrong sign
// swaps inside and outside.
static inline mask revolution_reaches(const Revolution *shape, const RevolutionQuadric *quadric,
                                      const Ray *ray, real t)
{
    scalar base = shape->base_radius.w, slope = shape->axis_slope.w;
    scalar widest = fmax(fma(slope, shape->range.w, base), fma(slope, shape->range.x, base));
    Vector offset = vector_scale(ray->direction, t);
    real size =
        vector_norm1(vector_subtract(ray->origin, vector_of(shape->base_radius))) + vector_norm1(offset);
    real error = (real)(8 * UNIT_ROUNDOFF * shape->range.y) * size;
    return vector_norm(vector_fma(quadric->q, t, quadric->m)) <= (real)(widest) + error;
}

static inline mask revolution_hit(const Revolution *shape, bool sloped, const Ray *ray, real *t)
{
    RevolutionQuadric quadric = revolution_quadric(shape, sloped, ray);
    mask hit = RAY_ACTIVE(ray) & revolution_line_crosses(&quadric);
    if (!lanes_any(hit)) return hit;
    const EndedCrossings crossings = revolution_crossings(shape, sloped, ray, &quadric);
    hit = hit & ends_first_hit(shape->id.y, ray, &crossings, t);
    if (sloped && (shape->id.y & REVOLUTION_FINITE)) hit = hit & revolution_reaches(shape, &quadric, ray, *t);
    return hit & (*t > ray->tmin) & (*t < (real)(LARGEST));
}

// Returns the point of the side next to p, which is relative to the base. `height` is p . axis.
static inline SurfacePoint revolution_side_point(const Revolution *shape, bool sloped, Vector p, real height)
{
    Vector base = vector_of(shape->base_radius), axis = vector_of(shape->axis_slope);
    real axis_length = (real)(shape->range.y), squared_axis = (real)(shape->range.z);

    // outward from the axis: p minus its part along the axis
    Vector across = vector_fma(axis, -real_divide(height, squared_axis), p);
    real axis_distance = vector_norm(across);
    Vector radial = vector_normalize(across);
    real radius = real_divide((real)(shape->base_radius.w), axis_length);
    Vector normal = radial, position;
    if (sloped) {
        // |p x w| - R - k p . w has the gradient |w| radial - k w, on the mirror nappe |w| radial + k w
        real slope = (real)(shape->axis_slope.w);
        real signed_radius = real_fma(slope, height, (real)(shape->base_radius.w));
        mask mirrored = signed_radius < (real)(0);
        real signed_slope = lanes_select(mirrored, -slope, slope);
        Vector gradient = vector_fma(axis, -signed_slope, vector_scale(radial, axis_length));
        // the apex does not have a normal; use the axis, the normal that an eye on it would expect
        mask apex = axis_distance == (real)(0);
        normal = vector_normalize(vector_select(apex, axis, gradient));
        real excess = axis_distance - real_divide(fabs(signed_radius), axis_length);
        real cos_half_angle = real_divide((real)(1), real_sqrt(real_fma(slope, slope, (real)(1))));
        position = vector_fma(normal, -excess * cos_half_angle, p);
    } else {
        position = vector_fma(radial, radius - axis_distance, p);
    }
    return surface_point_make(vector_add(position, base), normal,
                              vector_norm1(p) + vector_norm1(base) + fabs(radius));
}

// Returns the point of the cap next to p, at the height of an end.
static inline SurfacePoint revolution_cap_point(const Revolution *shape, Vector p, real height,
                                                real rounding_scale)
{
    Vector axis = vector_of(shape->axis_slope);
    real low = (real)(shape->range.w), high = (real)(shape->range.x);
    mask at_base = height * (real)(2) < low + high;
    real target = lanes_select(at_base, low, high);
    Vector on_plane = vector_fma(axis, real_divide(target - height, (real)(shape->range.z)), p);
    Vector end_normal = vector_normalize(axis);
    end_normal = vector_select(at_base, vector_negate(end_normal), end_normal);
    return surface_point_make(vector_add(on_plane, vector_of(shape->base_radius)), end_normal,
                              rounding_scale);
}

// Returns the surface point. Its position is moved onto the cap's plane, or else onto the side, along its
// normal.
static inline SurfacePoint revolution_surface_point(const Revolution *shape, bool sloped, const Ray *ray,
                                                    real t)
{
    Vector p = ray_point_from(ray, vector_of(shape->base_radius), t);
    real height = vector_dot(p, vector_of(shape->axis_slope));
    SurfacePoint point = revolution_side_point(shape, sloped, p, height);
    real rounding_scale = point.rounding_scale;
    const bool has_power = has_eye_power(shape->id);
    if (IS_COMPENSATED || has_power) surface_point_move_to_ray(&point, ray, t, rounding_scale);
    if (shape->id.y & REVOLUTION_CAPPED) {
        RevolutionQuadric quadric = revolution_quadric(shape, sloped, ray);
        const EndedCrossings crossings = revolution_crossings(shape, sloped, ray, &quadric);
        // relative to the rounded F, the point of a thin plate could appear at its other end
        if (has_eye_power(shape->id)) height = vector_dot(ray_point(ray, t), vector_of(shape->axis_slope));
        SurfacePoint cap = revolution_cap_point(shape, p, height, rounding_scale);
        if (has_power) surface_point_move_to_ray(&cap, ray, t, rounding_scale);
        surface_point_replace(&point, ends_on_cap(&crossings, t), &cap);
    }
    return point;
}

// Bounds how far roundings of a shape's numbers move it, which the eye's power excludes.
static inline real revolution_shape_error(const RoundSolid *solid, Vector base)
{
    const Round *round = &solid->round;
    if (round->has_power) return (real)(0);
    const real rounded = (real)(16 * UNIT_ROUNDOFF), of_radius = rounded * solid->widest;
    if (!solid->is_finite) return of_radius;
    // both ends are rounded as points, which turns the axis
    const Vector end = vector_fma(round->axis, solid->high, base);
    const real moved = (real)(2 * UNIT_ROUNDOFF) * (vector_norm1(base) + vector_norm1(end)),
               turned = (real)(2) + divide_or(solid->widest, solid->half_height, (real)(0));
    return of_radius + real_fma(moved, turned, rounded * solid->half_height);
}

static inline RoundSolid round_of_revolution(const Revolution *shape, bool sloped, const Ray *ray)
{
    RoundSolid solid;
    Round *round = &solid.round;
    Vector base = vector_of(shape->base_radius);
    real inverse = real_divide((real)(1), (real)(shape->range.y));
    solid.is_finite = shape->id.y & REVOLUTION_FINITE;
    round->has_power = has_eye_power(shape->id);
    round->curves = false;
    round->foot = base;
    round->axis = vector_scale(vector_of(shape->axis_slope), inverse);
    round->radius = (real)(shape->base_radius.w) * inverse;
    round->slope = sloped ? (real)(shape->axis_slope.w) : (real)(0);
    round->k = (real)(0);
    round->power = round->has_power ? eye_power_of(shape->id) * inverse * inverse : (real)(0);
    round->foot_norm1 = vector_norm1(base);
    round->start = round->has_power ? ray->origin : vector_subtract(ray->origin, base);
    solid.low = (real)(shape->range.w) * inverse;
    solid.high = (real)(shape->range.x) * inverse;
    solid.half_height = (real)(0.5f) * (solid.high - solid.low);
    solid.middle = vector_fma(round->axis, solid.low + solid.half_height, base);
    solid.widest = round->radius;
    if (solid.is_finite)
        solid.widest = real_max(real_fma(round->slope, solid.low, round->radius),
                                real_fma(round->slope, solid.high, round->radius));
    round_set_place_errors(round, ray, revolution_shape_error(&solid, base),
                           sloped ? SLOPED_ROUND_ERROR : ROUND_ERROR);
    return solid;
}

// The functions of cylinders and cones, which differ only in their slope.
#define REVOLUTION_SHAPE(name, sloped)                                                                       \
    static inline mask name##_hit(const Revolution *shape, const Ray *ray, real *t)                          \
    {                                                                                                        \
        return revolution_hit(shape, sloped, ray, t);                                                        \
    }                                                                                                        \
                                                                                                             \
    static inline SurfacePoint name##_surface_point(const Revolution *shape, const Ray *ray, real t)         \
    {                                                                                                        \
        return revolution_surface_point(shape, sloped, ray, t);                                              \
    }                                                                                                        \
                                                                                                             \
    static inline RoundSolid name##_round(const Revolution *shape, const Ray *ray)                           \
    {                                                                                                        \
        return round_of_revolution(shape, sloped, ray);                                                      \
    }                                                                                                        \
                                                                                                             \
    ROUND_SHAPE(name, Revolution, sloped)

REVOLUTION_SHAPE(cylinder, false)
REVOLUTION_SHAPE(cone, true)

#endif
