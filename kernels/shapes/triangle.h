// Intersects watertight triangles. A ray through an edge or a vertex that triangles share hits at least one.
//
// Vertices relative to the ray's start are rotated into a frame whose third axis is the ray, so that a shared
// vertex gives the same numbers in every triangle. There the signs of three edge functions decide, and
// difference_of_products has the exact sign (after Woop, Benthin, Wald, Watertight ray/triangle intersection,
// JCGT 2(1), 2013; they shear along the direction's largest axis and fall back to double precision if an edge
// function is 0).
#ifndef TRIANGLE_H
#define TRIANGLE_H

#include "shapes/certain.h"
#include "shapes/interval.h"
#include "shapes/plane.h"

// A triangle's three vertices, or their attributes. Lanes may have different triangles.
typedef struct {
    Vector a, b, c;
} Corners;

static inline Corners corners_of(scalar4 a, scalar4 b, scalar4 c)
{
    return (Corners){vector_of(a), vector_of(b), vector_of(c)};
}

static inline Corners corners_select(mask condition, Corners yes, Corners no)
{
    return (Corners){vector_select(condition, yes.a, no.a), vector_select(condition, yes.b, no.b),
                     vector_select(condition, yes.c, no.c)};
}

typedef struct {
    real u, v, w;     // the edge functions opposite a, b, c; all of one sign inside, edges included
    real determinant; // their sum
    Vector a, b, c;   // the vertices, from the ray's start
    real ax, ay, bx, by, cx, cy; // the vertices across the ray
} TriangleEdges;

static inline TriangleEdges triangle_edges(Corners corners, const Ray *ray)
{
    Vector a = vector_subtract(corners.a, ray->origin);
    Vector b = vector_subtract(corners.b, ray->origin);
    Vector c = vector_subtract(corners.c, ray->origin);
    real ax = vector_dot(a, ray->across_u), ay = vector_dot(a, ray->across_v);
    real bx = vector_dot(b, ray->across_u), by = vector_dot(b, ray->across_v);
    real cx = vector_dot(c, ray->across_u), cy = vector_dot(c, ray->across_v);
    TriangleEdges edges;
    edges.u = difference_of_products(cx, by, cy, bx);
    edges.v = difference_of_products(ax, cy, ay, cx);
    edges.w = difference_of_products(bx, ay, by, ax);
    edges.determinant = edges.u + edges.v + edges.w;
    edges.a = a;
    edges.b = b;
    edges.c = c;
    edges.ax = ax;
    edges.ay = ay;
    edges.bx = bx;
    edges.by = by;
    edges.cx = cx;
    edges.cy = cy;
    return edges;
}

static inline Vector triangle_normal(const Triangle *triangle)
{
    return (Vector){(real)(triangle->a.w), (real)(triangle->b.w), (real)(triangle->c.w)};
}

// t = height / along is computed in up to three steps, each for the lanes that the one before it leaves. All
// errors are relative; boxes of the BVH allow 64 u.
//
//   plain      products with the stored normal                        30 u where well conditioned
//   accurate   the same products in twice the precision               5 u / sine of the angle to the plane
//   clamped    the accurate t between the vertices' and in their box  any angle, edge-on included
//
// The compensated precisions start at the second step; double always ends at the third.

static inline bool has_eye_height(uint4 id)
{
    return HAS_EYE_POWERS && id.w != 0;
}

// The plain step. Each product is off by at most 2 u of its factors' lengths, u of itself, and u each for the
// rounding of `to_plane`, from the ray's start to a vertex, and of the normal. It is off by 4 u if the height
// nearly vanishes, and by 5 u from the plane that the eye's height defines, since the vertex is rounded.
typedef struct {
    real height, along;
    mask behind;           // the plane lies behind the ray's start
    mask well_conditioned; // both products exceed a quarter of their factors' lengths
} TrianglePlane;

