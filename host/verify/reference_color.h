// What an image should show along a ray, in quadruple precision: shading, shadows, reflections and
// refractions over the closest hits of host/verify/reference.h. `glint certify` and tests compare with it.
#pragma once

#include "host/verify/reference_scene.h"
#include <stdbool.h>

// The ray through the center of a pixel, row 0 at the top (docs/scene-format.md), exactly that of the
// camera's vectors in double.
ReferenceRay reference_camera_ray(const Camera *camera, unsigned width, unsigned height, unsigned column,
                                  unsigned row);

typedef struct {
    Color color;
    double margin; // as of a hit, over the eye's ray, the shadow rays and the edges of a checker
} ReferenceColor;

// What the eye sees along a ray: background, or ambient and Phong with shadows. Transparent objects pass
// their part of the light unbent, once for each object. Neither reflection nor refraction.
ReferenceColor reference_color(const Scene *scene, const ReferenceRay *ray);

// With reflections and refractions, `bounce_count` of them in a row.
//
// Where `blur` is not 0, the start and direction of each ray are changed at random by up to this part of the
// size of the numbers there. How far colors differ from those without blur shows what errors of that size
// come to along the path.
typedef struct {
    unsigned bounce_count;
    double min_contribution; // rays whose weight is below it in all channels do not count
    double blur;
    uint64_t seed;
} ReferencePath;

// What the AOVs of the same names hold.
typedef struct {
    uint32_t object, path;
    Color color;
    double margin;    // the least of all decisions, in parts of the distance from the eye
    bool has_texture; // somewhere along the path, where the color is undefined: textures are filtered, not
                      // exact
} ReferencePixel;

// A decision of such a pixel is within 2^-80 of the distance to it: the reference may err in it itself.
bool reference_is_uncertain(const ReferencePixel *pixel);

// `shadows`: of each light, true where it does not reach the surface; undefined without one. Or NULL.
ReferencePixel reference_pixel(const ReferenceScene *scene, const ReferenceRay *ray,
                               const ReferencePath *path, bool *shadows);
Color reference_path_color(const Scene *scene, const ReferenceRay *ray, const ReferencePath *path);
