// Checks hits against the reference, within the bounds of the tiers.
#pragma once

#include "host/verify/rays.h"
#include "host/verify/reference.h"
#include "host/verify/run.h"

// An object as the renderer stores it, relative to the rays' origin.
typedef struct {
    Object object;
    double distance;                        // from the rays' origin to the object's center
    double bounding_radius, feature_radius; // those of ReferenceSurface
} VerifyTarget;

// Returns the object relative to an eye, rounded to the precision at work.
VerifyTarget verify_target(const VerifyRun *run, const Object *object, Vector3 eye);

// Returns the exact hit of a target by the ray of a pixel.
ReferenceHit verify_pixel_hit(const VerifyTarget *target, const Film *image, size_t pixel);
// Checks hit or miss and the distance at a pixel of an image of the target alone. Returns the exact hit.
ReferenceHit verify_check_pixel(VerifyRun *run, const VerifyTarget *target, const Film *image, size_t pixel);

// Returns the objects of a scene rounded to the precision at work, for the duration of the case.
Object *verify_objects(VerifyRun *run, const Scene *scene);
ReferenceRay verify_reference_ray(const TraceRay *ray);

// Returns whether the ray must hit or miss exactly as the reference does, however near the boundary.
bool verify_is_exact(const VerifyRun *run, const VerifyTestRay *test);
// The tier's requirements for a ray and an object.
typedef struct {
    ReferenceHit exact; // or the tangent that counts as a hit
    bool open;          // whether the margin permits both hit and miss
    double bound;       // bounds the error of t, in units of t
} VerifyExpected;

VerifyExpected verify_expected(const VerifyRun *run, const Object *object, const VerifyTestRay *test,
                               ReferenceHit exact);
// Checks the hit of a ray. Where objects touch, as at an edge of a mesh, any of them may be reported.
void verify_check_ray(VerifyRun *run, const Object *objects, size_t count, const VerifyTestRay *test,
                      const TraceHit *hit);
// Checks the distance of a hit point, o + t d, from its object's surface, and checks its normal.
void verify_check_surface(VerifyRun *run, const Object *object, const TraceRay *ray, const TraceHit *hit);
