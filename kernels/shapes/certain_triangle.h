// Finds hits on triangles with bounds (docs/numerics.md).
#ifndef CERTAIN_TRIANGLE_H
#define CERTAIN_TRIANGLE_H

#include "shapes/triangle.h"

// Upper bounds: `size` on the vertices' distances from the eye, `longest` on the edges' lengths.
typedef struct {
    scalar size, longest;
} TriangleSizes;

// Returns an upper bound on the length of xyz >= 0. Avoids a root, whose latency no other work hides.
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

// The rounding of a vertex to u of its distance from the eye, and the second order of the other errors.
#define VERTEX_ROUNDING ((real)(1.05f))
// sqrt(3), rounded up, which bounds the length of a normal whose components are at most 1.
#define STORED_NORMAL_LENGTH ((real)(1.7321f))
// The edge functions of a triangle that is hit are off by at most EDGE_FIRST_ORDER A D P + EDGE_SECOND_ORDER
// P^2, for the longest edge D, the error P of the vertices' coordinates in the frame, and a bound A on the
// frame's vectors, whose norm is below 1.23 A (docs/numerics.md).
#define EDGE_FIRST_ORDER  3.5f
#define EDGE_SECOND_ORDER 24
// Weights are off by the errors of all edge functions and by as much of the determinant's, over at least 7/8
// of the determinant: 16/7, rounded up.
#define WEIGHTS_ERROR ((real)(2.5f))

// The signs of the edge functions. If a vertex is off by `error` along each axis of the ray's frame, they are
// off by that times the coordinates that they are made of.
typedef struct {
    mask perhaps, certain;
    real error, coordinates; // coordinates: the error of all three together, divided by `error`
} TriangleSigns;

static inline TriangleSigns triangle_signs(const TriangleEdges *edges, real error)
{
    const real zero = (real)(0);
    const CornerReals x = edges->x, y = edges->y;
    real a_sum = fabs(x.a) + fabs(y.a) + error, b_sum = fabs(x.b) + fabs(y.b) + error,
         c_sum = fabs(x.c) + fabs(y.c) + error;
    real u_error = error * (b_sum + c_sum), v_error = error * (c_sum + a_sum),
         w_error = error * (a_sum + b_sum);
    real u_low = edges->u - u_error, v_low = edges->v - v_error, w_low = edges->w - w_error;
    real u_high = edges->u + u_error, v_high = edges->v + v_error, w_high = edges->w + w_error;
    mask misses =
        (real_max_of_3(u_low, v_low, w_low) > zero) & (real_min_of_3(u_high, v_high, w_high) < zero);
    TriangleSigns signs;
    signs.error = error;
    signs.perhaps = !misses;
    signs.certain = ((u_low > zero) & (v_low > zero) & (w_low > zero)) |
                    ((u_high < zero) & (v_high < zero) & (w_high < zero));
    signs.coordinates = 2 * (a_sum + b_sum + c_sum);
    return signs;
}

// Returns the error across the ray of a vertex up to `distance` from the ray's start and `size` from the eye.
// Before it is rounded, it may be farther along the ray by u `size`.
static inline real triangle_position_error(const Ray *ray, real distance, real size)
{
    return ray_position_error(ray, distance) +
           UNIT_ROUNDOFF * real_fma((real)(TRIANGLE_ERROR), distance, VERTEX_ROUNDING * size);
}

// Returns a bound on the error of the vertices' coordinates in the ray's frame.
static inline real triangle_frame_error(const TriangleEdges *edges, const Ray *ray, real size)
{
    const real distance = vector_norm1(corners_max_abs(edges->seen));
    return triangle_position_error(ray, distance, size) * ray->across_length;
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
    lanes = lanes & certain_plane(vector_of(triangle->a), triangle_normal(triangle), STORED_NORMAL_LENGTH,
                                  TRIANGLE_NORMAL_ERROR, ray, &plane);
    plane = intervals_common(*bounds, plane);
    lanes = lanes & (plane.near <= plane.far);
    real_replace(&bounds->near, lanes, plane.near);
    real_replace(&bounds->far, lanes, plane.far);
    real_replace(t, lanes, interval_middle(plane));
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
    const CornerReals ts = corners_dot(edges->seen, ray_along(ray));
    real low = real_min_of_3(ts.a, ts.b, ts.c), high = real_max_of_3(ts.a, ts.b, ts.c);
    real distance = real_fma(real_max(-low, high), ray->length, (real)(sizes.longest)) + 4 * error;
    real position_error = triangle_position_error(ray, distance, (real)(sizes.size));
    real vertex_error =
        ray_inverse_length(ray) * real_fma((real)(12 * UNIT_ROUNDOFF), distance, position_error);
    // most triangles that lines hit lie behind the start or beyond the end
    perhaps = perhaps & (sinks | !ray_excludes(ray, low - vertex_error, high + vertex_error));
    if (!lanes_any(perhaps)) return certain_miss();
    real edge_error = signs.coordinates * real_min(error, position_error * ray->across_length);
    // applies to uncertain lanes, which are hit, if at all, within the weights' bounds
    mask narrows = perhaps & (fabs(edges->determinant) > DIVISOR_MIN * edge_error);
    real inverse = real_divide((real)(1), lanes_select(narrows, edges->determinant, (real)(1)));
    real t = ts.c + real_fma(ts.a - ts.c, edges->u * inverse, (ts.b - ts.c) * (edges->v * inverse));
    real part = WEIGHTS_ERROR * edge_error * fabs(inverse);
    real t_error = (high - low) * (part + 16 * UNIT_ROUNDOFF) +
                   real_fma((real)(4 * UNIT_ROUNDOFF), fabs(t), vertex_error);
    low = low - vertex_error;
    high = high + vertex_error;
    Interval bounds = {lanes_select(narrows, real_max(low, t - t_error), low),
                       lanes_select(narrows, real_min(high, t + t_error), high)};
    mask slim = perhaps & !(narrows & (t_error <= 4 * vertex_error));
    if (lanes_any(slim)) triangle_narrow_by_plane(triangle, ray, slim, &bounds, &t);
    if (HAS_SMOOTH_NORMALS) {
        real_replace(&bounds.near, sinks, real_max(bounds.near, (real)(SMALLEST_RATIO)));
        bounds.far = real_max(bounds.near, bounds.far);
    }
    CertainHit hit = certain_crossing(ray, signs.certain, perhaps, bounds.near, bounds.far);
    return certain_select(narrows, certain_at(hit, t), hit);
}

