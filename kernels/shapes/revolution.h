// Cylinder and cone: |p x w| = R + k (p . w) for the axis w from the base, R and k in units of |w|.
//
// Along a ray p = f + t d, with q = d x w, m = f x w, g = R + k f . w and h = k d . w:
//     a = q . q - h^2,   b = m . q - g h,   c = m . m - g^2,
// and by Lagrange's identity b^2 - a c = |g q - h m|^2 - |w|^2 (w . E)^2 with the moment E = f x d, a
// difference of two numbers near a r^2 whatever the distance, where b^2 - a c itself cancels.
#ifndef REVOLUTION_H
#define REVOLUTION_H

#include "shapes/box.h"

typedef struct {
    real a, b, c, discriminant;
    Vector q, m;
    real g, h;
    mask exact; // each of these is rounded about once
} RevolutionQuadric;

static inline RevolutionQuadric revolution_quadric_exactly(const Revolution *shape, bool sloped,
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
        g = pair_add(g, pair_scale(pair_vector_dot_vector(f, axis), slope));
        h = pair_scale(pair_vector_dot_vector(pair_vector_of(d), axis), slope);
        v = (PairVector){pair_product_difference(g, q.x, h, m.x), pair_product_difference(g, q.y, h, m.y),
                         pair_product_difference(g, q.z, h, m.z)};
    } else {
        v = (PairVector){pair_scale(q.x, radius), pair_scale(q.y, radius), pair_scale(q.z, radius)};
    }
    Pair turn = pair_vector_dot_vector(moment, axis);
    Pair squared_axis = pair_vector_dot(pair_vector_of(axis), pair_vector_of(axis));
    RevolutionQuadric quadric;
    quadric.a = pair_subtract(pair_vector_dot(q, q), pair_multiply(h, h)).high;
    quadric.b = pair_subtract(pair_vector_dot(m, q), pair_multiply(g, h)).high;
    quadric.c = pair_subtract(pair_vector_dot(m, m), pair_multiply(g, g)).high;
    quadric.discriminant =
        pair_subtract(pair_vector_dot(v, v), pair_multiply(squared_axis, pair_multiply(turn, turn))).high;
    quadric.q = pair_vector_high(q);
    quadric.m = pair_vector_high(m);
    quadric.g = g.high;
    quadric.h = h.high;
    quadric.exact = mask_all();
    return quadric;
}

static inline RevolutionQuadric revolution_quadric_plainly(const Revolution *shape, bool sloped,
                                                           const Ray *ray)
{
    Vector axis = vector_of(shape->axis_slope), d = ray->direction;
    real radius = (real)(shape->base_radius.w), slope = (real)(shape->axis_slope.w);
    Vector f = vector_subtract(ray->origin, vector_of(shape->base_radius));
    Vector m = vector_cross(f, axis);
    Vector q = vector_cross(d, axis);
    real g = radius, h = (real)(0), reach;
    if (sloped) {
        g = real_fma(slope, vector_dot(f, axis), radius);
        h = slope * vector_dot(d, axis);
        Vector v = {product_difference(g, q.x, h, m.x), product_difference(g, q.y, h, m.y),
                    product_difference(g, q.z, h, m.z)};
        reach = vector_length(v);
    } else {
        reach = radius * vector_length(q);
    }
    real turn = (real)(shape->range.y) * fabs(vector_dot(vector_cross(f, d), axis));
    RevolutionQuadric quadric;
    quadric.a = real_fma(-h, h, vector_dot(q, q));
    quadric.b = real_fma(-g, h, vector_dot(m, q));
    quadric.c = real_fma(-g, g, vector_dot(m, m));
    quadric.discriminant = (reach - turn) * (reach + turn);
    quadric.q = q;
    quadric.m = m;
    quadric.g = g;
    quadric.h = h;
    quadric.exact = mask_none();
    return quadric;
}

