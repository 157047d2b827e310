// Maps vectors between the space of a shape and that of the eye. An affine map is three rows of a matrix.
#ifndef AFFINE_H
#define AFFINE_H

#include "shapes/surface_point.h"

static inline real affine_row(scalar4 row, Vector v)
{
    return real_fma((real)(row.x), v.x, real_fma((real)(row.y), v.y, (real)(row.z) * v.z));
}

static inline Vector affine_vector(const scalar4 rows[3], Vector v)
{
    return (Vector){affine_row(rows[0], v), affine_row(rows[1], v), affine_row(rows[2], v)};
}

// Applies the magnitudes of a map to those of a vector. The roundings of mapping are in proportion to this.
static inline Vector affine_reach(const scalar4 rows[3], Vector v)
{
    const Vector size = {fabs(v.x), fabs(v.y), fabs(v.z)};
    return (Vector){affine_row(fabs(rows[0]), size), affine_row(fabs(rows[1]), size),
                    affine_row(fabs(rows[2]), size)};
}

static inline real affine_coordinate(scalar4 row, Vector p)
{
    return real_fma((real)(row.x), p.x,
                    real_fma((real)(row.y), p.y, real_fma((real)(row.z), p.z, (real)(row.w))));
}

static inline Vector affine_point(const scalar4 rows[3], Vector p)
{
    return (Vector){affine_coordinate(rows[0], p), affine_coordinate(rows[1], p),
                    affine_coordinate(rows[2], p)};
}

// Maps a normal by the transposed inverse, which changes its length.
static inline Vector affine_normal(const scalar4 inverses[3], Vector n)
{
    const Vector x = vector_of(inverses[0]), y = vector_of(inverses[1]), z = vector_of(inverses[2]);
    return (Vector){real_fma(x.x, n.x, real_fma(y.x, n.y, z.x * n.z)),
                    real_fma(x.y, n.x, real_fma(y.y, n.y, z.y * n.z)),
                    real_fma(x.z, n.x, real_fma(y.z, n.y, z.z * n.z))};
}

// Bounds the error that mapping adds to a point and to the next ray's test, in units of 16 u of the map's
// condition times the shape's largest coordinate from the image of 0.
#define MAPPED_POINT_ERROR ((real)(1.5f))

// Returns the image of a surface point p. `normal` is the mapped normal, of any length, `largest` the largest
// coordinates of p's shape, and `rounding_scale` is the point's before mapping.
static inline SurfacePoint affine_surface_point(const scalar4 rows[3], scalar condition, Vector p,
                                                Vector normal, Vector largest, real rounding_scale)
{
    const real norm = vector_norm(normal);
    const real inverse = real_divide((real)(1), lanes_select(norm > 0, norm, (real)(1)));
    const Vector reach = affine_reach(rows, largest);
    const real mapping_scale = real_max_of_3(reach.x, reach.y, reach.z);
    rounding_scale = real_fma((real)(0.25f), vector_norm1(p), rounding_scale) * inverse;
    return surface_point_make(
        affine_point(rows, p), vector_scale(normal, inverse),
        real_fma(MAPPED_POINT_ERROR * (real)(condition), mapping_scale, rounding_scale));
}

// Returns the image of 0.
static inline Vector affine_translation(const scalar4 rows[3])
{
    return (Vector){(real)(rows[0].w), (real)(rows[1].w), (real)(rows[2].w)};
}

#endif
