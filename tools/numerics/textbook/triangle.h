// Textbook triangle (Moller, Trumbore, Fast, minimum storage ray-triangle intersection, Journal of Graphics
// Tools 2(1), 1997, with its threshold of 1e-6).
#ifndef TRIANGLE_H
#define TRIANGLE_H

#include "plane.h"

// How much of each vertex the point has where the ray meets the triangle.
typedef struct {
    real a, b, c;
} TriangleWeights;

static inline mask triangle_crossing(const Triangle *triangle, const Ray *ray, real *t,
                                     TriangleWeights *weights)
{
    Vector a = vector_of(triangle->a);
    Vector ab = vector_subtract(vector_of(triangle->b), a), ac = vector_subtract(vector_of(triangle->c), a);
    Vector p = vector_cross(ray->direction, ac);
    real determinant = vector_dot(ab, p);
    real inverse = (real)(1) / determinant;
    Vector f = vector_subtract(ray->origin, a);
    real u = vector_dot(f, p) * inverse;
    Vector q = vector_cross(f, ab);
    real v = vector_dot(ray->direction, q) * inverse;
    *weights = (TriangleWeights){(real)(1) - u - v, u, v};
    *t = vector_dot(ac, q) * inverse;
    return (fabs(determinant) > (real)(1e-6f)) & (u >= (real)(0)) & (v >= (real)(0)) & (u + v <= (real)(1));
}

static inline mask triangle_hit(const Triangle *triangle, const Ray *ray, real *t)
{
    TriangleWeights weights;
    mask hit = RAY_ACTIVE(ray) & triangle_crossing(triangle, ray, t, &weights);
    return hit & (*t > ray->near);
}

static inline TriangleWeights triangle_weights(const Triangle *triangle, const Ray *ray)
{
    TriangleWeights weights;
    real t;
    triangle_crossing(triangle, ray, &t, &weights);
    return weights;
}

static inline Vector triangle_blend(TriangleWeights weights, Vector a, Vector b, Vector c)
{
    return vector_fma(a, weights.a, vector_fma(b, weights.b, vector_scale(c, weights.c)));
}

static inline Patch triangle_patch(const Triangle *triangle, const Ray *ray, real t)
{
    Vector a = vector_of(triangle->a);
    Vector ab = vector_subtract(vector_of(triangle->b), a), ac = vector_subtract(vector_of(triangle->c), a);
    return patch_make(ray_point(ray, t), vector_normalize(vector_cross(ab, ac)), TEXTBOOK_SIZE);
}

static inline void triangle_smooth(const Triangle *triangle, const TriangleNormals *normals, const Ray *ray,
                                   Patch *patch)
{
    patch->shading_normal =
        vector_normalize(triangle_blend(triangle_weights(triangle, ray), vector_of(normals->a),
                                        vector_of(normals->b), vector_of(normals->c)));
}

#endif
