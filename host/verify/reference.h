// What rays and shapes should answer: the reference of `glint verify` and of the tests, in quadruple
// precision. Textbook formulas in local frames, surfaces tested one by one, no code and no form shared with
// kernels/. tests/oracle.sh checks it against exact arithmetic.
//
// Everything is exact (about 2^-113) from the numbers it is given. The only rounding to float is explicit:
// `reference_round_object` and `reference_ray_rounded` make of an object and a ray what a float kernel
// receives. A shape is one file of shapes/.
#pragma once

#include "host/scene/quad.h"
#include "host/scene/scene.h"

typedef struct {
    Quad3 origin, direction;
    Quad tmin, tmax; // a hit lies strictly between
} ReferenceRay;

typedef struct {
    bool found;
    uint32_t object; // UINT32_MAX: a miss
    Quad t;
    Quad3 normal;          // of the geometry, unit, facing the ray
    Quad3 shading_normal;  // on the same side; differs on smooth triangles
    bool entering;         // the ray runs against the outward normal: of a triangle, that of its winding
    Quad cosine;           // of the angle between normal and ray, 0 .. 1
    Quad curvature_radius; // LDBL_MAX if flat
    // About twice the distance, in scene units, between the ray's line and the nearest curve at which the
    // answer changes (silhouette, rim, edge, apex), or between two surfaces that compete. Never larger than
    // it is at the boundary that matters; other boundaries may make it smaller. For a sphere it is r |1 -
    // (l/r)^2|.
    Quad margin;
} ReferenceHit;

// From 0 to the largest float.
ReferenceRay reference_ray(Vector3 origin, Vector3 direction);
// The same from numbers rounded to float.
ReferenceRay reference_ray_rounded(Vector3 origin, Vector3 direction);
// An object with every number rounded to float; of a finite axis, its ends.
Object reference_round_object(const Object *object);
// An object relative to an eye, which is subtracted in double.
Object reference_object_from(const Object *object, Vector3 eye);

// The nearest hit of one object (`object` of the hit is 0). Misses of round shapes farther away than 2^40
// radii are decided by roots that have cancelled, and are not reliable.
ReferenceHit reference_hit_object(const Object *object, const ReferenceRay *ray);
// Takes the hit of an object if it is the nearest so far, and its margin in any case; equal distances go to
// the object taken first. Begins with the hit of no object, reference_miss.
ReferenceHit reference_miss(void);
void reference_hit_take(ReferenceHit *nearest, ReferenceHit hit, uint32_t object, const ReferenceRay *ray);
// The nearest hit of a scene; equal distances go to the lowest index.
ReferenceHit reference_hit(const Scene *scene, const ReferenceRay *ray);
Quad3 reference_point(const ReferenceRay *ray, Quad t);

// A part of a surface as seen from a point: the nearest place of it.
typedef struct {
    Quad distance;
    Quad3 normal;          // unit, outward or inward
    Quad curvature_radius; // LDBL_MAX if flat
} ReferenceSheet;

// The parts that an object's surface consists of, and the measures that tolerances refer to.
typedef struct {
    Vector3 center;
    // Around the center, 0 if unbounded; of an infinite cylinder its radius. For the bounds of t and of
    // points.
    double bounding_radius;
    // The smallest radius that decides hit or miss: of a torus its tube's, 0 of a plane. For the band in
    // which these are open.
    double feature_radius;
    // How many roundings the normal turns by when the object's numbers are rounded. For the bound of normals.
    double normal_condition;
    int count;
    ReferenceSheet sheets[6];
} ReferenceSurface;

ReferenceSurface reference_surface(const Object *object, Quad3 point);
Quad reference_surface_distance(const ReferenceSurface *surface); // that of its nearest sheet

// Phong's highlight, max(0, R . V)^shininess, for unit vectors (B. T. Phong, "Illumination for Computer
// Generated Images", CACM 18(6), 1975); 0 where the light is behind the surface.
Quad reference_highlight(Quad3 normal, Quad3 to_light, Quad3 to_eye, double shininess);

// The unit of the last place of a number with this many significant bits: 24 for float, 53 for double.
double reference_ulp(Quad value, int significant_bits);
// The length of a - b, taken before it is rounded.
double reference_distance(Vector3 a, Quad3 b);
