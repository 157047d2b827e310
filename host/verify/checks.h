// What the tiers require of hits, against the reference.
#pragma once

#include "host/verify/rays.h"
#include "host/verify/reference.h"
#include "host/verify/run.h"

// An object as the renderer has it, seen from where rays start.
typedef struct {
    Object object;
    double distance;                        // of the rays' origin from the object's center
    double bounding_radius, feature_radius; // as of ReferenceSurface
} VerifyTarget;

// Relative to an eye, in the numbers of the precision at work.
VerifyTarget verify_target(const VerifyRun *run, const Object *object, Vector3 eye);

// What the ray of a pixel should hit of a target.
ReferenceHit verify_pixel_hit(const VerifyTarget *target, const Film *image, size_t pixel);
// Checks hit or miss and the distance at a pixel of an image of the target alone; returns what is exact.
ReferenceHit verify_check_pixel(VerifyRun *run, const VerifyTarget *target, const Film *image, size_t pixel);

// The objects of a scene in the numbers of the precision at work; the caller frees them.
Object *verify_objects(const VerifyRun *run, const Scene *scene);
ReferenceRay verify_reference_ray(const TraceRay *ray);

// Whether the ray has to hit or to miss as it does exactly, however near the boundary.
bool verify_is_decided(const VerifyRun *run, const VerifyTestRay *test);
// What the tier requires of a ray at an object: the exact hit, or the touch that counts as one; whether hit
// or miss is open by the margin; and what t may be off, in its own unit.
typedef struct {
    ReferenceHit exact;
    bool open;
    double bound;
} VerifyExpected;

VerifyExpected verify_expected(const VerifyRun *run, const Object *object, const VerifyTestRay *test,
                               ReferenceHit exact);
// Checks what a ray hit of objects. Where they meet, as at an edge of a mesh, any of them may be reported.
void verify_check_ray(VerifyRun *run, const Object *objects, size_t count, const VerifyTestRay *test,
                      const TraceHit *hit);
// Checks how far a hit's point, o + t d, is off its object's surface, and its normal.
void verify_check_surface(VerifyRun *run, const Object *object, const TraceRay *ray, const TraceHit *hit);
