// The hard cases: scenes and rays on which ray tracers go wrong, run through the renderer that ships, each
// within a bound. Expected hits are exact (tests/oracle). docs/verify.md says what each case is.
#pragma once

#include "host/render/renderer.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// What is required: A is hygiene, at every precision; B, C and D are A and accuracy at `single`, `strict` and
// `double`.
typedef enum { TIER_A, TIER_B, TIER_C, TIER_D, TIER_COUNT } VerifyTier;

// How the scenes are rendered.
typedef struct {
    RenderSettings render; // precision, lanes, bounce_count, no_cache and perturb_…; each scene sets the rest
    bool lean;             // build kernels of what each scene needs alone, not one for all scenes
    bool quick;            // a sixteenth of the random rays, and fewer pixels
    // Gets the scene and settings of each image, for checks of one's own; or NULL.
    void (*picture)(void *context, const Scene *scene, const RenderSettings *settings);
    void *context;
} VerifySettings;

// `single` need not meet tier B on a device that is perturbed; `strict` corrects the perturbation.
VerifyTier verify_tier(const RenderSettings *settings);

// The last kernels that ran.
typedef struct {
    uint32_t lanes;
    uint64_t trace_hash, render_hash;
} VerifyKernels;

// How one case went.
typedef struct {
    const char *name, *title;
    size_t ray_count; // and pixels
    size_t wrong;     // hits that should be misses, misses that should be hits, the wrong object, t or place
    size_t leaks;     // misses of what is closed
    size_t unsound;   // no numbers, hits behind the ray's start, normals that are not unit
    size_t off_surface;   // hits whose point is farther from the surface than it may be
    size_t wrong_normals; // normals that are not the surface's
    size_t differing;     // answers whose bits depend on what they must not depend on
    double worst, bound;  // the error that is the largest part of its bound; 0, 0: none
    const char *unit;     // of both
    double worst_position_ratio,
        worst_normal_ratio; // the largest errors of points and normals over their bounds
    uint64_t hash;          // of every answer's bits, in order
} VerifyResult;

bool verify_holds(const VerifyResult *result);

typedef struct {
    // Returns whether to run a case, of which the name and the title are known; NULL: all are run.
    bool (*start)(void *context, const VerifyResult *result);
    // Returns whether to continue with the next case.
    bool (*take)(void *context, const VerifyResult *result);
    void *context;
} VerifySink;

// Which cases to run, by name; NULL: all.
typedef struct {
    char *const *names;
    size_t count;
} VerifyChoice;

enum { VERIFY_CASES_MAX = 64 };
// In the order in which they run; NULL past the last.
const char *verify_case_name(size_t i);

// The bits of the reference's numbers: 113, or those of a long double where the compiler has no more.
int verify_reference_bits(void);

// Runs the cases in turn, until the sink ends it. Keeps *kernels up to date.
void verify_run(Compute *compute, const VerifySettings *settings, const VerifyChoice *choice,
                const VerifySink *sink, VerifyKernels *kernels);
