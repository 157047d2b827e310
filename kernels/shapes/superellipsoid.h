// A superellipsoid (Barr, Superquadrics and angle-preserving transformations, IEEE Computer Graphics and
// Applications 1(1), 1981) under a linear map, the points x, seen from the center, with f = 0 for
//     f = sum |q|^n - 1,   q = A x,   n even.
//
// Along a line f is convex, so it has at most two zeros. Newton's method from outside approaches the nearer
// one and does not pass it, except by roundings of f, at which it ends. It starts where the line enters the
// box |q| <= 1. There f is at most 2, so few steps suffice unless the ray grazes.
#ifndef SUPERELLIPSOID_H
#define SUPERELLIPSOID_H

#include "shapes/affine.h"
#include "shapes/certain_sphere.h"

// Returns a power of each component, off by power - 1 roundings.
static inline Vector superellipsoid_power(Vector q, uint power)
{
    Vector result = {(real)(1), (real)(1), (real)(1)};
    for (; power > 0; power >>= 1) {
        if (power & 1) result = (Vector){result.x * q.x, result.y * q.y, result.z * q.z};
        q = (Vector){q.x * q.x, q.y * q.y, q.z * q.z};
    }
    return result;
}

// Returns f at q and sets q^(n - 1), to which its gradient is in proportion.
static inline real superellipsoid_excess(Vector q, uint exponent, Vector *odd)
{
    *odd = superellipsoid_power(q, exponent - 1);
    return real_fma(odd->x, q.x, real_fma(odd->y, q.y, real_fma(odd->z, q.z, (real)(-1))));
}

// A line as q = middle + s towards, from its closest point to the center on, where roundings are those of the
// shape's size. The low parts are 0 unless forms are compensated.
typedef struct {
    PairVector middle, towards;
    uint exponent;
} SuperellipsoidLine;

static inline PairVector superellipsoid_map(const Superellipsoid *shape, Vector v)
{
    if (!IS_COMPENSATED) return pair_vector_of(affine_vector(shape->rows, v));
    return (PairVector){pair_vector_dot_vector(pair_vector_of(vector_of(shape->rows[0])), v),
                        pair_vector_dot_vector(pair_vector_of(vector_of(shape->rows[1])), v),
                        pair_vector_dot_vector(pair_vector_of(vector_of(shape->rows[2])), v)};
}

// Returns f at s and sets its derivative.
static inline real superellipsoid_value(const SuperellipsoidLine *line, real s, real *slope)
{
    const Vector towards = pair_vector_high(line->towards);
    const real exponent = (real)((scalar)(line->exponent));
    PairVector q;
    if (IS_COMPENSATED)
        q = (PairVector){pair_add(line->middle.x, pair_scale(line->towards.x, s)),
                         pair_add(line->middle.y, pair_scale(line->towards.y, s)),
                         pair_add(line->middle.z, pair_scale(line->towards.z, s))};
    else
        q = pair_vector_of(vector_fma(towards, s, pair_vector_high(line->middle)));
    Vector odd;
    real value = superellipsoid_excess(pair_vector_high(q), line->exponent, &odd);
    *slope = exponent * vector_dot(odd, towards);
    if (!IS_COMPENSATED) return value;
    return real_fma(exponent, vector_dot(odd, (Vector){q.x.low, q.y.low, q.z.low}), value);
}

// Returns the interval of s in the box, at `certified` enlarged by `more`. It exceeds the errors of the
// inverses of up to 5 u (superellipsoid_certain_hit).
static inline Interval superellipsoid_box(Vector middle, Vector towards, Vector more)
{
    const real one = (real)(1);
    const Interval x = slab_crossings(-one, one, more.x, middle.x, towards.x,
                                      real_inverse_or_zero(towards.x)),
                   y = slab_crossings(-one, one, more.y, middle.y, towards.y,
                                      real_inverse_or_zero(towards.y)),
                   z = slab_crossings(-one, one, more.z, middle.z, towards.z,
                                      real_inverse_or_zero(towards.z));
    return intervals_common(intervals_common(x, y), z);
}

// Enough steps. At a double zero, where a line touches the surface, a step multiplies f by (1 - 1 / n)^n, at
// most 0.36, so that 17 steps reduce f from 2 to u, and 36 in double. A lane that takes more counts as a hit.
enum { SUPERELLIPSOID_STEPS = IS_DOUBLE ? 64 : 32 };

