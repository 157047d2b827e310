// Each shape's hits with bounds (shapes/certain.h): NAME_certain_hit. Left out of other precisions, not
// tested with a plain `if`: textbook formulas, which tools/numerics builds in place of the shapes, have no
// bounds.
#ifndef CERTAIN_HITS_H
#define CERTAIN_HITS_H

#include "shapes/certain.h"
#include "shapes/certain_round.h"
#include "shapes/certain_torus.h"
#include "shapes/disc.h"
#include "shapes/plane.h"
#include "shapes/sphere.h"
#include "shapes/triangle.h"

#if IS_CERTIFIED

static inline CertainHit sphere_certain_hit(const Sphere *sphere, const Ray *ray)
{
    if (has_eye_power(sphere->id)) return sphere_power_certain_hit(sphere, ray);
    mask left = ray->left == (integer)((scalar_integer)sphere->id.x);
    mask lanes = RAY_ACTIVE(ray) & !(left & ray->leaves_outward);
    if (!lanes_any(lanes)) return certain_miss();
    CertainSphere crossed =
        certain_sphere(vector_of(sphere->center_radius), (real)(sphere->center_radius.w), ray, lanes);
    if (!lanes_any(crossed.perhaps)) return certain_miss();
    real near_high = crossed.near_t + crossed.t_error, far_high = crossed.far_t + crossed.t_error;
    CertainHit far =
        certain_crossing(ray, crossed.certain, crossed.perhaps, crossed.far_t - crossed.t_error, far_high);
    CertainHit hit = far;
    if (!(sphere->id.y & IGNORES_FRONT_FACES)) {
        CertainHit near = certain_crossing(ray, crossed.certain, crossed.perhaps,
                                           crossed.near_t - crossed.t_error, near_high);
        hit = certain_first(ray, near, near_high, far);
    }
    left = left & lanes;
    if (lanes_any(left)) {
        // one crossing is the start; the other lies twice as far as the closest point
        real t = (real)(2) * crossed.middle_t, t_error = (real)(2.5f) * crossed.middle_error;
        CertainHit other = certain_crossing(ray, left, left, t - t_error, t + t_error);
        hit = certain_select(left, other, hit);
    }
    return hit;
}

// Where the line meets a plane, n . (p - o) / n . d; *low <= t <= *high where the result is set. Elsewhere it
// may meet it at or beyond *low.
static inline mask certain_plane(Vector point, scalar4 normal_and_inverse, const Ray *ray, real *low,
                                 real *high)
{
    Vector normal = vector_of(normal_and_inverse), to_point = vector_subtract(point, ray->origin);
    real height = vector_dot(normal, to_point), along = vector_dot(normal, ray->direction);
    real size = (real)(uniform_divide(1 + 16 * UNIT_ROUNDOFF, normal_and_inverse.w));
    Vector unsigned_normal = {fabs(normal.x), fabs(normal.y), fabs(normal.z)};
    real height_error = (real)(UNIT_ROUNDOFF) * ((real)(6) * vector_norm1_along(unsigned_normal, to_point) +
                                                 (real)(2) * vector_norm1_along(unsigned_normal, point)) +
                        size * ray->origin_error;
    real along_error = (real)(5 * UNIT_ROUNDOFF) * vector_norm1_along(unsigned_normal, ray->direction) +
                       size * (ray->length * ray->direction_error);
    mask crosses = fabs(along) > (real)(8) * along_error;
    real inverse = real_divide((real)(1), lanes_select(crosses, along, (real)(1)));
    real t = height * inverse;
    real t_error = (real)(1.2f) * real_fma(fabs(t), along_error, height_error) * fabs(inverse) +
                   (real)(8 * UNIT_ROUNDOFF) * fabs(t);
    *low = t - t_error;
    *high = t + t_error;
    if (lanes_all(crosses)) return crosses;
    // nearly parallel: beyond the least distance over the greatest approach
    real least = real_max(fabs(height) - height_error, (real)(0));
    real greatest = (fabs(along) + along_error) * (real)(1 + 16 * UNIT_ROUNDOFF);
    mask moves = quotient_is_bounded(least, greatest);
    real parallel_low =
        lanes_select(moves, real_divide(least, lanes_select(moves, greatest, (real)(1))), (real)(LARGEST)) *
        (real)(1 - 16 * UNIT_ROUNDOFF);
    *low = lanes_select(crosses, *low, parallel_low);
    *high = lanes_select(crosses, *high, (real)(LARGEST));
    return crosses;
}