static inline TrianglePlane triangle_plane(const Triangle *triangle, Vector to_plane, const Ray *ray)
{
    Vector normal = triangle_normal(triangle);
    real normal_squared =
        (real)(triangle->a.w * triangle->a.w + triangle->b.w * triangle->b.w + triangle->c.w * triangle->c.w);
    const real quarter_squared = (real)(0x1p-4f);
    const scalar error = (has_eye_height(triangle->id) ? 5 : 4) * UNIT_ROUNDOFF;
    const real error_squared = (real)(error * error);
    TrianglePlane plane;
    plane.along = vector_dot(normal, ray->direction);
    plane.height = vector_dot(normal, to_plane);
    real height_squared = plane.height * plane.height,
         largest_squared = normal_squared * vector_dot(to_plane, to_plane);
    mask faced = plane.along * plane.along > quarter_squared * normal_squared * ray->squared;
    plane.behind =
        faced & (plane.along * plane.height < (real)(0)) & (height_squared > error_squared * largest_squared);
    plane.well_conditioned = faced & (height_squared > quarter_squared * largest_squared);
    return plane;
}

// Returns t by the accurate step. At a low angle both products cancel, so they are compensated, with the
// normal in pairs. Next to the eye the height above the plane is the eye's less n . o. `in_plane` is the t
// of rays in the triangle's plane.
static inline real triangle_t_accurate(const Triangle *triangle, const Ray *ray, real in_plane)
{
    Vector a = vector_of(triangle->a);
    real along, height;
    if (has_eye_height(triangle->id)) {
        Vector normal = triangle_normal(triangle);
        along = vector_dot_compensated(normal, ray->direction);
        height = (real)(as_float(triangle->id.w)) - vector_dot_compensated(normal, ray->origin);
    } else if (IS_COMPENSATED) {
        PairVector ab = pair_vector_difference(vector_of(triangle->b), a);
        PairVector ac = pair_vector_difference(vector_of(triangle->c), a);
        PairVector normal = {pair_difference_of_products(ab.y, ac.z, ab.z, ac.y),
                             pair_difference_of_products(ab.z, ac.x, ab.x, ac.z),
                             pair_difference_of_products(ab.x, ac.y, ab.y, ac.x)};
        along = pair_vector_dot_vector(normal, ray->direction).high;
        height = pair_vector_dot(pair_vector_difference(a, ray->origin), normal).high;
    } else {
        Vector normal = triangle_normal(triangle);
        along = vector_dot_compensated(normal, ray->direction);
        height = vector_dot_compensated(normal, vector_subtract(a, ray->origin));
    }
    return divide_or(height, along, in_plane);
}

// Returns the interval of t between the vertices' least and largest coordinate on one axis, widened by the
// slack.
static inline Interval triangle_slab(real a, real b, real c, real slack, real inverse)
{
    real low = (real_min(real_min(a, b), c) - slack) * inverse;
    real high = (real_max(real_max(a, b), c) + slack) * inverse;
    return (Interval){real_min(low, high), real_max(low, high)};
}

// Returns the largest |coordinate| on each axis.
static inline Vector corners_max_abs(Corners corners)
{
    Vector a = corners.a, b = corners.b, c = corners.c;
    return (Vector){real_max(real_max(fabs(a.x), fabs(b.x)), fabs(c.x)),
                    real_max(real_max(fabs(a.y), fabs(b.y)), fabs(c.y)),
                    real_max(real_max(fabs(a.z), fabs(b.z)), fabs(c.z))};
}

