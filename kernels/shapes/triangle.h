// Triangle, watertight: a ray that meets an edge or a vertex shared by triangles meets one of them.
//
// Vertices are taken from the ray's start and turned into a frame whose third axis is the ray; the same
// vertex gives the same numbers in every triangle. There the signs of three edge functions decide, and
// product_difference has the exact sign (after Woop, Benthin, Wald, Watertight ray/triangle intersection,
// JCGT 2(1), 2013; they shear along the direction's largest axis and fall back to double precision where an
// edge function is 0).
#ifndef TRIANGLE_H
#define TRIANGLE_H

#include "shapes/plane.h"

// A triangle's three vertices, or what belongs to them. Lanes may have triangles of their own.
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
    real u, v, w;     // edge functions opposite a, b, c; all of one sign inside, edges included
    real determinant; // their sum
    Vector a, b, c;   // the vertices, from the ray's start
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
    edges.u = product_difference(cx, by, cy, bx);
    edges.v = product_difference(ax, cy, ay, cx);
    edges.w = product_difference(bx, ay, by, ax);
    edges.determinant = edges.u + edges.v + edges.w;
    edges.a = a;
    edges.b = b;
    edges.c = c;
    return edges;
}

static inline Vector triangle_normal(const Triangle *triangle)
{
    return (Vector){(real)(triangle->a.w), (real)(triangle->b.w), (real)(triangle->c.w)};
}

// The distance of the triangle's plane. Seen at a low angle both products with the normal cancel, hence twice
// the precision; compensated, the normal itself is in pairs.
static inline real triangle_plane_distance(const Triangle *triangle, const Ray *ray, real otherwise)
{
    Vector a = vector_of(triangle->a);
    real along, height;
    if (IS_COMPENSATED) {
        PairVector ab = pair_vector_difference(vector_of(triangle->b), a);
        PairVector ac = pair_vector_difference(vector_of(triangle->c), a);
        PairVector normal = {pair_product_difference(ab.y, ac.z, ab.z, ac.y),
                             pair_product_difference(ab.z, ac.x, ab.x, ac.z),
                             pair_product_difference(ab.x, ac.y, ab.y, ac.x)};
        along = pair_vector_dot_vector(normal, ray->direction).high;
        height = pair_vector_dot(pair_vector_difference(a, ray->origin), normal).high;
    } else {
        Vector normal = triangle_normal(triangle);
        along = vector_dot_exactly(normal, ray->direction);
        height = vector_dot_exactly(normal, vector_subtract(a, ray->origin));
    }
    mask crosses = fabs(height) * (real)(SMALLEST_RATIO) < fabs(along);
    return lanes_select(crosses, real_divide(height, lanes_select(crosses, along, (real)(1))), otherwise);
}

// Where the ray lies between the vertices, and a little beyond them, along one axis.
static inline Roots triangle_slab(real a, real b, real c, real slack, real inverse)
{
    real low = (real_min(real_min(a, b), c) - slack) * inverse;
    real high = (real_max(real_max(a, b), c) + slack) * inverse;
    return (Roots){real_min(low, high), real_max(low, high)};
}

// The largest of their coordinates along each axis.
static inline Vector corners_reach(Corners corners)
{
    Vector a = corners.a, b = corners.b, c = corners.c;
    return (Vector){real_max(real_max(fabs(a.x), fabs(b.x)), fabs(c.x)),
                    real_max(real_max(fabs(a.y), fabs(b.y)), fabs(c.y)),
                    real_max(real_max(fabs(a.z), fabs(b.z)), fabs(c.z))};
}

static inline real roots_hold(Roots roots, real t)
{
    return real_min(real_max(t, roots.near), roots.far);
}

// A triangle seen edge-on would else be hit far outside itself: the edge functions do not know of the
// distance, whose error grows as the angle gets lower. It is held between the vertices' distances, and within
// their box, since the hierarchy looks for hits in boxes alone: its own are larger by four times this slack.
static inline real triangle_distance_held(const TriangleEdges *edges, const Ray *ray, real plane_t)
{
    Vector a = edges->a, b = edges->b, c = edges->c;
    Vector reach = corners_reach((Corners){a, b, c});
    real slack = (real)(16 * UNIT_ROUNDOFF) * vector_magnitude(reach);
    real t = plane_t;
    t = roots_hold(triangle_slab(a.x, b.x, c.x, slack, ray->inverse.x), t);
    t = roots_hold(triangle_slab(a.y, b.y, c.y, slack, ray->inverse.y), t);
    t = roots_hold(triangle_slab(a.z, b.z, c.z, slack, ray->inverse.z), t);
    // each of the vertices' distances is off by a few roundings of the largest product in it
    Vector along = ray->along;
    real off = (real)(4 * UNIT_ROUNDOFF) *
               (reach.x * fabs(along.x) + reach.y * fabs(along.y) + reach.z * fabs(along.z));
    real a_t = vector_dot(a, along), b_t = vector_dot(b, along), c_t = vector_dot(c, along);
    return roots_hold(
        (Roots){real_min(real_min(a_t, b_t), c_t) - off, real_max(real_max(a_t, b_t), c_t) + off}, t);
}