// For lanes that start beside the side. One that leaves it outward has no crossing ahead, and needs none.
static OUT_OF_LINE void revolution_quadric_refine(RevolutionQuadric *quadric, const Revolution *shape,
                                                  bool sloped, const Ray *ray, mask beside)
{
    // a, which is more than 0, and c well beyond their roundings, which grow with the slope; the sign of b
    // does not matter where it is within its own
    real reach = vector_length(vector_subtract(ray->origin, vector_of(shape->base_radius)));
    scalar steepness = 1 + fabs(shape->axis_slope.w);
    real least_c =
        (real)(32 * UNIT_ROUNDOFF * shape->range.y * steepness) * reach * vector_length(quadric->m);
    real least_a = (real)(0x1p-10f * steepness) * vector_dot(quadric->q, quadric->q);
    mask leaves = beside & (quadric->a > least_a) & (quadric->b > (real)(0)) & (quadric->c > least_c) &
                  (ray->near >= (real)(0));
    quadric->discriminant = lanes_select(leaves, (real)(-1), quadric->discriminant);
    beside = beside & !leaves;
    if (!lanes_any(beside)) return;
    RevolutionQuadric exact = revolution_quadric_exactly(shape, sloped, ray);
    quadric->a = lanes_select(beside, exact.a, quadric->a);
    quadric->b = lanes_select(beside, exact.b, quadric->b);
    quadric->c = lanes_select(beside, exact.c, quadric->c);
    quadric->discriminant = lanes_select(beside, exact.discriminant, quadric->discriminant);
    quadric->q = vector_select(beside, exact.q, quadric->q);
    quadric->m = vector_select(beside, exact.m, quadric->m);
    quadric->g = lanes_select(beside, exact.g, quadric->g);
    quadric->h = lanes_select(beside, exact.h, quadric->h);
    quadric->exact = beside;
}

// Next to the side c cancels, and the discriminant is off by some 6 u a r^2, which would tear the horizon of
// ground that is a cylinder: pairs there at any precision.
static inline RevolutionQuadric revolution_quadric(const Revolution *shape, bool sloped, const Ray *ray)
{
    if (IS_COMPENSATED) return revolution_quadric_exactly(shape, sloped, ray);
    RevolutionQuadric quadric = revolution_quadric_plainly(shape, sloped, ray);
    real size = vector_dot(quadric.m, quadric.m);
    mask beside = RAY_ACTIVE(ray) & (fabs(quadric.c) < (real)(0x1p-3f) * size);
    if (RARELY(lanes_any(beside))) {
        RevolutionQuadric refined = quadric;
        revolution_quadric_refine(&refined, shape, sloped, ray, beside);
        quadric = refined;
    }
    return quadric;
}

// Two Newton steps on |m + t q| - |g + t h|, which does not cancel as a, b and c do for a cone seen along its
// side or from far away: there the plain roots are off by up to 700 ulp at 2500 sizes.
static inline real revolution_polish(const RevolutionQuadric *quadric, real t)
{
    for (uint i = 0; i < 2; i++) {
        Vector across = vector_fma(quadric->q, t, quadric->m);
        real radius = real_fma(quadric->h, t, quadric->g);
        real norm = vector_length(across);
        real excess = (norm - fabs(radius)) * (norm + fabs(radius));
        real steepness = (real)(2) * real_fma(-radius, quadric->h, vector_dot(across, quadric->q));
        mask steep = (fabs(excess) * (real)(SMALLEST_RATIO) < fabs(steepness)) & (fabs(t) < (real)(LARGEST));
        real step = real_divide(excess, lanes_select(steep, steepness, (real)(1)));
        t = lanes_select(steep, t - step, t);
    }
    return t;
}

typedef struct {
    Roots
        side; // where the ray is inside the endless surface: between the roots, or, if `outer`, outside them
    mask outer;
    mask real_roots;
    Roots slab;  // where it is between the ends
    Vector m, q; // at t the point is |m + t q| / |w| from the axis
} RevolutionCrossings;

// Where the ray is between the planes of a finite shape's ends.
static inline Roots revolution_slab(const Revolution *shape, const Ray *ray)
{
    Vector axis = vector_of(shape->axis_slope);
    real from, towards;
    if (IS_COMPENSATED) {
        PairVector f = pair_vector_difference(ray->origin, vector_of(shape->base_radius));
        from = pair_vector_dot_vector(f, axis).high;
        towards = pair_vector_dot_vector(pair_vector_of(ray->direction), axis).high;
    } else {
        from = vector_dot(vector_subtract(ray->origin, vector_of(shape->base_radius)), axis);
        towards = vector_dot(ray->direction, axis);
    }
    return slab_crossings((real)(0), (real)(shape->range.x), from, towards, real_inverse_or_zero(towards));
}

// Inside the nappe that the ends cut: outside the roots, on the side where the radius grows.
static inline void revolution_keep_nappe(RevolutionCrossings *crossings, mask growing)
{
    Roots side = crossings->side;
    Roots nappe = {lanes_select(growing, side.far, (real)(-LARGEST)),
                   lanes_select(growing, (real)(LARGEST), side.near)};
    crossings->side.near = lanes_select(crossings->outer, nappe.near, side.near);
    crossings->side.far = lanes_select(crossings->outer, nappe.far, side.far);
}