// Returns t by the clamped step. Edge-on the error of t is unbounded, while the edge functions, which do not
// depend on t, still report a hit. Clamping to the vertices' t and to their box keeps that hit on the
// triangle and within the boxes of the BVH, whose slack is four times this one.
static inline real triangle_t_clamped(const TriangleEdges *edges, const Ray *ray, real accurate_t)
{
    Vector a = edges->a, b = edges->b, c = edges->c;
    Vector max_abs = corners_max_abs((Corners){a, b, c});
    real slack = (real)(16 * UNIT_ROUNDOFF) * vector_norm1(max_abs);
    real t = accurate_t;
    Vector inverse = HAS_BOXES ? ray->inverse : ray_inverse(ray);
    t = interval_clamp(triangle_slab(a.x, b.x, c.x, slack, inverse.x), t);
    t = interval_clamp(triangle_slab(a.y, b.y, c.y, slack, inverse.y), t);
    t = interval_clamp(triangle_slab(a.z, b.z, c.z, slack, inverse.z), t);
    // the vertices' t are off by a few roundings of the largest product in them
    Vector along = ray_along(ray);
    real t_error = (real)(4 * UNIT_ROUNDOFF) *
                   (max_abs.x * fabs(along.x) + max_abs.y * fabs(along.y) + max_abs.z * fabs(along.z));
    real a_t = vector_dot(a, along), b_t = vector_dot(b, along), c_t = vector_dot(c, along);
    return interval_clamp(
        (Interval){real_min(real_min(a_t, b_t), c_t) - t_error, real_max(real_max(a_t, b_t), c_t) + t_error},
        t);
}

// Returns t by the accurate step and, at low angles or in double, the clamped one.
static inline real triangle_t_robust(const Triangle *triangle, const TriangleEdges *edges, const Ray *ray,
                                     mask hit)
{
    real t = triangle_t_accurate(triangle, ray, vector_dot(edges->a, ray_along(ray)));
    // Above a sine of 1/4 (the normal's square is 3 at most) the accurate t is within a third of the boxes'
    // slack. In double a needle's normal may be worse.
    mask grazing = hit;
    if (!IS_DOUBLE) {
        real facing = vector_dot(triangle_normal(triangle), ray->direction);
        grazing = grazing & (facing * facing < (real)(3 * 0x1p-4f) * ray->squared);
    }
    if (lanes_any(grazing)) t = lanes_select(grazing, triangle_t_clamped(edges, ray, t), t);
    return t;
}

// Returns whether the ray's line crosses the triangle, edges included. A line in the triangle's plane, where
// all edge functions are 0, does not cross it.
static inline mask triangle_is_crossed(const TriangleEdges *edges)
{
    const real zero = (real)(0);
    mask all_positive = (edges->u >= zero) & (edges->v >= zero) & (edges->w >= zero);
    mask all_negative = (edges->u <= zero) & (edges->v <= zero) & (edges->w <= zero);
    return all_positive ^ all_negative;
}

static inline mask triangle_hit(const Triangle *triangle, const Ray *ray, real *t)
{
    TriangleEdges edges = triangle_edges(corners_of(triangle->a, triangle->b, triangle->c), ray);
    const real zero = (real)(0);
    mask hit = RAY_ACTIVE(ray) & triangle_is_crossed(&edges);
    if (!lanes_any(hit)) return hit;
    mask remaining = hit;
    if (!IS_COMPENSATED) {
        TrianglePlane plane = triangle_plane(triangle, edges.a, ray);
        hit = hit & !(plane.behind & (ray->tmin >= zero));
        if (!lanes_any(hit)) return hit;
        remaining = hit & !plane.well_conditioned;
        *t = real_divide(plane.height, lanes_select(plane.well_conditioned, plane.along, (real)(1)));
    }
    if (lanes_any(remaining))
        *t = lanes_select(remaining, triangle_t_robust(triangle, &edges, ray, remaining), *t);
    return hit & (*t > ray->tmin);
}

// Barycentric coordinates of the hit point.
typedef struct {
    real a, b, c;
} TriangleWeights;

static inline TriangleWeights triangle_weights(Corners corners, const Ray *ray)
{
    TriangleEdges edges = triangle_edges(corners, ray);
    mask degenerate = edges.determinant == (real)(0);
    real inverse = real_divide((real)(1), lanes_select(degenerate, (real)(1), edges.determinant));
    return (TriangleWeights){edges.u * inverse, edges.v * inverse, edges.w * inverse};
}

static inline Vector triangle_blend(TriangleWeights weights, Corners corners)
{
    return vector_fma(corners.a, weights.a,
                      vector_fma(corners.b, weights.b, vector_scale(corners.c, weights.c)));
}

