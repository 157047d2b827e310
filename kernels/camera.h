// Camera rays.
#ifndef CAMERA_H
#define CAMERA_H

#include "scene.h"
#include "shapes/certain.h"

typedef struct {
    integer x, y; // counted in the whole image from the top left
} Pixels;

// Returns the ray through a point of each pixel. dx and dy run from -1 to 1 across the pixel, and 0 is the
// center. Coordinates are half pixels from the image's center, 2 i + 1 - width, which are exact and
// odd-symmetric, so that a mirrored scene gives the mirrored image bit for bit.
static inline Ray camera_ray(global const SceneHeader *header, Pixels pixels, scalar dx, scalar dy,
                             mask active)
{
    real x = real_from_integer(pixels.x * 2 + 1 - (integer)((scalar_integer)header->image.x)) + dx;
    real y = real_from_integer((integer)((scalar_integer)header->image.y) - 1 - pixels.y * 2) + dy;
    Vector direction = vector_fma(vector_of(header->right), x,
                                  vector_fma(vector_of(header->up), y, vector_of(header->forward)));
    Ray ray = ray_make_unit(vector_of(header->eye), vector_normalize(direction), active);
    if (IS_CERTIFIED) ray.direction_error = (real)(CAMERA_DIRECTION_ERROR * UNIT_ROUNDOFF);
    ray_set_common_origin(&ray, COMMON_ORIGIN_EYE, mask_none());
    return ray;
}

#endif