// Lines that may cross the endless surface: those with roots, those inside a cone but for a stretch between
// its nappes, and those along the side.
static inline mask revolution_line_crosses(const RevolutionQuadric *quadric)
{
    return (quadric->discriminant >= (real)(0)) | (quadric->a <= (real)(0));
}

// A root is taken as q / a only where that is below the largest number; a = 0 is a ray along the side, which
// has one root, c / q, and one infinitely far.
static inline RevolutionCrossings revolution_crossings(const Revolution *shape, bool sloped, const Ray *ray,
                                                       const RevolutionQuadric *quadric)
{
    RevolutionCrossings crossings;
    crossings.m = quadric->m;
    crossings.q = quadric->q;

    real root = real_sqrt(real_max(quadric->discriminant, (real)(0)));
    mask ahead = quadric->b < (real)(0);
    real q = lanes_select(ahead, root - quadric->b, -(root + quadric->b));
    mask zero = q == (real)(0);
    mask within = fabs(q) * (real)(SMALLEST_RATIO) < fabs(quadric->a);
    mask positive_ratio = (q > (real)(0)) == (quadric->a >= (real)(0));
    real q_over_a = lanes_select(within, real_divide(q, lanes_select(within, quadric->a, (real)(1))),
                                 lanes_select(positive_ratio, (real)(LARGEST), (real)(-LARGEST)));
    real c_over_q = lanes_select(zero, q_over_a, real_divide(quadric->c, lanes_select(zero, (real)(1), q)));
    if (sloped && !IS_COMPENSATED) {
        c_over_q = lanes_select(quadric->exact, c_over_q, revolution_polish(quadric, c_over_q));
        // where a is nearly 0 a step may lead through infinity, and what lay outside the roots would lie
        // inside
        real polished = revolution_polish(quadric, q_over_a);
        mask same_side = (polished < c_over_q) == (q_over_a < c_over_q);
        q_over_a = lanes_select(same_side & !quadric->exact, polished, q_over_a);
    }
    crossings.side = (Roots){real_min(c_over_q, q_over_a), real_max(c_over_q, q_over_a)};
    crossings.outer = quadric->a < (real)(0);
    crossings.real_roots = (quadric->discriminant >= (real)(0)) | crossings.outer;

    // a ray along a cylinder's axis, or along a cone's through its apex: inside all the way, or never
    mask along = (quadric->a == (real)(0)) & zero;
    mask inside = along & (quadric->c <= (real)(0));
    crossings.side.near = lanes_select(along, (real)(-LARGEST), crossings.side.near);
    crossings.side.far = lanes_select(along, (real)(LARGEST), crossings.side.far);
    crossings.real_roots = (crossings.real_roots & !along) | inside;

    crossings.slab = (Roots){(real)(-LARGEST), (real)(LARGEST)};
    if (shape->id.y & REVOLUTION_FINITE) {
        crossings.slab = revolution_slab(shape, ray);
        revolution_keep_nappe(&crossings, quadric->h > (real)(0));
    }
    return crossings;
}

// Whether the point at t is as near to the axis as any of a finite shape's, but for 8 u of the way there. A
// ray along a cone's side has one root near infinity; its sign is noise, and the wrong one takes outside for
// inside.
static inline mask revolution_reaches(const Revolution *shape, const RevolutionCrossings *crossings,
                                      const Ray *ray, real t)
{
    scalar first = shape->base_radius.w;
    scalar widest = fmax(first, fma(shape->axis_slope.w, shape->range.x, first));
    Vector way = vector_scale(ray->direction, t);
    real size =
        vector_magnitude(vector_subtract(ray->origin, vector_of(shape->base_radius))) + vector_magnitude(way);
    real error = (real)(8 * UNIT_ROUNDOFF * shape->range.y) * size;
    return vector_length(vector_fma(crossings->q, t, crossings->m)) <= (real)(widest) + error;
}