static inline CertainHit plane_certain_hit(const Plane *plane, const Ray *ray)
{
    mask lanes = RAY_ACTIVE(ray) & !ray_left_for_good(ray, plane->id.x, true);
    if (!lanes_any(lanes)) return certain_miss();
    real low, high;
    mask crosses = certain_plane(vector_of(plane->point), plane->normal, ray, &low, &high);
    return certain_crossing(ray, lanes & crosses, lanes, low, high);
}

// Its bounding sphere is missed by most; else the crossing with its plane lies within the rim, or not.
static inline CertainHit disc_certain_hit(const Disc *disc, const Ray *ray)
{
    Vector center = vector_of(disc->center_radius);
    real radius = (real)(disc->center_radius.w);
    CertainSphere bounding = certain_sphere(center, radius, ray, RAY_ACTIVE(ray));
    mask lanes = bounding.perhaps & !ray_left_for_good(ray, disc->id.x, true);
    if (!lanes_any(lanes)) return certain_miss();
    real low, high;
    mask crosses = certain_plane(disc_foot(disc), disc->normal, ray, &low, &high);
    // nearly parallel to it: no nearer than the sphere
    low = lanes_select(crosses, low, real_max(low, bounding.near_t - bounding.t_error));
    high = lanes_select(crosses, high, bounding.far_t + bounding.t_error);
    CertainHit hit = certain_crossing(ray, lanes & crosses, lanes, low, high);
    Vector f = vector_subtract(ray->origin, center);
    Vector across = vector_fma(ray->direction, hit.t, f);
    real moved = ray->length, path = moved * fabs(hit.t);
    real place = ray_place_error(ray, path) + moved * ((real)(0.5f) * (hit.high - hit.low)) +
                 (real)(UNIT_ROUNDOFF) *
                     ((real)(4) * (vector_norm1(f) + path) + (real)(8) * radius + vector_norm1(ray->origin));
    real squared = real_fma(radius, radius, -vector_dot(across, across));
    real band = place * (radius + radius + place);
    mask within = squared > band, beyond = crosses & (squared < -band);
    hit = certain_restrict(hit, !beyond);
    hit.doubt = hit.doubt | (hit.found & !within);
    hit.found = hit.found & within;
    return hit;
}

// Where the ray is between two planes across an axis, of a box larger by `more`. ray_prepare sets `inverse`,
// which is exact within 2 u.
static inline Interval certain_slab(real low, real high, real more, real origin, real direction, real inverse)
{
    mask parallel = fabs(direction) <= (real)(SMALLEST_RATIO);
    real from = low - origin, to = high - origin;
    real a = from * inverse, b = to * inverse, more_t = more * fabs(inverse);
    mask between = (from <= more) & (to >= -more);
    real always = lanes_select(between, (real)(LARGEST / 4), (real)(-LARGEST / 4));
    return (Interval){lanes_select(parallel, -always, real_min(a, b) - more_t),
                      lanes_select(parallel, always, real_max(a, b) + more_t)};
}

static inline Interval certain_box(const Box *box, const Ray *ray, real more)
{
    Vector low = vector_of(box->low), high = vector_of(box->high), o = ray->origin, d = ray->direction;
    Interval x = certain_slab(low.x, high.x, more, o.x, d.x, ray->inverse.x);
    Interval y = certain_slab(low.y, high.y, more, o.y, d.y, ray->inverse.y);
    Interval z = certain_slab(low.z, high.z, more, o.z, d.z, ray->inverse.z);
    return (Interval){real_max(real_max(x.near, y.near), z.near), real_min(real_min(x.far, y.far), z.far)};
}