// Moves s to the crossing ahead, or back in the lanes `backward`. Returns the lanes that have one.
static inline mask superellipsoid_search(const SuperellipsoidLine *line, mask lanes, mask backward, real *s)
{
    mask open = lanes;
    for (uint i = 0; i < SUPERELLIPSOID_STEPS && lanes_any(open); i++) {
        real slope;
        const real value = superellipsoid_value(line, *s, &slope);
        open = open & (value > (real)(0));
        const mask approaches = lanes_select(backward, slope > (real)(0), slope < (real)(0));
        lanes = lanes & (!open | approaches);
        open = open & approaches;
        const real next = *s - real_divide(value, lanes_select(open, slope, (real)(1)));
        open = open & (next != *s);
        real_replace(s, open, next);
    }
    return lanes;
}

static inline mask superellipsoid_hit(const Superellipsoid *shape, const Ray *ray, real *t)
{
    const Vector center = vector_of(shape->center);
    const real radius = (real)(shape->center.w);
    const real middle_t =
        -vector_dot(vector_subtract(ray->origin, center), ray->direction) * ray->inverse_squared;
    const Vector middle = ray_point_from(ray, center, middle_t);
    mask hit = RAY_ACTIVE(ray) & (vector_dot(middle, middle) <= radius * radius);
    if (!lanes_any(hit)) return hit;

    const SuperellipsoidLine line = {superellipsoid_map(shape, middle),
                                     superellipsoid_map(shape, ray->direction), shape->id.y};
    const Vector none = {(real)(0), (real)(0), (real)(0)};
    const Interval box =
        superellipsoid_box(pair_vector_high(line.middle), pair_vector_high(line.towards), none);
    const real start = ray->tmin - middle_t;
    hit = hit & (box.near <= box.far) & (box.far > start);
    if (!lanes_any(hit)) return hit;

    real slope, s = real_max(box.near, start);
    mask inside = (box.near < start) & (superellipsoid_value(&line, s, &slope) <= (real)(0));
    s = lanes_select(inside, box.far, s);
    hit = superellipsoid_search(&line, hit, inside, &s);
    inside = hit & !inside & !(middle_t + s > ray->tmin); // the ray enters where it starts
    if (RARELY(lanes_any(inside))) {
        s = lanes_select(inside, box.far, s);
        hit = superellipsoid_search(&line, hit, inside, &s);
    }
    *t = middle_t + s;
    return hit & (*t > ray->tmin) & (*t < (real)(LARGEST));
}

// Returns the surface point. It is moved onto the surface by Newton steps along the gradient of f. They
// diverge from far inside a shape that is thinner than roundings of its distance. So the point remains the
// ray's, off by roundings of the ray, unless the steps end on the surface and are not longer than those. The
// normal, which is the same on all surfaces around the center, is that of the ray's point.
static inline SurfacePoint superellipsoid_surface_point(const Superellipsoid *shape, const Ray *ray, real t)
{
    enum { STEPS = 3 };
    const Vector center = vector_of(shape->center), start = ray_point_from(ray, center, t);
    const real exponent = (real)((scalar)(shape->id.y)), extent = (real)(shape->extent.w);
    const real shape_scale = vector_norm1(center) + extent,
               ray_scale =
                   shape_scale + real_fma(vector_norm1(ray->direction), fabs(t), vector_norm1(ray->origin));
    Vector x = start, normal, odd;
    real excess = superellipsoid_excess(affine_vector(shape->rows, x), shape->id.y, &odd);
    for (uint i = 0; i < STEPS; i++) {
        const Vector gradient = affine_normal(shape->rows, odd);
        if (i == 0) normal = gradient;
        x = vector_fma(gradient, -divide_or(excess, exponent * vector_dot(gradient, gradient), (real)(0)), x);
        excess = superellipsoid_excess(affine_vector(shape->rows, x), shape->id.y, &odd);
    }
    const mask arrives =
        (fabs(excess) * (real)(shape->center.w) <= (real)(8 * UNIT_ROUNDOFF) * exponent * extent) &
        (vector_norm1(vector_subtract(x, start)) <= (real)(8 * UNIT_ROUNDOFF) * ray_scale);
    return surface_point_make(vector_add(vector_select(arrives, x, start), center), vector_normalize(normal),
                              lanes_select(arrives, shape_scale, ray_scale));
}

