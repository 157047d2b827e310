// The hard cases are scenes and rays on which ray tracers fail. They run through the renderer that ships,
// and each has a bound. Expected hits are exact (tests/oracle.sh checks them). docs/verify.md describes each
// case.
#pragma once

#include "host/render/renderer.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The requirements. Tier A is hygiene at every precision; B, C and D add accuracy at `single`, `strict` and
// `double`.
typedef enum { TIER_A, TIER_B, TIER_C, TIER_D, TIER_COUNT } VerifyTier;

// The settings of all scenes.
typedef struct {
    RenderSettings render; // precision, lanes, bounce_count, no_cache and perturb_…; each scene sets the rest
    bool lean;             // build kernels for each scene's needs, not one for all scenes
    bool quick;            // a sixteenth of the random rays, and fewer pixels
    // Receives the scene and settings of each image, for further checks; or NULL.
    void (*receive_image)(void *context, const Scene *scene, const RenderSettings *settings);
    void *context;
} VerifySettings;

// Returns a precision's tier. A perturbed device need not reach B at `single`; `strict` corrects for it.
VerifyTier verify_tier(const RenderSettings *settings);

// The last kernels that ran.
typedef struct {
    uint32_t lanes;
    uint64_t trace_hash, render_hash;
} VerifyKernels;

// The result of one case.
typedef struct {
    const char *name, *title;
    size_t ray_count;   // rays and pixels
    size_t wrong;       // false hits, false misses, and wrong objects, t or points
    size_t leaks;       // misses of closed objects
    size_t unsound;     // NaN or infinity, hits behind the ray's start, and normals that are not unit vectors
    size_t off_surface; // hits whose point is too far from the surface
    size_t wrong_normals; // normals that are not the surface's
    size_t differing;     // answers whose bits depend on something irrelevant
    double worst, bound;  // the error with the largest ratio to its bound, both 0 without one
    const char *unit;     // the unit of worst and bound
    double worst_position_ratio,
        worst_normal_ratio; // the largest errors of points and normals over their bounds
    uint64_t hash;          // hashes the bits of all answers, in order
} VerifyResult;

bool verify_holds(const VerifyResult *result);

typedef struct {
    // Returns whether to run a case, whose name and title are set. NULL runs all.
    bool (*start)(void *context, const VerifyResult *result);
    // Returns whether to continue with the next case.
    bool (*receive)(void *context, const VerifyResult *result);
    void *context;
} VerifySink;

enum { VERIFY_CASES_MAX = 64 };
// Returns the names in the order in which the cases run, and NULL past the last.
const char *verify_case_name(size_t i);

// Runs the cases in turn until the sink stops it, and keeps *kernels up to date.
void verify_run(Compute *compute, const VerifySettings *settings, const VerifySink *sink,
                VerifyKernels *kernels);
