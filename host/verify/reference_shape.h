// The reference's row for each shape, one per file of shapes/. Only these files and reference.c use it.
#pragma once

#include "host/verify/reference.h"

typedef struct {
    // Pushes every crossing, and reduces the margin to the distance from each edge where the answer changes.
    void (*hit)(const Object *object, const ReferenceRay *ray, ReferenceHit *hit);
    // Measures the surface and adds its sheets.
    void (*surface)(const Object *object, Quad3 point, ReferenceSurface *surface);
    // The shape's members in Object begin with this many doubles, after which only flags follow.
    unsigned number_count;
} ReferenceShape;

// Indexed by ShapeType, which follows SHAPE_LIST. A mesh is tested as its triangles.
extern const ReferenceShape *const reference_shapes[];

#define UNBOUNDED ((Quad)LDBL_MAX)

// Records the crossing at `t` if it is the nearest so far. `normal` points outward; it need not be unit.
void hit_keep_nearest(ReferenceHit *hit, const ReferenceRay *ray, Quad t, Quad3 normal,
                      Quad curvature_radius);
// Reduces the hit's margin to the magnitude of `margin` if that is smaller.
void hit_reduce_margin(ReferenceHit *hit, Quad margin);
// Pushes the crossing of a disc, such as a cap. Margins are those of its rim.
void hit_disc_at(Quad3 center, Quad3 normal, Quad radius, const ReferenceRay *ray, ReferenceHit *hit);

// Sets the surface's members of these names. The center is that of its bounds.
void surface_measure(ReferenceSurface *surface, Vector3 center, double bounding_radius,
                     double feature_radius);
void surface_add(ReferenceSurface *surface, Quad distance, Quad3 normal, Quad curvature_radius);

// Sets three perpendicular unit vectors, of which the last is `axis`.
void axes_around(Quad3 axis, Quad3 axes[3]);
// Returns a vector's products with three axes, which are its coordinates if the axes are perpendicular units.
Quad3 axes_coordinates(const Quad3 axes[3], Quad3 vector);
// Returns the sum of three axes times these coordinates.
Quad3 axes_vector(const Quad3 axes[3], Quad3 coordinates);

// Sets *t to where a ray crosses the plane through `point`. Returns false for a parallel ray.
bool plane_crossing(const ReferenceRay *ray, Quad3 point, Quad3 normal, Quad *t);
Quad plane_cosine(const ReferenceRay *ray, Quad3 normal);

Quad point_line_distance(Quad3 point, Quad3 on_line, Quad3 direction);
// Returns the distance between the ray's line and another line, both infinite.
Quad line_distance(const ReferenceRay *ray, Quad3 on_line, Quad3 direction);

// Solves A t^2 + 2 B t + C = 0 and returns the number of roots. A very distant root is dropped because it
// stems from an A that is 0 but for roundings.
int quadratic_roots(Quad a, Quad b, Quad c, Quad roots[2]);

// Returns how far a number is outside an interval.
static inline Quad quad_outside(Quad value, Quad low, Quad high)
{
    return value < low ? low - value : value > high ? value - high : 0;
}

static inline Quad quad_hypotenuse(Quad a, Quad b)
{
    return a == 0 ? quad_absolute(b) : b == 0 ? quad_absolute(a) : quad_root(a * a + b * b);
}