// A superellipsoid with bounds. A position that is off by e moves q by up to e times the rows' lengths. So
// the sums of the powers of |q| minus and plus that error decide what is certain.
typedef struct {
    Vector start, towards, direction_moved; // from the center; A d and its error
    real rounding;                          // of a position, except those in proportion to it
    real turned;                            // the origin's error of a ray that ends at a light, else 0
} CertainSuperellipsoid;

// Returns the errors of q that an error of the position causes.
static inline Vector superellipsoid_moved(const Superellipsoid *shape, real position_error)
{
    return (Vector){(real)(shape->rows[0].w) * position_error, (real)(shape->rows[1].w) * position_error,
                    (real)(shape->rows[2].w) * position_error};
}

static inline CertainSuperellipsoid certain_superellipsoid(const Superellipsoid *shape, const Ray *ray)
{
    const Vector center = vector_of(shape->center);
    CertainSuperellipsoid certain;
    certain.start = vector_subtract(ray->origin, center);
    certain.towards = affine_vector(shape->rows, ray->direction);
    certain.rounding = (real)(2 * UNIT_ROUNDOFF) * (vector_norm1(center) + vector_norm1(certain.start));
    certain.turned = ray->ends_at_light ? ray->origin_error : (real)(0);
    certain.direction_moved = superellipsoid_moved(
        shape, real_fma((real)(8 * UNIT_ROUNDOFF), vector_norm1(ray->direction),
                        real_fma(ray->length, ray->direction_error, certain.turned) * BOUND_SLACK));
    return certain;
}

// Bounds the distance of the exact ray's point at t, as the exact shape sees it, from the computed one,
// without the roundings in proportion to the point.
static inline real superellipsoid_position_error(const CertainSuperellipsoid *certain, const Ray *ray, real t)
{
    const real beyond = real_max(fabs(t - (real)(1)) - (real)(1), (real)(0)); // before 0 or after 2
    return (ray_position_error(ray, ray->length * fabs(t)) + certain->turned * beyond + certain->rounding) *
           BOUND_SLACK;
}

// The bounds of a sum of powers, less 1, and the least that its derivative times the side may be.
typedef struct {
    real low, high, slope;
} SuperellipsoidBounds;

// Exceeds the roundings of powers up to the 16th of numbers that are off by a rounding, 16 u + 14 u, of their
// sum or of a product, 3 u, and of the sum of the three terms of a slope.
#define SUPERELLIPSOID_ROUNDING ((real)(64 * UNIT_ROUNDOFF))

// Returns a lower bound of a term of the slope, over the exponent. The term is negative unless |q| certainly
// grows. `low` bounds |q| from below, and the odd powers are those of its bounds.
static inline real superellipsoid_least_term(real q, real towards, real moved, real low, real low_odd,
                                             real high_odd)
{
    const real speed = fabs(towards);
    const mask leaves = (q * towards > (real)(0)) & (low > (real)(0)) & (speed > moved);
    return lanes_select(leaves, low_odd * (speed - moved) * ((real)(1) - SUPERELLIPSOID_ROUNDING),
                        -high_odd * (speed + moved) * ((real)(1) + SUPERELLIPSOID_ROUNDING));
}

// Returns the bounds at t = side p, for a side of 1 or -1.
static inline SuperellipsoidBounds superellipsoid_bounds(const CertainSuperellipsoid *certain,
                                                         const Superellipsoid *shape, const Ray *ray,
                                                         real side, real p)
{
    const real zero = (real)(0), t = side * p;
    const Vector x = vector_fma(ray->direction, t, certain->start), q = affine_vector(shape->rows, x);
    const real position_error =
        real_fma((real)(8 * UNIT_ROUNDOFF), vector_norm1(x), superellipsoid_position_error(certain, ray, t)) *
        BOUND_SLACK;
    const Vector moved = superellipsoid_moved(shape, position_error),
                 size = {fabs(q.x), fabs(q.y), fabs(q.z)};
    const Vector more = vector_add(size, moved), off = vector_subtract(size, moved);
    const Vector less = {real_max(off.x, zero), real_max(off.y, zero), real_max(off.z, zero)};
    const Vector more_odd = superellipsoid_power(more, shape->id.y - 1),
                 less_odd = superellipsoid_power(less, shape->id.y - 1);
    const Vector towards = vector_scale(certain->towards, side), turned = certain->direction_moved;
    const real low = vector_dot(less, less_odd), high = vector_dot(more, more_odd);
    return (SuperellipsoidBounds){
        real_fma(low, (real)(1) - SUPERELLIPSOID_ROUNDING, (real)(-1)),
        real_fma(high, (real)(1) + SUPERELLIPSOID_ROUNDING, (real)(-1)),
        (real)((scalar)(shape->id.y)) *
            (superellipsoid_least_term(q.x, towards.x, turned.x, less.x, less_odd.x, more_odd.x) +
             superellipsoid_least_term(q.y, towards.y, turned.y, less.y, less_odd.y, more_odd.y) +
             superellipsoid_least_term(q.z, towards.z, turned.z, less.z, less_odd.z, more_odd.z))};
}