// Returns the hit point, blended from the vertices. The normal may have any length. `next_to_eye` marks
// triangles with an eye's height.
static inline SurfacePoint corners_surface_point(Corners corners, Vector normal, TriangleWeights weights,
                                                 mask next_to_eye, const Ray *ray, real t)
{
    Vector unit = vector_normalize(normal), max_abs = corners_max_abs(corners);
    SurfacePoint point =
        surface_point_make(triangle_blend(weights, corners), unit, vector_norm1_along(unit, max_abs));
    if (IS_COMPENSATED | HAS_EYE_POWERS) {
        real magnitude =
            real_max(real_max(vector_norm1(corners.a), vector_norm1(corners.b)), vector_norm1(corners.c));
        if (!IS_COMPENSATED) magnitude = lanes_select(next_to_eye, magnitude, (real)(0));
        surface_point_move_to_ray(&point, ray, t, magnitude);
    }
    return point;
}

static inline SurfacePoint triangle_surface_point(const Triangle *triangle, const Ray *ray, real t)
{
    Corners corners = corners_of(triangle->a, triangle->b, triangle->c);
    mask next_to_eye = has_eye_height(triangle->id) ? mask_all() : mask_none();
    return corners_surface_point(corners, triangle_normal(triangle), triangle_weights(corners, ray),
                                 next_to_eye, ray, t);
}

// Interpolates the shading normal from those of the vertices. A triangle whose normals are all 0 is flat.
static inline void triangle_smooth(Corners normals, TriangleWeights weights, SurfacePoint *point)
{
    Vector normal = triangle_blend(weights, normals);
    mask bends = vector_dot(normal, normal) > (real)(0);
    point->shading_normal = vector_select(bends, vector_normalize(normal), point->normal);
}

// The height of each corner's tangent plane above the point, 0 if it is below, and the most by which a
// corner's two edges together rise over its tangent plane or fall below it.
typedef struct {
    real a, b, c, steepest;
} TriangleHeights;

// Moves the start of rays to lights to the curved surface that the normals of the corners suggest, which a
// flat triangle would shade where they still face the light. Each corner moves the point up to its tangent
// plane along its normal, by its weight (Hanika, Hacking the shadow terminator, Ray Tracing Gems II, 2021,
// chapter 4). `side` is 1 where the normals face the ray, -1 where they face away, and 0 where none lifts.
static inline TriangleHeights triangle_lift(Corners corners, Corners normals, TriangleWeights weights,
                                            real side, SurfacePoint *point)
{
    Vector ab = vector_subtract(corners.a, corners.b), bc = vector_subtract(corners.b, corners.c),
           ca = vector_subtract(corners.c, corners.a);
    real ab_a = vector_dot(ab, normals.a), ca_a = vector_dot(ca, normals.a);
    real bc_b = vector_dot(bc, normals.b), ab_b = vector_dot(ab, normals.b);
    real ca_c = vector_dot(ca, normals.c), bc_c = vector_dot(bc, normals.c);
    const real zero = (real)(0);
    TriangleHeights heights = {real_max(side * (weights.b * ab_a - weights.c * ca_a), zero),
                               real_max(side * (weights.c * bc_b - weights.a * ab_b), zero),
                               real_max(side * (weights.a * ca_c - weights.b * bc_c), zero), zero};
    if (IS_CERTIFIED)
        heights.steepest =
            real_max(real_max(fabs(ab_a) + fabs(ca_a), fabs(bc_b) + fabs(ab_b)), fabs(ca_c) + fabs(bc_c));
    point->lift = triangle_blend((TriangleWeights){side * weights.a * heights.a, side * weights.b * heights.b,
                                                   side * weights.c * heights.c},
                                 normals);
    return heights;
}

// Upper bounds: `size` on the vertices' distances from the eye, `longest` on the edges' lengths.
typedef struct {
    scalar size, longest;
} TriangleSizes;

