// Computes the shading normals of triangles from those of their vertices, and the starts of rays to lights.
#ifndef TRIANGLE_NORMALS_H
#define TRIANGLE_NORMALS_H

#include "shapes/certain_triangle.h"

// Interpolates the shading normal from those of the vertices. A triangle whose normals are all 0 is flat.
static inline void triangle_smooth(Corners normals, TriangleWeights weights, SurfacePoint *point)
{
    Vector normal = triangle_blend(weights, normals);
    mask bends = vector_dot(normal, normal) > 0;
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
    const Corners edges = corners_edges(corners);
    real ab_a = vector_dot(edges.a, normals.a), ca_a = vector_dot(edges.c, normals.a);
    real bc_b = vector_dot(edges.b, normals.b), ab_b = vector_dot(edges.a, normals.b);
    real ca_c = vector_dot(edges.c, normals.c), bc_c = vector_dot(edges.b, normals.c);
    const real zero = (real)(0);
    TriangleHeights heights = {real_max(side * (weights.b * ab_a - weights.c * ca_a), zero),
                               real_max(side * (weights.c * bc_b - weights.a * ab_b), zero),
                               real_max(side * (weights.a * ca_c - weights.b * bc_c), zero), zero};
    if (IS_CERTIFIED)
        heights.steepest =
            real_max_of_3(fabs(ab_a) + fabs(ca_a), fabs(bc_b) + fabs(ab_b), fabs(ca_c) + fabs(bc_c));
    point->lift = triangle_blend((TriangleWeights){side * weights.a * heights.a, side * weights.b * heights.b,
                                                   side * weights.c * heights.c},
                                 normals);
    return heights;
}

// Returns a bound on the height of a point over the exact triangle's plane, of which `vertex` is a rounded
// vertex and `unit` the normal.
static inline real triangle_height(Vector vertex, Vector unit, Vector position)
{
    return certain_plane_height(vertex, unit, 4 * UNIT_ROUNDOFF + 2 * TRIANGLE_NORMAL_ERROR, position);
}

// Returns a bound on the ratio of a triangle's length to its height, over its length. A vertex that moves by
// e turns the normal by at most e times this, and a point that moves by e moves its weights by as much.
static inline real triangle_slimness(Corners edges)
{
    const Vector ab = edges.a, bc = edges.b, ca = edges.c, across = vector_cross(ab, ca);
    real longest_squared = real_max_of_3(vector_dot(ab, ab), vector_dot(ca, ca), vector_dot(bc, bc)),
         area_squared = vector_dot(across, across);
    return real_sqrt(divide_or(longest_squared, area_squared, (real)(1 / SMALLEST_RATIO)));
}

// Bounds the distance between the points of the exact and of the computed weights, in addition to the error
// of the position: by the rounding of each vertex, and by the error across the ray of the frame's vertices,
// over the cosine of incidence.
static inline real triangle_weights_error(Corners corners, const Ray *ray, real cosine)
{
    const real size = vector_norm1(corners_max_abs(corners)),
               distance = vector_norm1(corners_max_abs(corners_from(corners, ray->origin)));
    const real across = UNIT_ROUNDOFF * real_fma((real)(6), distance, 2 * size);
    return real_fma((real)(4 * UNIT_ROUNDOFF), size, divide_or(across, cosine, NEVER));
}

// A vector that is off by e is, once normalized, off by up to 2 e over its length. The remainder is for
// roundings.
#define BLENDED_NORMAL_ERROR ((real)(2.5f))

// Sets the errors of the normals. If they are blended, they move with the weights.
static inline void triangle_set_normal_errors(Corners normals, TriangleWeights weights, real slimness,
                                              real weights_error, SurfacePoint *point)
{
    const Corners apart = corners_edges(normals);
    real apart_squared = 2 * (vector_dot(apart.a, apart.a) + vector_dot(apart.b, apart.b));
    Vector blend = triangle_blend(weights, normals);
    real bend = real_sqrt(divide_or(apart_squared, vector_dot(blend, blend), (real)(0)));
    point->curvature = BLENDED_NORMAL_ERROR * bend * slimness;
    point->normal_error = real_fma(weights_error, point->curvature, (real)(2 * TRIANGLE_NORMAL_ERROR));
}

// Sets the error of the lift in the lanes with a side (docs/numerics.md).
static inline void triangle_set_lift_error(Corners corners, TriangleHeights heights, real side, real slimness,
                                           real position_error, SurfacePoint *point)
{
    real size = vector_norm1(corners_max_abs(corners));
    real rounded = real_fma((real)(16 * UNIT_ROUNDOFF), vector_norm1(corners_max_abs(corners_edges(corners))),
                            4 * UNIT_ROUNDOFF * size);
    real weight_error = real_fma((real)(36 * UNIT_ROUNDOFF), size, position_error) * slimness;
    real height_error = real_fma(weight_error, heights.steepest + rounded, rounded);
    real heights_sum = heights.a + heights.b + heights.c;
    real error = real_fma(weight_error, heights_sum + 3 * height_error, height_error);
    point->lift_error = lanes_select(side == 0, (real)(0), error);
}

#endif
