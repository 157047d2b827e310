// Intersects watertight triangles. A ray through an edge or a vertex that triangles share hits at least one.
//
// Vertices relative to the ray's start are rotated into a frame whose third axis is the ray, so that a shared
// vertex gives the same numbers in every triangle. There the signs of three edge functions decide, and
// difference_of_products has the exact sign (after Woop, Benthin, Wald, Watertight ray/triangle intersection,
// JCGT 2(1), 2013; they shear along the direction's largest axis and fall back to double precision if an edge
// function is 0).
#ifndef TRIANGLE_H
#define TRIANGLE_H

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

// One number per corner.
typedef struct {
    real a, b, c;
} CornerReals;

static inline CornerReals corners_dot(Corners corners, Vector v)
{
    return (CornerReals){vector_dot(corners.a, v), vector_dot(corners.b, v), vector_dot(corners.c, v)};
}

// Returns the corners relative to a point.
static inline Corners corners_from(Corners corners, Vector point)
{
    return (Corners){vector_subtract(corners.a, point), vector_subtract(corners.b, point),
                     vector_subtract(corners.c, point)};
}

// Returns the edges a - b, b - c and c - a.
static inline Corners corners_edges(Corners corners)
{
    return (Corners){vector_subtract(corners.a, corners.b), vector_subtract(corners.b, corners.c),
                     vector_subtract(corners.c, corners.a)};
}

// Returns the texture coordinates, u and v in x and y.
static inline Corners corners_of_uvs(TriangleUvs uvs)
{
    return corners_of(uvs.a_b, (scalar4)(uvs.a_b.zw, 0, 0), uvs.c_density);
}

static inline Corners corners_select(mask condition, Corners yes, Corners no)
{
    return (Corners){vector_select(condition, yes.a, no.a), vector_select(condition, yes.b, no.b),
                     vector_select(condition, yes.c, no.c)};
}

typedef struct {
    real u, v, w;     // the edge functions opposite a, b, c; all of one sign inside, edges included
    real determinant; // their sum
    Corners seen;     // the vertices, from the ray's start
    CornerReals x, y; // the vertices across the ray
} TriangleEdges;

static inline TriangleEdges triangle_edges(Corners corners, const Ray *ray)
{
    const Corners seen = corners_from(corners, ray->origin);
    const CornerReals x = corners_dot(seen, ray->across_u), y = corners_dot(seen, ray->across_v);
    const real u = difference_of_products(x.c, y.b, y.c, x.b), v = difference_of_products(x.a, y.c, y.a, x.c),
               w = difference_of_products(x.b, y.a, y.b, x.a);
    return (TriangleEdges){u, v, w, u + v + w, seen, x, y};
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
        faced & (plane.along * plane.height < 0) & (height_squared > error_squared * largest_squared);
    plane.well_conditioned = faced & (height_squared > quarter_squared * largest_squared);
    return plane;
}

// Returns t by the accurate step. At a low angle both products cancel, so they are compensated, with the
// normal in pairs. Next to the eye the height above the plane is the eye's less n . o. `in_plane` is the t
// of rays in the triangle's plane.
static inline real triangle_t_accurate(const Triangle *triangle, const Ray *ray, real in_plane)
{
    const Vector a = vector_of(triangle->a);
    const bool has_height = has_eye_height(triangle->id);
    real along, height;
    if (IS_COMPENSATED && !has_height) {
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
        height = has_height ? (real)(as_float(triangle->id.w)) - vector_dot_compensated(normal, ray->origin)
                            : vector_dot_compensated(normal, vector_subtract(a, ray->origin));
    }
    return divide_or(height, along, in_plane);
}

// Returns the interval of t between the vertices' least and largest coordinate on one axis, widened by the
// slack.
static inline Interval triangle_slab(real a, real b, real c, real slack, real inverse)
{
    real low = (real_min_of_3(a, b, c) - slack) * inverse;
    real high = (real_max_of_3(a, b, c) + slack) * inverse;
    return (Interval){real_min(low, high), real_max(low, high)};
}