// Returns an upper bound on the length of xyz >= 0. A root would make packets wait.
static inline scalar norm_above(scalar4 a)
{
    scalar xy = a.x > a.y ? a.x : a.y, largest = xy > a.z ? xy : a.z;
    return (scalar)(0.5f + 16 * UNIT_ROUNDOFF) * (largest + (a.x + a.y + a.z));
}

static inline TriangleSizes triangle_sizes(const Triangle *triangle)
{
    scalar4 a = triangle->a, b = triangle->b, c = triangle->c;
    scalar4 high = a > b ? a : b, low = a < b ? a : b;
    high = high > c ? high : c;
    low = low < c ? low : c;
    scalar4 largest = high > -low ? high : -low;
    return (TriangleSizes){norm_above(largest), norm_above(high - low)};
}

// The signs of the edge functions. If a vertex is off by `error` along each axis of the ray's frame, they are
// off by that times the coordinates that they are made of.
typedef struct {
    mask perhaps, certain;
    real error, coordinates; // coordinates: the error of all three together, divided by `error`
} TriangleSigns;

static inline TriangleSigns triangle_signs(const TriangleEdges *edges, real error)
{
    const real zero = (real)(0);
    real a_sum = fabs(edges->ax) + fabs(edges->ay) + error, b_sum = fabs(edges->bx) + fabs(edges->by) + error,
         c_sum = fabs(edges->cx) + fabs(edges->cy) + error;
    real u_error = error * (b_sum + c_sum), v_error = error * (c_sum + a_sum),
         w_error = error * (a_sum + b_sum);
    real u_low = edges->u - u_error, v_low = edges->v - v_error, w_low = edges->w - w_error;
    real u_high = edges->u + u_error, v_high = edges->v + v_error, w_high = edges->w + w_error;
    mask misses = (real_max(real_max(u_low, v_low), w_low) > zero) &
                  (real_min(real_min(u_high, v_high), w_high) < zero);
    TriangleSigns signs;
    signs.error = error;
    signs.perhaps = !misses;
    signs.certain = ((u_low > zero) & (v_low > zero) & (w_low > zero)) |
                    ((u_high < zero) & (v_high < zero) & (w_high < zero));
    signs.coordinates = (real)(2) * (a_sum + b_sum + c_sum);
    return signs;
}

// Returns the error across the ray of a vertex up to `distance` from the ray's start and `size` from the eye.
// Its place before it is rounded may be farther along the ray by u `size`.
static inline real triangle_place_error(const Ray *ray, real distance, real size)
{
    return ray_place_error(ray, distance) +
           (real)(UNIT_ROUNDOFF)*real_fma((real)(TRIANGLE_ERROR), distance, (real)(1.05f) * size);
}

// Returns a bound on the error of the vertices' coordinates in the ray's frame.
static inline real triangle_frame_error(const TriangleEdges *edges, const Ray *ray, real size)
{
    const real distance = vector_norm1(corners_max_abs((Corners){edges->a, edges->b, edges->c}));
    return triangle_place_error(ray, distance, size) * ray->across_length;
}

// At `certified`, the largest error of a stored normal in addition to its rounding
// (host/compile/shapes/triangle.c).
#define TRIANGLE_NORMAL_ERROR ((scalar)((IS_DOUBLE ? 64 : 0x1p-4f) * UNIT_ROUNDOFF))

// Narrows the bounds on the t of a triangle that is hit, by where its plane is crossed. They are wide where
// the triangle is slim, as its weights are then sensitive to errors.
static inline void triangle_narrow_by_plane(const Triangle *triangle, const Ray *ray, mask lanes,
                                            Interval *bounds, real *t)
{
    Interval plane;
    lanes = lanes & certain_plane(vector_of(triangle->a), triangle_normal(triangle), (real)(1.7321f),
                                  TRIANGLE_NORMAL_ERROR, ray, &plane);
    plane = intervals_common(*bounds, plane);
    lanes = lanes & (plane.near <= plane.far);
    bounds->near = lanes_select(lanes, plane.near, bounds->near);
    bounds->far = lanes_select(lanes, plane.far, bounds->far);
    *t = lanes_select(lanes, interval_middle(plane), *t);
}