// What plain products with the normal tell: each is off by at most 2 u of its factors' lengths and u of
// itself, and by u each for the way's rounding and the normal's: where the height nearly vanishes, by 4 u. A
// quotient of two that are settled is within 30 u, less than half of what boxes allow.
typedef struct {
    real along, height; // with the direction, and with the way from the start to the plane
    mask behind;        // the plane lies behind the start
    mask settled; // height / along is exact enough: both are more than a quarter of their factors' lengths
} TriangleView;

static inline TriangleView triangle_view(const Triangle *triangle, Vector way, const Ray *ray)
{
    Vector normal = triangle_normal(triangle);
    real normal_squared =
        (real)(triangle->a.w * triangle->a.w + triangle->b.w * triangle->b.w + triangle->c.w * triangle->c.w);
    const real quarter_squared = (real)(0x1p-4f);
    const real error_squared = (real)(16 * UNIT_ROUNDOFF * UNIT_ROUNDOFF);
    TriangleView view;
    view.along = vector_dot(normal, ray->direction);
    view.height = vector_dot(normal, way);
    real height_squared = view.height * view.height, largest_squared = normal_squared * vector_dot(way, way);
    mask faced = view.along * view.along > quarter_squared * normal_squared * ray->squared;
    view.behind =
        faced & (view.along * view.height < (real)(0)) & (height_squared > error_squared * largest_squared);
    view.settled = faced & (height_squared > quarter_squared * largest_squared);
    return view;
}

// Of any triangle.
static inline real triangle_distance_careful(const Triangle *triangle, const TriangleEdges *edges,
                                             const Ray *ray, mask hit)
{
    // in the triangle's own plane any place of it will do
    real otherwise = vector_dot(edges->a, ray->along);
    real t = triangle_plane_distance(triangle, ray, otherwise);
    mask held = hit;
    // At other angles, of a sine of 1/4 or more since the normal's square is 3 at most, the distance is
    // within 5 u over that sine, a third of what boxes allow. A needle's normal may be worse than that in
    // double.
    if (!IS_DOUBLE) {
        real facing = vector_dot(triangle_normal(triangle), ray->direction);
        held = held & (facing * facing < (real)(3 * 0x1p-4f) * ray->squared);
    }
    if (lanes_any(held)) t = lanes_select(held, triangle_distance_held(edges, ray, t), t);
    return t;
}

static inline mask triangle_hit(const Triangle *triangle, const Ray *ray, real *t)
{
    TriangleEdges edges = triangle_edges(corners_of(triangle->a, triangle->b, triangle->c), ray);
    const real zero = (real)(0);
    mask all_positive = (edges.u >= zero) & (edges.v >= zero) & (edges.w >= zero);
    mask all_negative = (edges.u <= zero) & (edges.v <= zero) & (edges.w <= zero);
    // both where all are 0
    mask hit = RAY_ACTIVE(ray) & (all_positive ^ all_negative);
    if (!lanes_any(hit)) return hit;
    mask careful = hit;
    if (!IS_COMPENSATED) {
        TriangleView view = triangle_view(triangle, edges.a, ray);
        hit = hit & !(view.behind & (ray->near >= zero));
        if (!lanes_any(hit)) return hit;
        careful = hit & !view.settled;
        *t = real_divide(view.height, lanes_select(view.settled, view.along, (real)(1)));
    }
    if (lanes_any(careful))
        *t = lanes_select(careful, triangle_distance_careful(triangle, &edges, ray, careful), *t);
    return hit & (*t > ray->near);
}

// How much of each vertex the point has where the ray meets the triangle.
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

// Where the ray meets the triangle, its normal of any length.
static inline Patch triangle_crossing_patch(Corners corners, Vector normal, TriangleWeights weights,
                                            const Ray *ray, real t)
{
    Vector unit = vector_normalize(normal), reach = corners_reach(corners);
    Patch patch = patch_make(triangle_blend(weights, corners), unit, vector_magnitude_along(unit, reach));
    if (IS_COMPENSATED) {
        real magnitude = real_max(real_max(vector_magnitude(corners.a), vector_magnitude(corners.b)),
                                  vector_magnitude(corners.c));
        patch_move_to_ray(&patch, ray, t, magnitude);
    }
    return patch;
}

static inline Patch triangle_patch(const Triangle *triangle, const Ray *ray, real t)
{
    Corners corners = corners_of(triangle->a, triangle->b, triangle->c);
    return triangle_crossing_patch(corners, triangle_normal(triangle), triangle_weights(corners, ray), ray,
                                   t);
}

// Bends the shading normal between the vertices' own; where these are all 0 the triangle is flat.
static inline void triangle_smooth(Corners normals, TriangleWeights weights, Patch *patch)
{
    Vector normal = triangle_blend(weights, normals);
    mask bends = vector_dot(normal, normal) > (real)(0);
    patch->shading_normal = vector_select(bends, vector_normalize(normal), patch->normal);
}

#endif
