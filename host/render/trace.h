// Explicit rays and their hits.
#pragma once

#include <stdint.h>

// A renderer first rounds each number to its precision. t is in lengths of `direction`, which need not be
// unit: a point of the ray is origin + t direction. Hits lie strictly between tmin and tmax. A direction
// whose squared length is 0 at the precision (in float, a length below 1e-22) hits nothing; one whose squared
// length is infinite (above 1e19) may.
typedef struct {
    double origin[3], direction[3], tmin, tmax;
} TraceRay;

// What is known of a hit or miss at `certified`, where tmin is 0 and `light` is undefined. A certain one has
// the object that exact arithmetic on the ray's and the scene's numbers finds, and bounds of its t.
typedef enum {
    TRACE_UNCERTAIN,
    TRACE_CERTAIN,           // as float shows
    TRACE_CERTAIN_IN_DOUBLE, // as double shows where float cannot
} TraceCertainty;

typedef struct {
    uint32_t object;                                    // UINT32_MAX: a miss, on which only `light` is valid
    double t;                                           // in lengths of the ray's direction
    double normal[3];                                   // geometric, unit, facing the ray
    double position[3];                                 // the hit point, moved onto the surface
    double reflected_origin[3], reflected_direction[3]; // of the reflected ray
    double refracted_origin[3], refracted_direction[3]; // of the refracted ray
    double transmission; // the refracted ray's weight; 0 at total internal reflection
    double light;        // transmittance along the ray from tmin to tmax
    TraceCertainty certainty;
    double low, high; // where certain, bounds of t
} TraceHit;

// Returns the ray scaled by a power of two, the exponent, so that its direction's largest component lies in
// 0.5 to 1 and its squared length neither underflows nor overflows. The scaling is exact. `farthest` limits
// tmax. A t of the scaled ray is ldexp(t, exponent) for the original t.
TraceRay trace_ray_scaled(TraceRay ray, double farthest, int *exponent);
// Scales back what is in lengths of the direction.
void trace_hit_unscale(TraceHit *hit, int exponent);