// Returns the lanes whose rays pass to one side of all vertices, as seen along an axis of their frame.
// Edge-on, where all edge functions vanish, only this test decides.
static inline mask triangle_is_passed(const TriangleEdges *edges, real error)
{
    const CornerReals x = edges->x, y = edges->y;
    return (real_min_of_3(x.a, x.b, x.c) > error) | (real_max_of_3(x.a, x.b, x.c) < -error) |
           (real_min_of_3(y.a, y.b, y.c) > error) | (real_max_of_3(y.a, y.b, y.c) < -error);
}

// Returns the hit with bounds. First rejects by one error for all edge functions (docs/numerics.md).
static inline CertainHit triangle_certain_hit(const Triangle *triangle, const Ray *ray)
{
    TriangleEdges edges = triangle_edges(corners_of(triangle->a, triangle->b, triangle->c), ray);
    TriangleSizes sizes = triangle_sizes(triangle);
    real error = triangle_frame_error(&edges, ray, (real)(sizes.size));
    real edge_error = error * real_fma(error, (real)(EDGE_SECOND_ORDER),
                                       ray->across_length * (real)(EDGE_FIRST_ORDER * sizes.longest));
    real highest = real_max_of_3(edges.u, edges.v, edges.w),
         lowest = real_min_of_3(edges.u, edges.v, edges.w);
    mask lanes = RAY_ACTIVE(ray) & !((highest > edge_error) & (lowest < -edge_error));
    if (!lanes_any(lanes)) return certain_miss();
    TriangleSigns signs = triangle_signs(&edges, error);
    mask leaves = ray_starts_on(ray, triangle->id.x), sinks = mask_none();
    if (HAS_SMOOTH_NORMALS) sinks = leaves & ray->sinks;
    signs.perhaps = lanes & signs.perhaps & (!leaves | sinks);
    if (!lanes_any(signs.perhaps)) return certain_miss();
    CertainHit hit = triangle_certain_crossing(triangle, &edges, ray, sinks, signs, sizes);
    if (RARELY(lanes_any(hit.uncertain))) hit.uncertain = hit.uncertain & !triangle_is_passed(&edges, error);
    return hit;
}

// Returns the NEIGHBOR_… bits of the neighbor opposite corner number `corner`.
static inline integer neighbor_sides(uint4 ids_sides, uint corner)
{
    return integer_of(ids_sides.w >> (NEIGHBOR_SIDES_BITS * corner) & NEIGHBOR_SIDES_MASK);
}

// Returns the lanes whose rays leave a neighbor of this triangle for good. Their start is on the neighbor or,
// if lifted, in front of it. So they cannot hit this triangle if it lies behind the neighbor's plane and they
// leave to its front, nor if they run to the side of this triangle's plane that the neighbor is on, unless
// they may be lifted across that plane.
static inline mask triangle_left_behind(const Triangle *triangle, const TriangleNeighbors *neighbors,
                                        const Ray *ray, mask lanes)
{
    uint4 ids_sides = neighbors->ids_sides;
    mask over_a = lanes & ray_starts_on(ray, ids_sides.x), over_b = lanes & ray_starts_on(ray, ids_sides.y),
         over_c = lanes & ray_starts_on(ray, ids_sides.z);
    if (!lanes_any(over_a | over_b | over_c)) return mask_none();
    const integer none = (integer)(0);
    integer sides = lanes_select(over_a, neighbor_sides(ids_sides, 0), none);
    sides = lanes_select(over_b, neighbor_sides(ids_sides, 1), sides);
    sides = lanes_select(over_c, neighbor_sides(ids_sides, 2), sides);
    mask is_behind = (sides & (integer)(NEIGHBOR_HAS_THIS_BEHIND)) != none;
    if (HAS_SMOOTH_NORMALS) {
        mask lifts_away = ray->leaves_outward & ((sides & (integer)(NEIGHBOR_LIFTS_AWAY)) != none);
        sides = lanes_select(ray->is_lifted & !lifts_away, none, sides);
    }
    mask in_front = (sides & (integer)(NEIGHBOR_IN_FRONT)) != none,
         behind = (sides & (integer)(NEIGHBOR_BEHIND)) != none;
    Vector normal = triangle_normal(triangle);
    real turned = ray->direction_error + (2 * UNIT_ROUNDOFF + 2 * TRIANGLE_NORMAL_ERROR);
    real moved = real_fma(ray->length, turned, ray->ends_at_light ? ray->origin_error : (real)(0));
    real along = vector_dot(normal, ray->direction);
    real error =
        8 * UNIT_ROUNDOFF * vector_norm1_along(normal, ray->direction) + vector_norm1(normal) * moved;
    return (is_behind & ray->leaves_outward) | (in_front & (along > error)) | (behind & (along < -error));
}

static inline mask triangle_set_errors(const Triangle *triangle, const Ray *ray, real t, real position_error,
                                       SurfacePoint *point)
{
    return mask_none();
}

#endif
