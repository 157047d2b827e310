// Triangle, watertight: a ray that meets an edge or a vertex shared by triangles meets one of them.
//
// Vertices are taken from the ray's start and turned into a frame whose third axis is the ray; the same
// vertex gives the same numbers in every triangle. There the signs of three edge functions decide, and
// product_difference has the exact sign (after Woop, Benthin, Wald, Watertight ray/triangle intersection,
// JCGT 2(1), 2013; they shear along the direction's largest axis and fall back to double precision where an
// edge function is 0).
#ifndef TRIANGLE_H
#define TRIANGLE_H

#include "plane.h"

typedef struct {
    real u, v, w;       // edge functions opposite a, b, c; all of one sign inside, edges included
    real determinant;   // their sum
    real a_t, b_t, c_t; // where along the ray the vertices lie
} TriangleEdges;

static inline TriangleEdges triangle_edges(const Triangle *triangle, const Ray *ray)
{
    Vector a = vector_subtract(vector_of(triangle->a), ray->origin);
    Vector b = vector_subtract(vector_of(triangle->b), ray->origin);
    Vector c = vector_subtract(vector_of(triangle->c), ray->origin);
    real ax = vector_dot(a, ray->across_u), ay = vector_dot(a, ray->across_v);
    real bx = vector_dot(b, ray->across_u), by = vector_dot(b, ray->across_v);
    real cx = vector_dot(c, ray->across_u), cy = vector_dot(c, ray->across_v);
    TriangleEdges edges;
    edges.u = product_difference(cx, by, cy, bx);
    edges.v = product_difference(ax, cy, ay, cx);
    edges.w = product_difference(bx, ay, by, ax);
    edges.determinant = edges.u + edges.v + edges.w;
    edges.a_t = vector_dot(a, ray->along);
    edges.b_t = vector_dot(b, ray->along);
    edges.c_t = vector_dot(c, ray->along);
    return edges;
}

// From one vertex to another, divided by a power of two: exact, and the cross product of two sides does not
// vanish where the triangle is tiny.
static inline Vector triangle_side(Vector from, Vector to)
{
    Vector side = vector_subtract(to, from);
    real largest = real_max(real_max(fabs(side.x), fabs(side.y)), fabs(side.z));
    return vector_scale(side, real_inverse_power(largest));
}

static inline Vector triangle_normal(const Triangle *triangle)
{
    Vector a = vector_of(triangle->a), b = vector_of(triangle->b), c = vector_of(triangle->c);
    return vector_cross(triangle_side(a, b), triangle_side(a, c));
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

// The distance is held between those of the vertices: a sliver seen edge-on would else be hit far outside
// itself.
static inline mask triangle_hit(const Triangle *triangle, const Ray *ray, real *t)
{
    TriangleEdges edges = triangle_edges(triangle, ray);
    const real zero = (real)(0);
    mask all_positive = (edges.u >= zero) & (edges.v >= zero) & (edges.w >= zero);
    mask all_negative = (edges.u <= zero) & (edges.v <= zero) & (edges.w <= zero);
    mask hit = ray->active & (all_positive | all_negative) & (edges.determinant != zero);
    if (!lanes_any(hit)) return hit;

    real nearest = real_min(real_min(edges.a_t, edges.b_t), edges.c_t);
    real farthest = real_max(real_max(edges.a_t, edges.b_t), edges.c_t);
    real distance_ = triangle_plane_distance(triangle, ray, (real)(0.5f) * (nearest + farthest));
    // the vertices' own depths are off by up to 4 u, which the compensated distance is not
    real slack =
        IS_COMPENSATED ? (real)(4 * UNIT_ROUNDOFF) * real_max(fabs(nearest), fabs(farthest)) : (real)(0);
    *t = real_min(real_max(distance_, nearest - slack), farthest + slack);
    return hit & (*t > ray->near);
}

// How much of each vertex the point has where the ray meets the triangle.
typedef struct {
    real a, b, c;
} TriangleWeights;

static inline TriangleWeights triangle_weights(const Triangle *triangle, const Ray *ray)
{
    TriangleEdges edges = triangle_edges(triangle, ray);
    mask degenerate = edges.determinant == (real)(0);
    real inverse = real_divide((real)(1), lanes_select(degenerate, (real)(1), edges.determinant));
    return (TriangleWeights){edges.u * inverse, edges.v * inverse, edges.w * inverse};
}

static inline Vector triangle_blend(TriangleWeights weights, Vector a, Vector b, Vector c)
{
    return vector_fma(a, weights.a, vector_fma(b, weights.b, vector_scale(c, weights.c)));
}

static inline Patch triangle_patch(const Triangle *triangle, const Ray *ray, real t)
{
    Vector a = vector_of(triangle->a), b = vector_of(triangle->b), c = vector_of(triangle->c);
    Vector normal = vector_normalize(triangle_normal(triangle));
    real size = real_max(real_max(vector_magnitude(a), vector_magnitude(b)), vector_magnitude(c));
    Patch patch = patch_make(triangle_blend(triangle_weights(triangle, ray), a, b, c), normal, size);
    if (IS_COMPENSATED) patch_move_to_ray(&patch, ray, t);
    return patch;
}

// Bends the shading normal between the vertices' own.
static inline void triangle_smooth(const Triangle *triangle, const TriangleNormals *normals, const Ray *ray,
                                   Patch *patch)
{
    Vector normal = triangle_blend(triangle_weights(triangle, ray), vector_of(normals->a),
                                   vector_of(normals->b), vector_of(normals->c));
    mask vanishes = vector_dot(normal, normal) == (real)(0);
    patch->shading_normal = vector_select(vanishes, patch->normal, vector_normalize(normal));
}

#endif