// The box enlarged contains the exact crossings' interval, the box shrunk lies within it.
static inline CertainHit box_certain_hit(const Box *box, const Ray *ray)
{
    mask lanes = RAY_ACTIVE(ray) & !ray_left_for_good(ray, box->id.x, false);
    Vector to_low = vector_subtract(vector_of(box->low), ray->origin),
           to_high = vector_subtract(vector_of(box->high), ray->origin);
    real distance = vector_norm1((Vector){real_max(fabs(to_low.x), fabs(to_high.x)),
                                          real_max(fabs(to_low.y), fabs(to_high.y)),
                                          real_max(fabs(to_low.z), fabs(to_high.z))});
    real place = ray_place_error(ray, distance) +
                 (real)(UNIT_ROUNDOFF)*real_fma((real)(8), distance, (real)(2) * vector_norm1(ray->origin));
    Interval outer = certain_box(box, ray, place);
    mask perhaps = lanes & (outer.near <= outer.far) & (outer.far >= ray->tmin);
    if (!lanes_any(perhaps)) return certain_miss();
    Interval inner = certain_box(box, ray, -place);
    mask certain = perhaps & (inner.near < inner.far);
    real never = (real)(LARGEST / 8);
    real near_high = lanes_select(certain, inner.near, never);
    CertainHit near = certain_crossing(ray, certain, perhaps, outer.near, near_high);
    CertainHit far =
        certain_crossing(ray, certain, perhaps, lanes_select(certain, inner.far, ray->tmin), outer.far);
    // where it starts on a face, the other crossing counts
    mask left = ray->left == (integer)((scalar_integer)box->id.x);
    return certain_select(left & certain, far, certain_first(ray, near, near_high, far));
}

// No vertex is farther from the origin.
static inline scalar triangle_size(const Triangle *triangle)
{
    scalar4 largest = fmax(fmax(fabs(triangle->a), fabs(triangle->b)), fabs(triangle->c));
    scalar squared = largest.x * largest.x + largest.y * largest.y + largest.z * largest.z;
    return uniform_sqrt(squared) * (1 + 16 * UNIT_ROUNDOFF);
}

// In the ray's frame a vertex is off by `error` along each axis, and so an edge function by twice that times
// the coordinates it is made of. t is between those of the vertices, weighted by the edge functions.
static inline CertainHit triangle_certain_hit(const Triangle *triangle, const Ray *ray)
{
    mask lanes = RAY_ACTIVE(ray) & !ray_left_for_good(ray, triangle->id.x, true);
    Corners corners = corners_of(triangle->a, triangle->b, triangle->c);
    TriangleEdges edges = triangle_edges(corners, ray);
    Vector u = ray->across_u, v = ray->across_v;
    real size = (real)(triangle_size(triangle)),
         error = real_fma(ray->across_error1, size, ray->across_error0);
    real ax = vector_dot(edges.a, u), ay = vector_dot(edges.a, v);
    real bx = vector_dot(edges.b, u), by = vector_dot(edges.b, v);
    real cx = vector_dot(edges.c, u), cy = vector_dot(edges.c, v);
    real a_sum = fabs(ax) + fabs(ay) + error, b_sum = fabs(bx) + fabs(by) + error,
         c_sum = fabs(cx) + fabs(cy) + error;
    // first by what all three are off by together
    real edge_error = (error + error) * (a_sum + b_sum + c_sum);
    real highest = real_max(real_max(edges.u, edges.v), edges.w),
         lowest = real_min(real_min(edges.u, edges.v), edges.w);
    mask perhaps = lanes & !((highest > edge_error) & (lowest < -edge_error));
    if (!lanes_any(perhaps)) return certain_miss();
    // then by each one's own errors, by its distance from the ray's start
    real distance = vector_norm(corners_max_abs((Corners){edges.a, edges.b, edges.c}));
    real place = ray_place_error(ray, distance) +
                 (real)(UNIT_ROUNDOFF)*real_fma((real)(TRIANGLE_ERROR), distance, size);
    error = real_min(error, place * ray->across_length);
    real u_error = error * (b_sum + c_sum), v_error = error * (c_sum + a_sum),
         w_error = error * (a_sum + b_sum);
    edge_error = u_error + v_error + w_error;
    highest = real_max(real_max(edges.u - u_error, edges.v - v_error), edges.w - w_error);
    lowest = real_min(real_min(edges.u + u_error, edges.v + v_error), edges.w + w_error);
    mask misses = ((highest > (real)(0)) & (lowest < (real)(0))) | (real_min(real_min(ax, bx), cx) > error) |
                  (real_max(real_max(ax, bx), cx) < -error) | (real_min(real_min(ay, by), cy) > error) |
                  (real_max(real_max(ay, by), cy) < -error);
    perhaps = perhaps & !misses;
    if (!lanes_any(perhaps)) return certain_miss();
    mask all_above = (edges.u > u_error) & (edges.v > v_error) & (edges.w > w_error);
    mask all_below = (edges.u < -u_error) & (edges.v < -v_error) & (edges.w < -w_error);
    mask certain = perhaps & (all_above | all_below);

    real a_t = vector_dot(edges.a, ray->along), b_t = vector_dot(edges.b, ray->along),
         c_t = vector_dot(edges.c, ray->along);
    real low = real_min(real_min(a_t, b_t), c_t), high = real_max(real_max(a_t, b_t), c_t);
    real vertex_error = ray->inverse_length * real_fma((real)(12 * UNIT_ROUNDOFF), distance, place);
    // in doubt as well: if it is hit, then where the weights say
    mask narrows = perhaps & (fabs(edges.determinant) > (real)(8) * edge_error);
    real inverse = real_divide((real)(1), lanes_select(narrows, edges.determinant, (real)(1)));
    real t = c_t + real_fma(a_t - c_t, edges.u * inverse, (b_t - c_t) * (edges.v * inverse));
    real part = (real)(2.5f) * edge_error * fabs(inverse); // of all weights
    real t_error = (high - low) * (part + (real)(16 * UNIT_ROUNDOFF)) +
                   real_fma((real)(4 * UNIT_ROUNDOFF), fabs(t), vertex_error);
    low = low - vertex_error;
    high = high + vertex_error;
    low = lanes_select(narrows, real_max(low, t - t_error), low);
    high = lanes_select(narrows, real_min(high, t + t_error), high);
    return certain_crossing(ray, certain, perhaps, low, high);
}

