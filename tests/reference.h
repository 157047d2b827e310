// What the kernels should answer, computed once more on the host in quadruple precision: textbook formulas in
// local frames, surfaces tested one by one, no code and no form shared with kernels/.
//
// Everything is exact (about 2^-113) from the numbers it is given; the only rounding to float is asked for:
// `reference_round_object` and `reference_ray_rounded` make of a scene and a ray what a float kernel
// receives.
#pragma once

#include "host/scene/scene.h"
#include <float.h>

#if LDBL_MANT_DIG >= 113
typedef long double Quad;
#else
__extension__ typedef __float128 Quad;
#endif

typedef struct {
    Quad x, y, z;
} Quad3;

typedef struct {
    Quad3 origin, direction;
    Quad tmin, tmax; // a hit lies strictly between
} ReferenceRay;

typedef struct {
    bool found;
    uint32_t object; // UINT32_MAX: a miss
    Quad t;
    Quad3 normal;         // of the geometry, unit, facing the ray
    Quad3 shading_normal; // on the same side; differs on smooth triangles
    bool entering;        // the ray runs against the outward normal: of a triangle, that of its winding
    Quad cosine;          // of the angle between normal and ray, 0 .. 1
    Quad bend; // how far one moves along the surface to turn the normal by about a radian; LDBL_MAX if flat
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
// Every number of the object, rounded to float; of a finite axis, its ends.
Object reference_round_object(const Object *object);

// The nearest hit of one object (`object` of the hit is 0).
ReferenceHit reference_hit_object(const Object *object, const ReferenceRay *ray);
// The nearest hit of a scene; equal distances go to the lowest index.
ReferenceHit reference_hit(const Scene *scene, const ReferenceRay *ray);
Quad3 reference_point(const ReferenceRay *ray, Quad t);

// The unit of the last place of a number of so many bits: 24 for float, 53 for double.
double reference_ulp(Quad value, int significant_bits);
// The length of a - b, taken before it is rounded.
double reference_distance(Vector3 a, Quad3 b);

// The ray through the center of a pixel, row 0 at the top, as DESIGN.md has the camera.
ReferenceRay reference_camera_ray(const Camera *camera, unsigned width, unsigned height, unsigned column,
                                  unsigned row);

typedef struct {
    Color color;
    double margin; // as of a hit, over the eye's ray, the shadow rays and the edges of a checker
} ReferenceColor;

// What the eye sees along a ray: background, or ambient and Phong with shadows (B. T. Phong, "Illumination
// for Computer Generated Pictures", CACM 18(6), 1975). Transparent objects pass their part of the light
// unbent, once for each object. Neither reflection nor refraction.
ReferenceColor reference_color(const Scene *scene, const ReferenceRay *ray);

// With reflections and refractions, `bounce_count` of them in a row.
//
// Where `blur` is not 0, each ray starts and turns a little wrong: by up to so much of the size of the
// numbers there, at random. How far colors differ from those without blur tells what errors of that size come
// to on their way.
typedef struct {
    unsigned bounce_count;
    double blur;
    uint64_t seed;
} ReferencePath;
Color reference_path_color(const Scene *scene, const ReferenceRay *ray, const ReferencePath *path);
