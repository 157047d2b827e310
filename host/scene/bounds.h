// Axis-aligned boxes.
#pragma once

#include "host/scene/vector.h"

typedef struct {
    Vector3 min, max; // a box is empty if min > max
} Bounds;

static inline Bounds bounds_empty(void)
{
    return (Bounds){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

// Returns infinite bounds, those of an unbounded shape.
static inline Bounds bounds_everywhere(void)
{
    return (Bounds){{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
}

static inline bool bounds_is_everywhere(const Bounds *box)
{
    return box->min.x == -INFINITY;
}

static inline bool bounds_is_empty(const Bounds *bounds)
{
    return bounds->min.x > bounds->max.x;
}

// Returns corner i of 8. Bits 0, 1 and 2 of i choose the sides of x, y and z.
static inline Vector3 bounds_corner(Bounds bounds, unsigned i)
{
    return (Vector3){i & 1 ? bounds.max.x : bounds.min.x, i & 2 ? bounds.max.y : bounds.min.y,
                     i & 4 ? bounds.max.z : bounds.min.z};
}

static inline Bounds bounds_around(Vector3 center, Vector3 half_extents)
{
    return (Bounds){vector_subtract(center, half_extents), vector_add(center, half_extents)};
}

static inline Bounds bounds_join(Bounds a, Bounds b)
{
    return (Bounds){vector_min(a.min, b.min), vector_max(a.max, b.max)};
}

// Returns the intersection, which is empty if the boxes are disjoint.
static inline Bounds bounds_intersect(Bounds a, Bounds b)
{
    Bounds both = {vector_max(a.min, b.min), vector_min(a.max, b.max)};
    bool apart = both.min.x > both.max.x || both.min.y > both.max.y || both.min.z > both.max.z;
    return apart ? bounds_empty() : both;
}

static inline Bounds bounds_grow(Bounds bounds, double margin)
{
    return (Bounds){vector_subtract(bounds.min, vector_all(margin)),
                    vector_add(bounds.max, vector_all(margin))};
}

static inline Bounds bounds_of_triangle(Vector3 a, Vector3 b, Vector3 c)
{
    return (Bounds){vector_min(vector_min(a, b), c), vector_max(vector_max(a, b), c)};
}

// Returns the half extents of a circle of radius 1 across the unit vector n. The extent along an axis is the
// length of its projection into the circle's plane, sqrt(1 - n_x^2), here computed as the length of n's other
// components, which does not cancel.
static inline Vector3 circle_half_extents(Vector3 n)
{
    return (Vector3){hypotenuse(n.y, n.z), hypotenuse(n.x, n.z), hypotenuse(n.x, n.y)};
}

// Bounds a disc. `normal` need not be a unit vector.
static inline Bounds bounds_of_disc(Vector3 center, Vector3 normal, double radius)
{
    return bounds_around(center, vector_scale(circle_half_extents(vector_normalize(normal)), radius));
}

static inline Vector3 bounds_center(Bounds bounds)
{
    return vector_scale(vector_add(bounds.min, bounds.max), 0.5);
}

static inline double bounds_half_area(Bounds bounds)
{
    Vector3 size = vector_subtract(bounds.max, bounds.min);
    return size.x * size.y + size.y * size.z + size.z * size.x;
}
