// Textbook cylinder and cone: |p|^2 - (p . w)^2 = (R + k p . w)^2 for a unit axis w, b^2 - a c, and each cap
// by itself (Glassner, An introduction to ray tracing, 1989, section 2.3; Heckbert, Ray tracing, 1989).
#ifndef REVOLUTION_H
#define REVOLUTION_H

#include "box.h"

typedef struct {
    real t;
    mask found;
} Nearest;

static inline void nearest_take(Nearest *nearest, const Ray *ray, real t, mask counts)
{
    mask closer = counts & (t > ray->tmin) & (!nearest->found | (t < nearest->t));
    nearest->t = lanes_select(closer, t, nearest->t);
    nearest->found = nearest->found | closer;
}

typedef struct {
    Vector axis; // unit
    real radius, slope, height;
} RevolutionBody;

static inline RevolutionBody revolution_body(const Revolution *shape)
{
    real inverse = (real)(1 / shape->range.y);
    return (RevolutionBody){vector_scale(vector_of(shape->axis_slope), inverse),
                            (real)(shape->base_radius.w) * inverse, (real)(shape->axis_slope.w),
                            (real)(shape->range.x) * inverse};
}

static inline mask revolution_hit(const Revolution *shape, bool sloped, const Ray *ray, real *t)
{
    RevolutionBody body = revolution_body(shape);
    Vector f = vector_subtract(ray->origin, vector_of(shape->base_radius));
    real rise = vector_dot(ray->direction, body.axis), start = vector_dot(f, body.axis);
    real growth = sloped ? body.slope * rise : (real)(0);
    real radius = sloped ? body.radius + body.slope * start : body.radius;
    real a = ray->squared - rise * rise - growth * growth;
    real b = vector_dot(f, ray->direction) - start * rise - radius * growth;
    real c = vector_dot(f, f) - start * start - radius * radius;
    real discriminant = b * b - a * c;
    mask hit = RAY_ACTIVE(ray) & (discriminant >= (real)(0));
    Roots roots = quadratic_roots((real)(1) / a, b, discriminant);
    bool finite = shape->id.y & REVOLUTION_FINITE, capped = shape->id.y & REVOLUTION_CAPPED;

    Nearest nearest = {*t, mask_none()};
    real near_height = start + roots.near * rise, far_height = start + roots.far * rise;
    mask near_valid = hit, far_counts = hit;
    if (finite) {
        near_valid = hit & (near_height >= (real)(0)) & (near_height <= body.height);
        far_counts = hit & (far_height >= (real)(0)) & (far_height <= body.height);
    }
    if (!(shape->id.y & IGNORES_FRONT_FACES) || capped) nearest_take(&nearest, ray, roots.near, near_valid);
    nearest_take(&nearest, ray, roots.far, far_counts);
    if (capped) {
        for (uint end = 0; end < 2; end++) {
            real height = end ? body.height : (real)(0);
            real end_radius = sloped ? body.radius + body.slope * height : body.radius;
            real to_end = (height - start) / rise;
            Vector p = vector_fma(ray->direction, to_end, f);
            real squared = vector_dot(p, p) - height * height;
            nearest_take(&nearest, ray, to_end, RAY_ACTIVE(ray) & (squared <= end_radius * end_radius));
        }
    }
    *t = nearest.t;
    return nearest.found;
}

static inline SurfacePoint revolution_surface_point(const Revolution *shape, bool sloped, const Ray *ray,
                                                    real t)
{
    RevolutionBody body = revolution_body(shape);
    Vector point = ray_point(ray, t);
    Vector p = vector_subtract(point, vector_of(shape->base_radius));
    real height = vector_dot(p, body.axis);
    real radius = sloped ? body.radius + body.slope * height : body.radius;
    real lean = sloped ? height + body.slope * radius : height;
    Vector normal = vector_normalize(vector_fma(body.axis, -lean, p));
    if (shape->id.y & REVOLUTION_CAPPED) {
        const real near_end = (real)(1e-4f);
        mask at_base = height<near_end, at_end = height> body.height - near_end;
        normal = vector_select(at_base, vector_negate(body.axis), normal);
        normal = vector_select(at_end, body.axis, normal);
    }
    return surface_point_make(point, normal, TEXTBOOK_SIZE);
}

static inline mask cylinder_hit(const Cylinder *cylinder, const Ray *ray, real *t)
{
    return revolution_hit(cylinder, false, ray, t);
}

static inline SurfacePoint cylinder_surface_point(const Cylinder *cylinder, const Ray *ray, real t)
{
    return revolution_surface_point(cylinder, false, ray, t);
}

static inline mask cone_hit(const Cone *cone, const Ray *ray, real *t)
{
    return revolution_hit(cone, true, ray, t);
}

static inline SurfacePoint cone_surface_point(const Cone *cone, const Ray *ray, real t)
{
    return revolution_surface_point(cone, true, ray, t);
}

#endif
