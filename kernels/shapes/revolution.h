// Intersects cylinders and cones, by the quadric of shapes/revolution_quadric.h.
#ifndef REVOLUTION_H
#define REVOLUTION_H

#include "shapes/certain_solid.h"
#include "shapes/ends.h"
#include "shapes/quadratic.h"
#include "shapes/revolution_quadric.h"

// Polishes a root by two Newton steps on |m + t q| - |g + t h|. For a cone seen along its side or from afar
// a, b and c cancel and this does not. There the plain roots are off by up to 700 ulp at 2500 sizes.
static inline real revolution_polish(const RevolutionQuadric *quadric, real t)
{
    for (uint i = 0; i < 2; i++) {
        Vector across = vector_fma(quadric->q, t, quadric->m);
        real radius = real_fma(quadric->h, t, quadric->g);
        real norm = vector_norm(across);
        real excess = (norm - fabs(radius)) * (norm + fabs(radius));
        real steepness = 2 * real_fma(-radius, quadric->h, vector_dot(across, quadric->q));
        mask steep = quotient_is_bounded(excess, steepness) & (fabs(t) < LARGEST);
        real step = real_divide(excess, lanes_select(steep, steepness, (real)(1)));
        t = lanes_select(steep, t - step, t);
    }
    return t;
}

// Returns the interval of t between the planes of a finite shape's ends.
static inline Interval revolution_slab(const Revolution *shape, const Ray *ray)
{
    const Vector base = vector_of(shape->base_radius), axis = vector_of(shape->axis_slope);
    real from, towards;
    if (IS_COMPENSATED) {
        AxialRay axial;
        axial_ray_set(&axial, shape->id, base, axis, ray);
        from = axial.height.high;
        towards = axial.rise.high;
    } else {
        from = vector_dot(has_eye_power(shape->id) ? ray->origin : vector_subtract(ray->origin, base), axis);
        towards = vector_dot(ray->direction, axis);
    }
    return slab_crossings((real)(shape->range.w), (real)(shape->range.x), (real)(0), from, towards,
                          real_inverse_or_zero(towards));
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
        real_replace(&roots.q_over_a, same_side & !quadric->compensated, polished);
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
    real_replace(&crossings.side.near, along, -everywhere);
    real_replace(&crossings.side.far, along, everywhere);
    crossings.real_roots = (has_roots & !along) | (along & (quadric->c <= zero));
    return crossings;
}

// Returns the largest radius of a finite shape times |axis|.
static inline scalar revolution_widest(const Revolution *shape)
{
    scalar base = shape->base_radius.w, slope = shape->axis_slope.w;
    return fmax(fma(slope, shape->range.w, base), fma(slope, shape->range.x, base));
}

// Returns the lanes whose line stays clearly off the axis of a finite shape or an unbounded cylinder, or off
// an unbounded double cone, whose base is its apex. Needs no pairs.
static inline mask revolution_is_off_line(const Revolution *shape, bool sloped, const Ray *ray)
{
    if (has_eye_power(shape->id)) return mask_none();
    const real zero = (real)(0);
    const Vector from = vector_subtract(ray->origin, vector_of(shape->base_radius)),
                 axis = vector_of(shape->axis_slope);
    const scalar inverse = uniform_divide(1, shape->range.y), reach = revolution_widest(shape) * inverse;
    if (sloped && !(shape->id.y & REVOLUTION_FINITE))
        return line_is_off_cone(from, (real)(shape->axis_slope.w), vector_scale(axis, (real)(inverse)), zero,
                                32 * UNIT_ROUNDOFF * vector_norm1(ray->direction), ray);
    return line_is_off_axis(from, (real)(reach * reach), axis, (real)(shape->range.z), zero, ray);
}

// Returns the lanes whose point at t is not farther from the axis than the shape's largest radius, within 8 u
// of the distance. A ray along a cone's side has a root near infinity with a random sign, and the wrong sign
// swaps inside and outside.
static inline mask revolution_reaches(const Revolution *shape, const RevolutionQuadric *quadric,
                                      const Ray *ray, real t)
{
    Vector offset = vector_scale(ray->direction, t);
    real size =
        vector_norm1(vector_subtract(ray->origin, vector_of(shape->base_radius))) + vector_norm1(offset);
    real error = (real)(8 * UNIT_ROUNDOFF * shape->range.y) * size;
    return vector_norm(vector_fma(quadric->q, t, quadric->m)) <= (real)(revolution_widest(shape)) + error;
}