// One end of the interval of t in which the exact ray is inside. It is outside up to `outer` and, in the
// lanes `certain`, inside at `inner`.
typedef struct {
    real outer, inner, root;
    mask certain, misses;
} SuperellipsoidEnd;

// Finds the end in an interval of p = side t, outside of which the exact ray is outside. Where f is certainly
// above 0, it stays so up to where the steepest tangent that the errors permit reaches 0.
static inline SuperellipsoidEnd superellipsoid_end(const CertainSuperellipsoid *certain,
                                                   const Superellipsoid *shape, const Ray *ray, real side,
                                                   Interval part, mask lanes)
{
    enum { INNER_TRIES = 6 };
    const real few = (real)(4 * UNIT_ROUNDOFF);
    SuperellipsoidEnd end = {part.near, part.near, part.near, mask_none(), mask_none()};
    real p = part.near, width = (real)(0);
    mask open = lanes;
    for (uint i = 0; i < SUPERELLIPSOID_STEPS && lanes_any(open); i++) {
        const SuperellipsoidBounds at = superellipsoid_bounds(certain, shape, ray, side, p);
        const mask falls = at.slope < (real)(0), outside = open & (at.low > (real)(0));
        end.misses = end.misses | (outside & (at.slope >= (real)(0)));
        const real inverse = divide_or((real)(-1), lanes_select(falls, at.slope, (real)(-1)), NEVER);
        const real step = at.low * inverse * (real)(1 - 32 * UNIT_ROUNDOFF);
        real_replace(&width, open, (at.high - at.low) * inverse);
        real_replace(&end.root, open, real_fma((real)(0.5f) * (at.low + at.high), inverse, p));
        real next = p + step;
        next -= few * fabs(next);
        const mask moves = outside & falls & (next > p);
        end.misses = end.misses | (moves & (next > part.far));
        p = lanes_select(moves, next, p);
        open = moves & (next <= part.far) & (step > (real)(0.125f) * width);
    }
    end.outer = p;
    open = lanes & !end.misses;
    const real middle = (real)(0.5f) * (p + part.far);
    real more = width;
    for (uint i = 0; i < INNER_TRIES && lanes_any(open); i++, more = more + more) {
        const real inner = real_min(end.root + more, middle);
        const mask inside =
            open & (inner > p) & (superellipsoid_bounds(certain, shape, ray, side, inner).high < (real)(0));
        real_replace(&end.inner, inside, inner);
        end.certain = end.certain | inside;
        open = open & !inside;
    }
    return end;
}