// Returns the largest |coordinate| on each axis.
static inline Vector corners_max_abs(Corners corners)
{
    Vector a = corners.a, b = corners.b, c = corners.c;
    return (Vector){real_max_of_3(fabs(a.x), fabs(b.x), fabs(c.x)),
                    real_max_of_3(fabs(a.y), fabs(b.y), fabs(c.y)),
                    real_max_of_3(fabs(a.z), fabs(b.z), fabs(c.z))};
}

// Returns t by the clamped step. Edge-on the error of t is unbounded, while the edge functions, which do not
// depend on t, still report a hit. Clamping to the vertices' t and to their box keeps that hit on the
// triangle and within the boxes of the BVH, whose slack is four times this one.
static inline real triangle_t_clamped(const TriangleEdges *edges, const Ray *ray, real accurate_t)
{
    Vector a = edges->seen.a, b = edges->seen.b, c = edges->seen.c;
    Vector max_abs = corners_max_abs(edges->seen);
    real slack = 16 * UNIT_ROUNDOFF * vector_norm1(max_abs);
    real t = accurate_t;
    Vector inverse = HAS_BOXES ? ray->inverse : ray_inverse(ray);
    t = interval_clamp(triangle_slab(a.x, b.x, c.x, slack, inverse.x), t);
    t = interval_clamp(triangle_slab(a.y, b.y, c.y, slack, inverse.y), t);
    t = interval_clamp(triangle_slab(a.z, b.z, c.z, slack, inverse.z), t);
    // the vertices' t are off by a few roundings of the largest product in them
    Vector along = ray_along(ray);
    real t_error = 4 * UNIT_ROUNDOFF *
                   (max_abs.x * fabs(along.x) + max_abs.y * fabs(along.y) + max_abs.z * fabs(along.z));
    const CornerReals ts = corners_dot(edges->seen, along);
    return interval_clamp(
        (Interval){real_min_of_3(ts.a, ts.b, ts.c) - t_error, real_max_of_3(ts.a, ts.b, ts.c) + t_error}, t);
}

// Returns t by the accurate step and, at low angles or in double, the clamped one.
static inline real triangle_t_robust(const Triangle *triangle, const TriangleEdges *edges, const Ray *ray,
                                     mask hit)
{
    real t = triangle_t_accurate(triangle, ray, vector_dot(edges->seen.a, ray_along(ray)));
    // Above a sine of 1/4 (the normal's square is 3 at most) the accurate t is within a third of the boxes'
    // slack. In double a needle's normal may be worse.
    mask grazing = hit;
    if (!IS_DOUBLE) {
        real facing = vector_dot(triangle_normal(triangle), ray->direction);
        grazing = grazing & (facing * facing < 3 * 0x1p-4f * ray->squared);
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
        TrianglePlane plane = triangle_plane(triangle, edges.seen.a, ray);
        hit = hit & !(plane.behind & (ray->tmin >= zero));
        if (!lanes_any(hit)) return hit;
        remaining = hit & !plane.well_conditioned;
        *t = real_divide(plane.height, lanes_select(plane.well_conditioned, plane.along, (real)(1)));
    }
    if (lanes_any(remaining)) real_replace(t, remaining, triangle_t_robust(triangle, &edges, ray, remaining));
    return hit & (*t > ray->tmin);
}

typedef CornerReals TriangleWeights; // barycentric coordinates of the hit point

static inline TriangleWeights triangle_weights(Corners corners, const Ray *ray)
{
    TriangleEdges edges = triangle_edges(corners, ray);
    mask degenerate = edges.determinant == 0;
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
            real_max_of_3(vector_norm1(corners.a), vector_norm1(corners.b), vector_norm1(corners.c));
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

#endif
