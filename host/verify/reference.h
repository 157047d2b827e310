// The exact answers of rays and shapes, in quadruple precision, for `glint verify` and the tests. The code
// uses textbook formulas in local frames, tests surfaces one by one, and shares no code and no formula with
// kernels/. tests/oracle.sh checks it against exact arithmetic.
//
// Everything is exact (about 2^-113) for its input numbers. The only rounding to float is explicit:
// `reference_round_object` and `reference_ray_rounded` return an object and a ray as a float kernel receives
// them. Each shape is one file of shapes/.
#pragma once

#include "host/scene/quad.h"
#include "host/scene/scene.h"

typedef struct {
    Quad3 origin, direction;
    Quad tmin, tmax; // a hit lies strictly between
} ReferenceRay;

typedef struct {
    bool found;
    uint32_t object; // UINT32_MAX on a miss
    Quad t;
    Quad3 normal;          // geometric, unit, facing the ray
    Quad3 shading_normal;  // on the same side; differs on smooth triangles
    bool entering;         // the ray runs against the outward normal, for a triangle that of its winding
    Quad cosine;           // between normal and ray, 0 .. 1
    Quad curvature_radius; // LDBL_MAX if flat
    // About twice the distance, in scene units, between the ray's line and the nearest curve at which the
    // answer changes (silhouette, rim, edge, apex), or between two competing surfaces. It never exceeds the
    // value at the boundary that matters, but other boundaries may reduce it. For a sphere it is r |1 -
    // (l/r)^2|.
    Quad margin;
} ReferenceHit;

// Returns a ray from 0 to the largest float.
ReferenceRay reference_ray(Vector3 origin, Vector3 direction);
// Returns a ray from 0 to the largest float, with its numbers rounded to float.
ReferenceRay reference_ray_rounded(Vector3 origin, Vector3 direction);
// Returns an object with every number rounded to float. For a finite axis, its ends are rounded.
Object reference_round_object(const Object *object);
// Returns an object relative to an eye, which is subtracted in double.
Object reference_object_from(const Object *object, Vector3 eye);
// Sets every number of an object to that of `start` plus `size` times that of `growth`.
void reference_grow_object(Object *object, const Object *start, const Object *growth, double size);

// Returns the nearest hit of one object, with `object` 0. Misses of round shapes farther away than 2^40
// radii depend on roots that have cancelled, and are unreliable.
ReferenceHit reference_hit_object(const Object *object, const ReferenceRay *ray);
// Replaces *nearest by the hit of an object if that is nearer, and updates the margin in any case. The first
// of equally distant objects is kept. Start with reference_miss, which has no hit.
ReferenceHit reference_miss(void);
void reference_hit_record(ReferenceHit *nearest, ReferenceHit hit, uint32_t object, const ReferenceRay *ray);
Quad3 reference_point(const ReferenceRay *ray, Quad t);

// Reduces a margin to the magnitude of another one if that is smaller.
static inline void margin_reduce(double *margin, Quad other)
{
    *margin = fmin(*margin, (double)quad_absolute(other));
}

// A part of a surface, described at its point nearest to a given one.
typedef struct {
    Quad distance;
    Quad3 normal;          // unit, outward or inward
    Quad curvature_radius; // LDBL_MAX if flat
} ReferenceSheet;

// The parts of an object's surface, and the lengths to which tolerances are relative.
typedef struct {
    Vector3 center;
    // Around the center; 0 if unbounded, the radius for an infinite cylinder. Used in the bounds of t and of
    // points.
    double bounding_radius;
    // The smallest radius that decides hit or miss, such as the tube's of a torus; 0 for a plane. Determines
    // the band in which both are permitted.
    double feature_radius;
    // By how many roundings the normal turns as the object's numbers are rounded. For the bound of normals.
    double normal_condition;
    int count;
    ReferenceSheet sheets[6];
} ReferenceSurface;

// The margin within which a ray may hit or miss a triangle, in u times the distance of the farthest vertex.
// Margins are twice the distance across the ray, where roundings move an edge by at most 8.8 u
// (docs/numerics.md), and moved none of 75 million random vertices by more than 5.6 u.
enum { TRIANGLE_BAND = 16 };

ReferenceSurface reference_surface(const Object *object, Quad3 point);
Quad reference_surface_distance(const ReferenceSurface *surface); // to its nearest sheet

// Returns Phong's highlight, max(0, R . V)^shininess, for unit vectors (B. T. Phong, "Illumination for
// Computer Generated Images", CACM 18(6), 1975), or 0 if the light is behind the surface.
Quad reference_highlight(Quad3 normal, Quad3 to_light, Quad3 to_eye, double shininess);