// Returns the crossing with bounds. t is between those of the vertices, weighted by the edge functions. The
// vertices of a triangle that is hit are not farther across the ray than its longest edge and the error.
// `sinks` marks the lanes whose ray leaves this triangle into its plane, which certainly lies ahead.
static inline ALWAYS_INLINE CertainHit triangle_certain_crossing(const Triangle *triangle,
                                                                 const TriangleEdges *edges, const Ray *ray,
                                                                 mask sinks, TriangleSigns signs,
                                                                 TriangleSizes sizes)
{
    const real error = signs.error;
    mask perhaps = signs.perhaps;
    const Vector along = ray_along(ray);
    real a_t = vector_dot(edges->a, along), b_t = vector_dot(edges->b, along),
         c_t = vector_dot(edges->c, along);
    real low = real_min(real_min(a_t, b_t), c_t), high = real_max(real_max(a_t, b_t), c_t);
    real distance = real_fma(real_max(-low, high), ray->length, (real)(sizes.longest)) + (real)(4) * error;
    real place = triangle_place_error(ray, distance, (real)(sizes.size));
    real vertex_error = ray_inverse_length(ray) * real_fma((real)(12 * UNIT_ROUNDOFF), distance, place);
    // most triangles that lines hit lie behind the start or beyond the end
    perhaps = perhaps & (sinks | !ray_excludes(ray, low - vertex_error, high + vertex_error));
    if (!lanes_any(perhaps)) return certain_miss();
    real edge_error = signs.coordinates * real_min(error, place * ray->across_length);
    // applies to uncertain lanes, which are hit, if at all, where the weights say
    mask narrows = perhaps & (fabs(edges->determinant) > (real)(8) * edge_error);
    real inverse = real_divide((real)(1), lanes_select(narrows, edges->determinant, (real)(1)));
    real t = c_t + real_fma(a_t - c_t, edges->u * inverse, (b_t - c_t) * (edges->v * inverse));
    // for all weights, the edge functions' errors and as much of the determinant's, over 7/8 of it: 16/7
    real part = (real)(2.5f) * edge_error * fabs(inverse);
    real t_error = (high - low) * (part + (real)(16 * UNIT_ROUNDOFF)) +
                   real_fma((real)(4 * UNIT_ROUNDOFF), fabs(t), vertex_error);
    low = low - vertex_error;
    high = high + vertex_error;
    Interval bounds = {lanes_select(narrows, real_max(low, t - t_error), low),
                       lanes_select(narrows, real_min(high, t + t_error), high)};
    mask slim = perhaps & !(narrows & (t_error <= (real)(4) * vertex_error));
    if (lanes_any(slim)) triangle_narrow_by_plane(triangle, ray, slim, &bounds, &t);
    if (HAS_SMOOTH_NORMALS) {
        bounds.near = lanes_select(sinks, real_max(bounds.near, (real)(SMALLEST_RATIO)), bounds.near);
        bounds.far = real_max(bounds.near, bounds.far);
    }
    CertainHit hit = certain_crossing(ray, signs.certain, perhaps, bounds.near, bounds.far);
    return certain_select(narrows, certain_at(hit, t), hit);
}

// Returns the lanes whose rays pass to one side of all vertices, as seen along an axis of their frame.
// Edge-on, where all edge functions vanish, only this test decides.
static inline mask triangle_is_passed(const TriangleEdges *edges, real error)
{
    real ax = edges->ax, ay = edges->ay, bx = edges->bx, by = edges->by, cx = edges->cx, cy = edges->cy;
    return (real_min(real_min(ax, bx), cx) > error) | (real_max(real_max(ax, bx), cx) < -error) |
           (real_min(real_min(ay, by), cy) > error) | (real_max(real_max(ay, by), cy) < -error);
}