static inline CertainHit superellipsoid_certain_hit(const Superellipsoid *shape, const Ray *ray)
{
    const mask leaves = ray_starts_on(ray, shape->id.x);
    const real radius = (real)(shape->center.w), one = (real)(1);
    const BoundedLine bounded = line_within_bounds(vector_of(shape->center), radius, ray);
    mask lanes = bounded.lanes & !(leaves & ray->leaves_outward);
    if (!lanes_any(lanes)) return certain_miss();

    const CertainSuperellipsoid certain = certain_superellipsoid(shape, ray);
    const Vector middle =
        affine_vector(shape->rows, vector_fma(ray->direction, bounded.middle_t, certain.start));
    const real position_error = real_max(superellipsoid_position_error(&certain, ray, bounded.part.near),
                                         superellipsoid_position_error(&certain, ray, bounded.part.far));
    const Vector moved =
        superellipsoid_moved(shape, real_fma((real)(64 * UNIT_ROUNDOFF), radius, position_error));
    // The line's points within the bounds are off by 8 u |x|_1, less than 14 u radius. Differences from the
    // box's planes, quotients and the lines' sums are off by 8 u of 1 + |middle| + moved, and sums with
    // middle_t by 1 u of both. The constants are more than twice as large.
    const real few = (real)(16 * UNIT_ROUNDOFF);
    const Vector more = {real_fma(few, fabs(middle.x) + (real)(2), moved.x),
                         real_fma(few, fabs(middle.y) + (real)(2), moved.y),
                         real_fma(few, fabs(middle.z) + (real)(2), moved.z)};
    Interval part = superellipsoid_box(middle, certain.towards, more);
    const real shift_error = few * fabs(bounded.middle_t);
    part =
        (Interval){part.near + (bounded.middle_t - shift_error), part.far + (bounded.middle_t + shift_error)};
    part = intervals_common(part, bounded.part);
    lanes = lanes & (part.near <= part.far) & (part.far >= ray->tmin);
    if (!lanes_any(lanes)) return certain_miss();

    SuperellipsoidEnd near = superellipsoid_end(&certain, shape, ray, one, part, lanes), far = near;
    lanes = lanes & !near.misses;
    far.outer = part.far;
    const mask passes = lanes & (leaves | (near.inner < ray->tmin));
    if (lanes_any(passes)) {
        const Interval backward = {-part.far, -part.near};
        const SuperellipsoidEnd end = superellipsoid_end(&certain, shape, ray, -one, backward, passes);
        real_replace(&far.outer, passes, -end.outer);
        real_replace(&far.root, passes, -end.root);
        real_replace(&far.inner, passes & end.certain, -end.inner);
        real_replace(&near.inner, end.certain & !near.certain, -end.inner);
        near.certain = near.certain | end.certain;
        lanes = lanes & !end.misses;
    }
    const CertainInterval inside = {
        {near.outer, far.outer}, {near.inner, far.inner}, {near.root, far.root}, lanes & near.certain, lanes};
    return certain_interval_hit(&inside, ray, leaves);
}

// The share of the gradient that its error may have for the normal's error to be in proportion, and the
// factor that covers the rest.
#define SUPERELLIPSOID_TURN_MAX   ((real)(0x1p-5f))
#define SUPERELLIPSOID_TURN_SLACK ((real)(1.1f))

// Sets the errors of a point's normal, the direction of the gradient sum q^(n - 1) A. An error of the
// position moves each power by its derivative, and turns the normal by the part of that row that lies across
// it.
static inline mask superellipsoid_set_errors(const Superellipsoid *shape, const Ray *ray, real t,
                                             real position_error, SurfacePoint *point)
{
    const CertainSuperellipsoid certain = certain_superellipsoid(shape, ray);
    const Vector x = vector_fma(ray->direction, t, certain.start), q = affine_vector(shape->rows, x);
    const real rounding = real_fma((real)(8 * UNIT_ROUNDOFF), vector_norm1(x), certain.rounding);
    const Vector moved = superellipsoid_moved(shape, (position_error + rounding) * BOUND_SLACK);
    const Vector size = {fabs(q.x), fabs(q.y), fabs(q.z)};
    const Vector odd = superellipsoid_power(q, shape->id.y - 1),
                 even = superellipsoid_power(vector_add(size, moved), shape->id.y - 2);
    const Vector gradient = affine_normal(shape->rows, odd);
    const real inverse = divide_or((real)(1), vector_norm(gradient), NEVER),
               count = (real)((scalar)(shape->id.y - 1));
    const Vector normal = vector_scale(gradient, inverse);
    const real evens[3] = {even.x, even.y, even.z}, odds[3] = {odd.x, odd.y, odd.z};
    real curvature = (real)(0), changed = (real)(0), total = (real)(0);
    for (uint i = 0; i < 3; i++) {
        const Vector row = vector_of(shape->rows[i]);
        const real length = (real)(shape->rows[i].w);
        const real across = vector_norm(vector_fma(normal, -vector_dot(normal, row), row)) +
                            (real)(16 * UNIT_ROUNDOFF) * length;
        curvature = real_fma(evens[i] * length, across, curvature);
        changed = real_fma(evens[i] * length, length, changed);
        total = real_fma(fabs(odds[i]), length, total);
    }
    const real scale = count * inverse * BOUND_SLACK,
               roundings = SUPERELLIPSOID_ROUNDING * total * inverse; // of the powers and the gradient
    const mask small =
        real_fma(scale * changed, position_error + rounding, roundings) < SUPERELLIPSOID_TURN_MAX;
    point->curvature = SUPERELLIPSOID_TURN_SLACK * scale * curvature;
    point->normal_error = real_fma(point->curvature, rounding, SUPERELLIPSOID_TURN_SLACK * roundings);
    real_replace(&point->curvature, !small, (real)(0));
    real_replace(&point->normal_error, !small, (real)(4)); // any normal
    return mask_none();
}

#endif
