// Flat polygons, concave ones too, cut into triangles that use all their corners.
#pragma once

#include "host/scene/vector.h"
#include <stddef.h>
#include <stdint.h>

typedef enum {
    POLYGON_CUT,
    POLYGON_WITHOUT_AREA, // all corners on one line: no triangles
    POLYGON_CROSSED,      // it crosses itself: cut as far as it can be
} PolygonStatus;

typedef struct {
    uint32_t (*items)[3]; // indices of corners, in the polygon's own sense of rotation
    size_t count, capacity;
} PolygonTriangles;

// Fills `triangles`, whose storage it reuses. The time grows with the square of the number of corners.
// Corners may repeat and lie on a line with their neighbors; a corner on an edge stays a corner of triangles,
// so that a neighboring polygon which has it too leaves no gap.
PolygonStatus polygon_triangulate(const Vector3 *corners, size_t count, PolygonTriangles *triangles);

// The sign of the area of a, b, c in the plane, positive where they turn left: exact.
int plane_orientation(const double a[2], const double b[2], const double c[2]);
