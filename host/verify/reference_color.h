// Computes the exact color along a ray in quadruple precision, with shading, shadows, reflections and
// refractions over the closest hits of host/verify/reference.h. `glint certify` and tests compare images with
// it.
#pragma once

#include "host/verify/reference_scene.h"
#include <stdbool.h>

typedef struct {
    Color color;
    double margin; // the least of the eye's ray, the shadow rays and a checker's edges
} ReferenceColor;

// Settings for reflections and refractions, with `bounce_count` of them in a row.
//
// If `blur` is not 0, the start and direction of each ray are perturbed by up to this part of the size of
// the numbers there. The difference from the colors without blur shows the effect of such errors along the
// path.
typedef struct {
    unsigned bounce_count;
    double min_contribution; // rays whose weight is below it in all channels do not count
    double blur;
    uint64_t seed;
} ReferencePath;

// The contents of the AOVs of the same names.
typedef struct {
    uint32_t object, path;
    Color color;
    double margin;    // the least of all decisions, relative to the distance from the eye
    bool has_texture; // on the path, whose color is then undefined, because textures are filtered
} ReferencePixel;

// Returns whether a decision is within 2^-80 of the distance to it, where the reference itself may be wrong.
bool reference_is_uncertain(const ReferencePixel *pixel);

// Computes a pixel. Sets `shadows`, unless NULL, to whether each light fails to reach its surface, if any.
ReferencePixel reference_pixel(const ReferenceScene *scene, const ReferenceRay *ray,
                               const ReferencePath *path, bool *shadows);
