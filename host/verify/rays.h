// The rays of the hard cases, from tables or families, and their requirements beyond the tiers. The
// reference computes the answers; tests/oracle.sh checks those in exact arithmetic.
#pragma once

#include "host/base/array.h"
#include "host/verify/families.h"
#include "host/verify/run.h"

// The permitted error of t at each tier, where it is not the tier's.
typedef struct {
    double ulps[TIER_COUNT];   // 0 for the tier's
    double within[TIER_COUNT]; // in units of t; takes precedence over ulps
} VerifyLimits;

#define EXACTLY (-1.0) // as ulps, permits no error

// A ray in decimal numbers, each rounded once to the precision. It stands for itself and for up to four
// neighbors, with the next number farther from 0 or nearer to it as the x of its origin or of its direction.
typedef struct {
    Vector3 origin, direction;
    double tmin;
    const char *exact_tiers;    // NULL for those of the set
    const VerifyLimits *limits; // NULL for those of the set
    double tangent_t;           // t of a tangent, which counts as a hit, or 0
} VerifyRay;

typedef struct {
    const char *name;    // the case's name
    const char *objects; // YAML, or NULL if scene_make builds them
    void (*scene_make)(Scene *);
    const VerifyRay *rays; // NULL for a family's first ray_count rays
    RayFamily family;
    size_t ray_count;
    size_t checked_count; // a family's rays with exact answers; all have their points and normals checked
    bool closed;          // every ray of the family hits something
    // The tiers, as in "BCD", that require the exact hit or miss, however near the boundary. For a table of
    // rays this excludes the neighbors.
    const char *exact_tiers;
    const VerifyLimits *limits; // or NULL
} VerifyRays;

extern const VerifyRays verify_rays[];
extern const size_t verify_rays_count;

// A ray as it is traced, and the requirements for its hit. A neighbor of a table's ray has no exact tiers.
typedef struct {
    TraceRay ray;
    VerifyRay required;
} VerifyTestRay;

typedef ARRAY_OF(VerifyTestRay) VerifyTestRays;

// Returns the scene of a set, for the duration of the case.
Scene *verify_rays_scene(VerifyRun *run, const VerifyRays *set);
// Returns the rays of a set that have exact answers, at the precision at work, for the duration of the case.
VerifyTestRays verify_test_rays(VerifyRun *run, const VerifyRays *set);
// Sets rays `first` to `first` + `count` - 1 of a family, rounded to the precision at work.
void verify_family(const VerifyRun *run, RayFamily family, uint64_t first, size_t count, TraceRay *rays);
// Traces a set of rays and checks their hits.
void verify_rays_run(VerifyRun *run, const VerifyRays *set);
