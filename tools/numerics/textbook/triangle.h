// Textbook triangle (Moller, Trumbore, Fast, minimum storage ray-triangle intersection, Journal of Graphics
// Tools 2(1), 1997, with its threshold of 1e-6).
#ifndef TRIANGLE_H
#define TRIANGLE_H

#include "plane.h"

// Barycentric coordinates of the hit point.
typedef struct {
    real a, b, c;
} TriangleWeights;

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

static inline mask triangle_crossing(Corners corners, const Ray *ray, real *t, TriangleWeights *weights)
{
    Vector ab = vector_subtract(corners.b, corners.a), ac = vector_subtract(corners.c, corners.a);
    Vector p = vector_cross(ray->direction, ac);
    real determinant = vector_dot(ab, p);
    real inverse = (real)(1) / determinant;
    Vector f = vector_subtract(ray->origin, corners.a);
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
    Corners corners = corners_of(triangle->a, triangle->b, triangle->c);
    mask hit = RAY_ACTIVE(ray) & triangle_crossing(corners, ray, t, &weights);
    return hit & (*t > ray->tmin);
}

static inline TriangleWeights triangle_weights(Corners corners, const Ray *ray)
{
    TriangleWeights weights;
    real t;
    triangle_crossing(corners, ray, &t, &weights);
    return weights;
}

static inline Vector triangle_blend(TriangleWeights weights, Corners corners)
{
    return vector_fma(corners.a, weights.a,
                      vector_fma(corners.b, weights.b, vector_scale(corners.c, weights.c)));
}

static inline Vector triangle_normal(const Triangle *triangle)
{
    Vector a = vector_of(triangle->a);
    Vector ab = vector_subtract(vector_of(triangle->b), a), ac = vector_subtract(vector_of(triangle->c), a);
    return vector_cross(ab, ac);
}

static inline bool has_eye_height(uint4 id)
{
    return false;
}

static inline SurfacePoint corners_surface_point(Corners corners, Vector normal, TriangleWeights weights,
                                                 mask next_to_eye, const Ray *ray, real t)
{
    return surface_point_make(ray_point(ray, t), vector_normalize(normal), TEXTBOOK_SIZE);
}

static inline SurfacePoint triangle_surface_point(const Triangle *triangle, const Ray *ray, real t)
{
    Corners corners = corners_of(triangle->a, triangle->b, triangle->c);
    return corners_surface_point(corners, triangle_normal(triangle), triangle_weights(corners, ray),
                                 mask_none(), ray, t);
}

static inline void triangle_smooth(Corners normals, TriangleWeights weights, SurfacePoint *point)
{
    mask flat = vector_dot(normals.a, normals.a) == (real)(0);
    Vector normal = vector_normalize(triangle_blend(weights, normals));
    point->shading_normal = vector_select(flat, point->normal, normal);
}

#endif
