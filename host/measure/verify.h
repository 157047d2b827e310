// The hard cases: scenes and rays on which ray tracers go wrong, run through the renderer that ships, each
// held to a bound. Expected hits are exact (tests/oracle). docs/verify.md says what each case is.
#pragma once

#include "host/scene/probe.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stddef.h>

// What is owed: A is hygiene and holds at every precision; B, C and D are accuracy at `single`, `strict` and
// `double`, and hold A as well.
typedef enum { TIER_A, TIER_B, TIER_C, TIER_D, TIER_COUNT } VerifyTier;

// The renderer under test, at one precision.
typedef struct {
    void *context;
    // A scene ready for rays, taken as it is, its hierarchy used or not.
    void *(*open)(void *context, const Scene *scene, bool hierarchy);
    void (*trace)(void *opened, const ProbeRay *rays, size_t count, ProbeHit *hits);
    void (*close)(void *opened);
    // The forward axis, and those along the picture's width and height, of a camera.
    void (*camera_axes)(const Camera *camera, Vector3 axes[3]);
} VerifyRenderer;

// How one case went.
typedef struct {
    const char *name, *title;
    size_t ray_count;
    size_t wrong;     // hits that should be misses, misses that should be hits, the wrong object, t or place
    size_t leaks;     // misses of what is closed
    size_t unsound;   // no numbers, hits behind the ray's start, normals that are not unit
    size_t differing; // answers whose bits depend on what they must not depend on
    double worst,
        bound; // the distance's error that is the largest part of its bound, both in ulp; 0, 0: none
} VerifyResult;

bool verify_holds(const VerifyResult *result);

typedef void (*VerifySink)(void *context, const VerifyResult *result);

// Runs every case in turn.
void verify_run(const VerifyRenderer *renderer, VerifyTier tier, VerifySink sink, void *context);