// Returns the hit with bounds. First rejects by one error for all edge functions (docs/numerics.md).
static inline CertainHit triangle_certain_hit(const Triangle *triangle, const Ray *ray)
{
    TriangleEdges edges = triangle_edges(corners_of(triangle->a, triangle->b, triangle->c), ray);
    TriangleSizes sizes = triangle_sizes(triangle);
    real error = triangle_frame_error(&edges, ray, (real)(sizes.size));
    real edge_error = error * real_fma(error, (real)(24), ray->across_length * (real)(3.5f * sizes.longest));
    real highest = real_max(real_max(edges.u, edges.v), edges.w),
         lowest = real_min(real_min(edges.u, edges.v), edges.w);
    mask lanes = RAY_ACTIVE(ray) & !((highest > edge_error) & (lowest < -edge_error));
    if (!lanes_any(lanes)) return certain_miss();
    TriangleSigns signs = triangle_signs(&edges, error);
    mask leaves = ray_cannot_rehit(ray, triangle->id.x, true), sinks = mask_none();
    if (HAS_SMOOTH_NORMALS) sinks = leaves & ray->sinks;
    signs.perhaps = lanes & signs.perhaps & (!leaves | sinks);
    if (!lanes_any(signs.perhaps)) return certain_miss();
    CertainHit hit = triangle_certain_crossing(triangle, &edges, ray, sinks, signs, sizes);
    if (RARELY(lanes_any(hit.uncertain))) hit.uncertain = hit.uncertain & !triangle_is_passed(&edges, error);
    return hit;
}

// Returns a bound on the height of a point over the exact triangle's plane, of which `vertex` is a rounded
// vertex and `unit` the normal.
static inline real triangle_height(Vector vertex, Vector unit, Vector position)
{
    return certain_plane_height(vertex, unit, 4 * UNIT_ROUNDOFF + 2 * TRIANGLE_NORMAL_ERROR, position);
}

// Returns a bound on the ratio of a triangle's length to its height, over its length. A vertex that moves by
// e turns the normal by at most e times this, and a point that moves by e moves its weights by as much.
static inline real triangle_slimness(Corners corners)
{
    Vector ab = vector_subtract(corners.b, corners.a), ac = vector_subtract(corners.c, corners.a),
           bc = vector_subtract(corners.c, corners.b);
    Vector across = vector_cross(ab, ac);
    real longest_squared = real_max(real_max(vector_dot(ab, ab), vector_dot(ac, ac)), vector_dot(bc, bc)),
         area_squared = vector_dot(across, across);
    return real_sqrt(divide_or(longest_squared, area_squared, (real)(1 / SMALLEST_RATIO)));
}

// Bounds the distance between the points of the exact and of the computed weights, in addition to the error
// of the position: by the rounding of each vertex, and by the error across the ray of the frame's vertices,
// over the cosine of incidence.
static inline real triangle_weights_error(Corners corners, const Ray *ray, real cosine)
{
    const Corners from_start = {vector_subtract(corners.a, ray->origin),
                                vector_subtract(corners.b, ray->origin),
                                vector_subtract(corners.c, ray->origin)};
    const real size = vector_norm1(corners_max_abs(corners)),
               distance = vector_norm1(corners_max_abs(from_start));
    const real across = (real)(UNIT_ROUNDOFF)*real_fma((real)(6), distance, (real)(2) * size);
    return real_fma((real)(4 * UNIT_ROUNDOFF), size, divide_or(across, cosine, NEVER));
}

// Sets the errors of the normals. If they are blended, they move with the weights.
static inline void triangle_set_normal_errors(Corners normals, TriangleWeights weights, real slimness,
                                              real weights_error, SurfacePoint *point)
{
    Vector ab = vector_subtract(normals.a, normals.b), bc = vector_subtract(normals.b, normals.c);
    real apart_squared = (real)(2) * (vector_dot(ab, ab) + vector_dot(bc, bc));
    Vector blend = triangle_blend(weights, normals);
    real bend = real_sqrt(divide_or(apart_squared, vector_dot(blend, blend), (real)(0)));
    point->curvature = (real)(2.5f) * bend * slimness;
    point->normal_error = real_fma(weights_error, point->curvature, (real)(2 * TRIANGLE_NORMAL_ERROR));
}