// A capped solid is hit where the ray is inside the side and between the ends at once: one comparison decides
// both surfaces, so that no ray passes between side and cap. An open or endless one is hit at a root between
// the ends.
static inline mask revolution_hit(const Revolution *shape, bool sloped, const Ray *ray, real *t)
{
    RevolutionQuadric quadric = revolution_quadric(shape, sloped, ray);
    mask hit = RAY_ACTIVE(ray) & revolution_line_crosses(&quadric);
    if (!lanes_any(hit)) return hit;
    RevolutionCrossings crossings = revolution_crossings(shape, sloped, ray, &quadric);
    Roots side = crossings.side, slab = crossings.slab;
    hit = hit & crossings.real_roots;
    if (shape->id.y & REVOLUTION_CAPPED) {
        real near = real_max(side.near, slab.near);
        real far = real_min(side.far, slab.far);
        *t = ray_first(ray, near, far);
        hit = hit & (near <= far);
    } else {
        mask seen = shape->id.y & ONLY_INSIDE ? mask_none() : mask_all();
        mask near_counts =
            seen & (side.near > ray->near) & (side.near >= slab.near) & (side.near <= slab.far);
        *t = lanes_select(near_counts, side.near, side.far);
        hit = hit & (*t >= slab.near) & (*t <= slab.far);
    }
    if (sloped && (shape->id.y & REVOLUTION_FINITE))
        hit = hit & revolution_reaches(shape, &crossings, ray, *t);
    return hit & (*t > ray->near) & (*t < (real)(LARGEST));
}

// On a cap the point is put on the cap's plane, else on the side along its normal.
static inline Patch revolution_patch(const Revolution *shape, bool sloped, const Ray *ray, real t)
{
    RevolutionQuadric quadric = revolution_quadric(shape, sloped, ray);
    RevolutionCrossings crossings = revolution_crossings(shape, sloped, ray, &quadric);
    Vector base = vector_of(shape->base_radius), axis = vector_of(shape->axis_slope);
    real axis_length = (real)(shape->range.y), squared_axis = (real)(shape->range.z);
    Vector p = ray_point_from(ray, base, t);
    real height = vector_dot(p, axis);

    // outward from the axis: p minus its part along the axis
    Vector across = vector_fma(axis, -real_divide(height, squared_axis), p);
    real axis_distance = vector_length(across);
    Vector radial = vector_normalize(across);
    real radius = real_divide((real)(shape->base_radius.w), axis_length);
    Vector normal = radial, place;
    if (sloped) {
        // |p x w| - R - k p . w has the gradient |w| radial - k w, on the mirror nappe |w| radial + k w
        real slope = (real)(shape->axis_slope.w);
        real signed_radius = real_fma(slope, height, (real)(shape->base_radius.w));
        mask mirrored = signed_radius < (real)(0);
        real turn = lanes_select(mirrored, -slope, slope);
        Vector gradient = vector_fma(axis, -turn, vector_scale(radial, axis_length));
        // at the apex the side has no normal: the axis stands in, as it does for an eye looking at the tip
        mask apex = axis_distance == (real)(0);
        normal = vector_normalize(vector_select(apex, axis, gradient));
        real excess = axis_distance - real_divide(fabs(signed_radius), axis_length);
        // along the normal: times the cosine of the half-angle, whose tangent is the slope
        real lean = real_divide((real)(1), real_sqrt(real_fma(slope, slope, (real)(1))));
        place = vector_fma(normal, -excess * lean, p);
    } else {
        place = vector_fma(radial, radius - axis_distance, p);
    }

    real size = vector_magnitude(p) + vector_magnitude(base) + radius;
    Patch patch = patch_make(vector_add(place, base), normal, size);
    if (IS_COMPENSATED) patch_move_to_ray(&patch, ray, t, patch.size);

    if (shape->id.y & REVOLUTION_CAPPED) {
        // of the two surfaces the one whose crossing is nearer to t; at the rim the side
        real to_slab = real_min(fabs(t - crossings.slab.near), fabs(t - crossings.slab.far));
        real to_side = real_min(fabs(t - crossings.side.near), fabs(t - crossings.side.far));
        mask on_cap = to_slab < to_side;
        real end = (real)(shape->range.x);
        real target = lanes_select(height * (real)(2) < end, (real)(0), end);
        Vector on_plane = vector_fma(axis, real_divide(target - height, squared_axis), p);
        Vector end_normal = vector_normalize(axis);
        mask at_base = target == (real)(0);
        end_normal = vector_select(at_base, vector_negate(end_normal), end_normal);
        Patch cap = patch_make(vector_add(on_plane, base), end_normal, size);
        patch_keep(&patch, on_cap, &cap);
    }
    return patch;
}

static inline mask cylinder_hit(const Cylinder *cylinder, const Ray *ray, real *t)
{
    return revolution_hit(cylinder, false, ray, t);
}

static inline Patch cylinder_patch(const Cylinder *cylinder, const Ray *ray, real t)
{
    return revolution_patch(cylinder, false, ray, t);
}

static inline mask cone_hit(const Cone *cone, const Ray *ray, real *t)
{
    return revolution_hit(cone, true, ray, t);
}

static inline Patch cone_patch(const Cone *cone, const Ray *ray, real t)
{
    return revolution_patch(cone, true, ray, t);
}

#endif
