// The rays of the hard cases, by numbers or by family, and what they require beyond their tiers. The answers
// are the reference's; tests/oracle.sh checks those in exact arithmetic.
#pragma once

#include "host/verify/families.h"
#include "host/verify/run.h"

// What t may be off at each tier, where that is not as the tier has it.
typedef struct {
    double ulps[TIER_COUNT];   // 0: as the tier has it
    double within[TIER_COUNT]; // in units of t; takes precedence over ulps
} VerifyLimits;

#define EXACTLY (-1.0) // ulps: none

// A ray of decimal numbers, each to be rounded once to the precision. It stands for up to five: itself, then
// with the x of its origin and that of its direction one unit in the last place farther from 0 and nearer.
typedef struct {
    double origin[3], direction[3], tmin;
    const char *decided_tiers;  // as of the set, if not NULL
    const VerifyLimits *limits; // as of the set, if not NULL
    double tangent_t;           // not 0: t of a tangent, which counts as a hit
} VerifyRay;

typedef struct {
    const char *name;    // of the case
    const char *objects; // YAML; NULL: built by scene_make
    void (*scene_make)(Scene *);
    const VerifyRay *rays; // NULL: a family's first ray_count
    RayFamily family;
    size_t ray_count;
    size_t checked_count; // of a family: how many have exact answers; all have points and normals
    bool closed;          // every ray of the family hits something
    // The tiers, as in "BCD", at which hit or miss is not open, however near the boundary; of rays by numbers
    // not for their neighbors.
    const char *decided_tiers;
    const VerifyLimits *limits; // or NULL
} VerifyRays;

extern const VerifyRays verify_rays[];
extern const size_t verify_rays_count;

// A ray as it is traced, and what is required of its hit: a neighbor of a given ray has no decided tiers.
typedef struct {
    TraceRay ray;
    VerifyRay required;
} VerifyTestRay;

typedef struct {
    VerifyTestRay *items;
    size_t count, capacity;
} VerifyTestRays;

// The scene of a set; the caller frees it with scene_free.
Scene verify_rays_scene(const VerifyRays *set);
// The rays of a set that have exact answers, at the precision at work; the caller frees the items.
VerifyTestRays verify_test_rays(const VerifyRun *run, const VerifyRays *set);
// Traces a set of rays and checks their hits.
void verify_rays_run(VerifyRun *run, const VerifyRays *set);
