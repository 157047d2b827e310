// Explicit rays and the hits that they find.
#pragma once

#include "host/compile/settings.h"
#include "host/opencl/device.h"
#include "host/scene/vector.h"
#include <stdint.h>

// A ray whose numbers a renderer rounds to its precision. Its points are origin + t direction. `direction`
// need not be a unit vector, and t is measured in its lengths. Hits lie strictly between tmin and tmax. A
// direction whose squared length is 0 at the precision (in float, a length below 1e-22) hits nothing. A
// direction whose squared length is infinite (a length above 1e19) may hit something.
typedef struct {
    Vector3 origin, direction;
    double tmin, tmax;
} TraceRay;

// The certainty of a hit or miss at `certified`, where tmin is 0 and `light` is undefined. A certain hit has
// the object that exact arithmetic on the ray's and the scene's numbers finds, and bounds on its t.
typedef enum {
    TRACE_UNCERTAIN,
    TRACE_CERTAIN,           // proven in float
    TRACE_CERTAIN_IN_DOUBLE, // proven in double, after float left it uncertain
} TraceCertainty;

typedef struct {
    uint32_t object; // UINT32_MAX on a miss, where only `light` is valid
    TraceCertainty certainty;
    double t;         // in lengths of the ray's direction
    double low, high; // bounds on t, if it is certain
    Vector3 normal;   // geometric, unit, facing the ray
    Vector3 position; // the hit point, moved onto the surface
    // undefined where only the closest hit was asked for
    Vector3 reflected_origin, reflected_direction; // of the reflected ray
    Vector3 refracted_origin, refracted_direction; // of the refracted ray
    double transmission; // the refracted ray's weight; 0 at total internal reflection
    double light;        // transmittance along the ray from tmin to tmax
} TraceHit;

// Fewer rays are not worth a thread, because the host converts these in a few tenths of a millisecond.
enum { RAYS_PER_THREAD_MIN = 4096 };

// Returns the ray with its direction divided by 2^*exponent, and its tmin and tmax multiplied by that, so
// that the direction's largest component lies in 0.5 to 1 and its squared length neither underflows nor
// overflows. The scaling is exact, except of a tmin or tmax that underflows. tmax becomes at most the largest
// number of the precision. A t of the scaled ray is ldexp(t, *exponent) for the original t.
TraceRay trace_ray_scaled(TraceRay ray, Precision precision, int *exponent);
// Returns why the ray cannot be scaled and traced at the precision, or NULL.
const char *trace_ray_why_not(const TraceRay *ray, Precision precision);
// Scales the hit's numbers back to lengths of the original direction.
void trace_hit_unscale(TraceHit *hit, int exponent);