static inline mask revolution_hit(const Revolution *shape, bool sloped, const Ray *ray, real *t)
{
    mask hit = RAY_ACTIVE(ray);
    if (IS_COMPENSATED) {
        hit = hit & !revolution_is_off_line(shape, sloped, ray);
        if (!lanes_any(hit)) return hit;
    }
    RevolutionQuadric quadric = revolution_quadric(shape, sloped, ray);
    // Without roots the line misses the side, unless it is within a cone everywhere but between its nappes or
    // runs along the side.
    hit = hit & ((quadric.discriminant >= 0) | (quadric.a <= 0));
    if (!lanes_any(hit)) return hit;
    const EndedCrossings crossings = revolution_crossings(shape, sloped, ray, &quadric);
    hit = hit & ends_first_hit(shape->id.y, ray, &crossings, t);
    if (sloped && (shape->id.y & REVOLUTION_FINITE)) hit = hit & revolution_reaches(shape, &quadric, ray, *t);
    return hit & (*t > ray->tmin) & (*t < LARGEST);
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
        mask mirrored = signed_radius < 0;
        real signed_slope = lanes_select(mirrored, -slope, slope);
        Vector gradient = vector_fma(axis, -signed_slope, vector_scale(radial, axis_length));
        // the apex does not have a normal; use the axis, the normal that an eye on it would expect
        mask apex = axis_distance == 0;
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
    mask at_base = height * 2 < low + high;
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
        if (has_power) height = vector_dot(ray_point(ray, t), vector_of(shape->axis_slope));
        SurfacePoint cap = revolution_cap_point(shape, p, height, rounding_scale);
        if (has_power) surface_point_move_to_ray(&cap, ray, t, rounding_scale);
        surface_point_replace(&point, ends_on_cap(&crossings, t), &cap);
    }
    return point;
}

// Bounds the roundings of a shape's numbers. Sets the axis' error and returns how far they move the shape,
// which the eye's power excludes. Both ends of a finite shape are rounded as points, which changes its length
// by less than AXIS_TURN_MAX. A point of the axis moves as far as one of them at most, the axis turns by the
// difference, and points of the side turn with it. A cone's slope is made of two rounded radii.
static inline real revolution_set_errors(RoundSolid *solid, bool sloped, Vector base)
{
    const Round *round = &solid->round;
    const real rounded = (real)(16 * UNIT_ROUNDOFF);
    solid->axis_error = rounded;
    if (round->has_power) return (real)(0);
    if (!solid->is_finite) return rounded * solid->widest;
    const Vector end = vector_fma(round->axis, solid->high, base);
    const real few = (real)((1 + AXIS_TURN_MAX) * UNIT_ROUNDOFF),
               length = solid->half_height + solid->half_height,
               moved = few * (vector_norm1(base) + vector_norm1(end)),
               sloping = sloped ? few * (solid->widest + solid->widest) : (real)(0);
    solid->axis_error = rounded + divide_or(moved + sloping, length, (real)(1));
    const real turned = rounded + divide_or(moved, length, (real)(1));
    return real_fma(solid->widest, turned, real_fma(rounded, solid->half_height, moved));
}

static inline RoundSolid round_of_revolution(const Revolution *shape, bool sloped, const Ray *ray)
{
    RoundSolid solid;
    Round *round = &solid.round;
    Vector base = vector_of(shape->base_radius);
    real inverse = real_divide((real)(1), (real)(shape->range.y));
    solid.is_finite = shape->id.y & REVOLUTION_FINITE;
    solid.is_straight = !sloped;
    *round = round_around(shape->id, base, vector_of(shape->axis_slope), inverse, ray);
    round->radius = (real)(shape->base_radius.w) * inverse;
    if (sloped) round->slope = (real)(shape->axis_slope.w);
    solid.low = (real)(shape->range.w) * inverse;
    solid.high = (real)(shape->range.x) * inverse;
    solid.half_height = 0.5f * (solid.high - solid.low);
    solid.middle = vector_fma(round->axis, solid.low + solid.half_height, base);
    solid.widest = round->radius;
    if (solid.is_finite)
        solid.widest = real_max(real_fma(round->slope, solid.low, round->radius),
                                real_fma(round->slope, solid.high, round->radius));
    round_set_position_errors(round, ray, revolution_set_errors(&solid, sloped, base),
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
    ROUND_SHAPE(name, Revolution, sloped, round_of_revolution(shape, sloped, ray))

REVOLUTION_SHAPE(cylinder, false)
REVOLUTION_SHAPE(cone, true)

#endif
