// Cuts flat polygons, including concave ones, into triangles that use all their corners.
#pragma once

#include "host/scene/vector.h"
#include <stddef.h>
#include <stdint.h>

typedef enum {
    POLYGON_CUT,
    POLYGON_WITHOUT_AREA, // all corners lie on one line, so there are no triangles
    POLYGON_CROSSED,      // it intersects itself, so only parts of it are cut
} PolygonStatus;

typedef struct {
    uint32_t (*items)[3]; // indices of corners, in the polygon's own sense of rotation
    size_t count, capacity;
} PolygonTriangles;

// Fills `triangles`, whose storage it reuses. The time grows with the square of the number of corners.
// Corners may coincide and may lie on a line with their neighbors. A corner on an edge stays a corner of
// triangles, so that an adjacent polygon with the same corner leaves no gap.
PolygonStatus polygon_triangulate(const Vector3 *corners, size_t count, PolygonTriangles *triangles);

// Returns the exact sign of the area of the triangle a, b, c in the plane, positive if its corners turn left.
int plane_orientation(const double a[2], const double b[2], const double c[2]);

// Returns the signs of a triangle's normal, (b - a) x (c - a). They are exact, unless coordinates within one
// axis differ by more than a factor of 2^500.
Vector3 triangle_normal_signs(Vector3 a, Vector3 b, Vector3 c);

// Returns whether a component a - b of a normal is nonzero for any rounding of its factors.
static inline bool is_certainly_nonzero(double a, double b)
{
    const double size = fabs(a) + fabs(b);
    return size > 0x1p-900 && fabs(a - b) > 0x1p-49 * size;
}

// Returns whether a triangle's corners are not on one line. The result is exact, whereas triangle_normal may
// round to 0.
static inline bool triangle_has_area(Vector3 a, Vector3 b, Vector3 c)
{
    const Vector3 ab = vector_subtract(b, a), ac = vector_subtract(c, a);
    return is_certainly_nonzero(ab.y * ac.z, ab.z * ac.y) || is_certainly_nonzero(ab.z * ac.x, ab.x * ac.z) ||
           is_certainly_nonzero(ab.x * ac.y, ab.y * ac.x) || !vector_is_zero(triangle_normal_signs(a, b, c));
}