// Sets the error of the lift in the lanes with a side (docs/numerics.md).
static inline void triangle_set_lift_error(Corners corners, TriangleHeights heights, real side, real slimness,
                                           real place_error, SurfacePoint *point)
{
    real size = vector_norm1(corners_max_abs(corners));
    Corners edges = {vector_subtract(corners.a, corners.b), vector_subtract(corners.b, corners.c),
                     vector_subtract(corners.c, corners.a)};
    real rounded = real_fma((real)(16 * UNIT_ROUNDOFF), vector_norm1(corners_max_abs(edges)),
                            (real)(4 * UNIT_ROUNDOFF) * size);
    real weight_error = real_fma((real)(36 * UNIT_ROUNDOFF), size, place_error) * slimness;
    real height_error = real_fma(weight_error, heights.steepest + rounded, rounded);
    real heights_sum = heights.a + heights.b + heights.c;
    real error = real_fma(weight_error, heights_sum + (real)(3) * height_error, height_error);
    point->lift_error = lanes_select(side == (real)(0), (real)(0), error);
}

// Returns the lanes whose rays leave a neighbor of this triangle for good. Their start is on the neighbor or,
// if lifted, in front of it. So they cannot hit this triangle if it lies behind the neighbor's plane and they
// leave to its front, nor if they run to the side of this triangle's plane that the neighbor is on, unless
// they may be lifted across that plane.
static inline mask triangle_left_behind(const Triangle *triangle, const TriangleNeighbors *neighbors,
                                        const Ray *ray, mask lanes)
{
    uint4 ids_sides = neighbors->ids_sides;
    integer by_a = (integer)((scalar_integer)ids_sides.x), by_b = (integer)((scalar_integer)ids_sides.y),
            by_c = (integer)((scalar_integer)ids_sides.z);
    mask over_a = lanes & (ray->origin_object == by_a), over_b = lanes & (ray->origin_object == by_b),
         over_c = lanes & (ray->origin_object == by_c);
    if (!lanes_any(over_a | over_b | over_c)) return mask_none();
    const integer none = (integer)(0);
    integer sides = lanes_select(over_a, (integer)((scalar_integer)(ids_sides.w & 15)), none);
    sides = lanes_select(over_b, (integer)((scalar_integer)(ids_sides.w >> NEIGHBOR_SIDES_BITS & 15)), sides);
    sides = lanes_select(over_c, (integer)((scalar_integer)(ids_sides.w >> (2 * NEIGHBOR_SIDES_BITS) & 15)),
                         sides);
    mask is_behind = (sides & (integer)(NEIGHBOR_HAS_THIS_BEHIND)) != none;
    if (HAS_SMOOTH_NORMALS) {
        mask lifts_away = ray->leaves_outward & ((sides & (integer)(NEIGHBOR_LIFTS_AWAY)) != none);
        sides = lanes_select(ray->is_lifted & !lifts_away, none, sides);
    }
    mask in_front = (sides & (integer)(NEIGHBOR_IN_FRONT)) != none,
         behind = (sides & (integer)(NEIGHBOR_BEHIND)) != none;
    Vector normal = triangle_normal(triangle);
    Vector unsigned_normal = {fabs(normal.x), fabs(normal.y), fabs(normal.z)};
    real turned = ray->direction_error + (real)(2 * UNIT_ROUNDOFF + 2 * TRIANGLE_NORMAL_ERROR);
    real moved = real_fma(ray->length, turned, ray->ends_at_light ? ray->origin_error : (real)(0));
    real along = vector_dot(normal, ray->direction);
    real error = (real)(8 * UNIT_ROUNDOFF) * vector_norm1_along(unsigned_normal, ray->direction) +
                 vector_norm1(normal) * moved;
    return (is_behind & ray->leaves_outward) | (in_front & (along > error)) | (behind & (along < -error));
}

static inline mask triangle_set_errors(const Triangle *triangle, const Ray *ray, real t, real place_error,
                                       SurfacePoint *point)
{
    return mask_none();
}

#endif