// How much longer than high a triangle is at least, over its length: a vertex that moves by e turns the
// normal by e times this at most, and a point that does moves its weights by as much.
static inline real triangle_slimness(Corners corners)
{
    Vector ab = vector_subtract(corners.b, corners.a), ac = vector_subtract(corners.c, corners.a),
           bc = vector_subtract(corners.c, corners.b);
    Vector across = vector_cross(ab, ac);
    real longest_squared = real_max(real_max(vector_dot(ab, ab), vector_dot(ac, ac)), vector_dot(bc, bc)),
         area_squared = vector_dot(across, across);
    return real_sqrt(divide_or(longest_squared, area_squared, (real)(1 / SMALLEST_RATIO)));
}

// The errors of the normals: each vertex is off by u of its length, and where normals are blended the weights
// move with the place.
static inline void triangle_set_normal_errors(Corners corners, Corners normals, TriangleWeights weights,
                                              SurfacePoint *point)
{
    real slimness = triangle_slimness(corners);
    real vertex_error = (real)(4 * UNIT_ROUNDOFF) * vector_norm1(corners_max_abs(corners));
    Vector ab = vector_subtract(normals.a, normals.b), bc = vector_subtract(normals.b, normals.c);
    real apart_squared = (real)(2) * (vector_dot(ab, ab) + vector_dot(bc, bc));
    Vector blend = triangle_blend(weights, normals);
    real bend = real_sqrt(divide_or(apart_squared, vector_dot(blend, blend), (real)(0)));
    point->curvature = (real)(1.25f) * bend * slimness;
    point->normal_error = vertex_error * (slimness + point->curvature);
}

// A box's faces that meet at an edge have normals of their own: whether another one is as near as the error.
static inline mask box_edge_is_near(const Box *box, Vector position, Vector normal, real error)
{
    Vector low = vector_of(box->low), high = vector_of(box->high);
    const real zero = (real)(0);
    real x = real_min(fabs(position.x - low.x), fabs(position.x - high.x));
    real y = real_min(fabs(position.y - low.y), fabs(position.y - high.y));
    real z = real_min(fabs(position.z - low.z), fabs(position.z - high.z));
    return ((normal.x == zero) & (x <= error)) | ((normal.y == zero) & (y <= error)) |
           ((normal.z == zero) & (z <= error));
}

#endif

#endif
