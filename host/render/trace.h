// Explicit rays and what becomes of them: what a renderer is asked and answers when it is probed.
#pragma once

#include <stdint.h>

// A renderer rounds each number to its precision first. A point of the ray is origin + t direction, so that t
// counts lengths of `direction`, which need not be unit; hits lie strictly between tmin and tmax. A direction
// whose length squared is 0 at the precision (in float, a length below 1e-22) meets nothing; one whose length
// squared is infinite (above 1e19) may.
typedef struct {
    double origin[3], direction[3], tmin, tmax;
} TraceRay;

typedef struct {
    uint32_t object;                                  // UINT32_MAX: a miss, and only `light` has a meaning
    double t;                                         // in lengths of the ray's direction
    double normal[3];                                 // unit, of the geometry, facing the ray
    double position[3];                               // the hit, put onto the surface
    double mirrored_origin[3], mirrored_direction[3]; // of the reflected ray
    double passed_origin[3], passed_direction[3];     // of the refracted one
    double passed;                                    // how much of the ray passes; 0 where all is reflected
    double light; // how much light passes along the ray between tmin and tmax
} TraceHit;
