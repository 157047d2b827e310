// The hard cases: scenes and rays on which ray tracers go wrong, run through the renderer that ships, each
// held to a bound. Expected hits are exact (tests/oracle). docs/verify.md says what each case is.
#pragma once

#include "host/render/film.h"
#include "host/render/trace.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// What is owed: A is hygiene and holds at every precision; B, C and D are accuracy at `single`, `strict` and
// `double`, and hold A as well.
typedef enum { TIER_A, TIER_B, TIER_C, TIER_D, TIER_COUNT } VerifyTier;

// The renderer under test, at one precision.
typedef struct {
    void *context;
    // A scene ready for rays, taken as it is, its hierarchy used or not.
    void *(*open)(void *context, const Scene *scene, bool hierarchy);
    void (*trace)(void *opened, const TraceRay *rays, size_t count, TraceHit *hits);
    void (*close)(void *opened);
    // Renders an image of the scene, with all its layers.
    Film (*render)(void *context, const Scene *scene, bool hierarchy, uint32_t width, uint32_t height);
    // The forward axis, and those along the picture's width and height, of a camera.
    void (*camera_axes)(const Camera *camera, Vector3 axes[3]);
    // Whether quotients and roots are as wrong as OpenCL C allows, by up to 2 and 3 ulp.
    bool inexact;
} VerifyRenderer;

// How one case went.
typedef struct {
    const char *name, *title;
    size_t ray_count; // and pixels
    size_t wrong;     // hits that should be misses, misses that should be hits, the wrong object, t or place
    size_t leaks;     // misses of what is closed
    size_t unsound;   // no numbers, hits behind the ray's start, normals that are not unit
    size_t off;       // hits whose point is farther from the surface than it may be
    size_t turned;    // normals that are not the surface's
    size_t differing; // answers whose bits depend on what they must not depend on
    double worst, bound; // the error that is the largest part of its bound; 0, 0: none
    const char *unit;    // of both
    // The largest of those two errors, as a part of its bound.
    double surface_part, normal_part;
    uint64_t hash; // of every answer's bits, in order
} VerifyResult;

bool verify_holds(const VerifyResult *result);

// Returns whether to go on with the next case.
typedef bool (*VerifySink)(void *context, const VerifyResult *result);

// Which cases to run, by name; NULL: all.
typedef struct {
    char *const *names;
    size_t count;
} VerifyChoice;

bool verify_is_case(const char *name);

// The bits of the numbers in which pictures are judged. Where a long double is no more than a double,
// pictures at `double` are judged by their like; rays have exact answers all the same.
int verify_oracle_bits(void);

// Runs the cases in turn, until the sink ends it.
void verify_run(const VerifyRenderer *renderer, VerifyTier tier, const VerifyChoice *choice, VerifySink sink,
                void *context);
