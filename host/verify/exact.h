// What rays meet, in long double and from the shapes' definitions: the oracle of the pictures, whose rays are
// only known once they have been traced. No form is the kernels'.
#pragma once

#include "host/verify/run.h"

typedef long double Long;

typedef struct {
    Long x, y, z;
} LongVector;

LongVector long_vector(Vector3 a);
LongVector long_add(LongVector a, LongVector b);
LongVector long_subtract(LongVector a, LongVector b);
LongVector long_scale(LongVector a, Long factor);
Long long_dot(LongVector a, LongVector b);
LongVector long_cross(LongVector a, LongVector b);
Long long_length(LongVector a);
LongVector long_unit(LongVector a);

// A point as the kernels have it: from the eye, rounded once.
LongVector exact_from_eye(const VerifyRun *run, Vector3 point, Vector3 eye);
LongVector exact_pixel_ray(const Film *picture, size_t pixel);

// What a ray from the origin meets.
typedef struct {
    bool found;
    Long t;
    LongVector normal; // unit, outward
    Long cosine;       // of the ray with the normal, not negative
    Long margin;       // 1 - (l / radius)^2 for the least distance l from the center, axis or circle
    double distance, radius, size; // the origin's from the center; of the shape: for tolerances
} ExactHit;

ExactHit exact_sphere(LongVector center, Long radius, LongVector direction);
ExactHit exact_plane(LongVector point, LongVector normal, LongVector direction);
// An endless cylinder; `size`: of the one that stands for it.
ExactHit exact_cylinder(LongVector point, LongVector axis, Long radius, double size, LongVector direction);
ExactHit exact_torus(LongVector center, Long major, Long minor, LongVector direction); // around the z axis

// Phong's max(0, cos)^power for the angle between the mirrored light and the eye, in the way that keeps small
// angles; 1 for a power of 0. No light reaches what faces away from it.
Long exact_highlight(LongVector normal, LongVector to_light, LongVector ray, double power);

// Whether the tier leaves open that the ray hits.
bool exact_is_open(const VerifyRun *run, const ExactHit *exact);
// Holds a hit or a miss, and the distance of a hit, to what the tier owes; tier A owes nothing here.
void exact_judge(VerifyRun *run, const ExactHit *exact, bool found, double t);

// Holds a hit to the surface it is on: its point, o + t d, to how far that may be off, and its normal to the
// surface's there. `object` is one of the scene that was given to the renderer as it is.
void exact_judge_surface(VerifyRun *run, const Object *object, const TraceRay *ray, const TraceHit *hit);
// The distance of a point from an object's surface.
Long exact_surface_distance(const VerifyRun *run, const Object *object, LongVector point);
