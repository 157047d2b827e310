// Generates camera rays.
#ifndef CAMERA_H
#define CAMERA_H

#include "numerics/angle.h"
#include "sampling.h"
#include "scene.h"
#include "shapes/certain.h"

typedef struct {
    integer x, y; // counted in the whole image from the top left
} Pixels;

// Returns the direction of a point of the image, given in half pixels from its center.
static inline Vector equirectangular_direction(global const SceneHeader *header, real x, real y)
{
    real longitude = x * (real)(header->right.w), latitude = y * (real)(header->up.w);
    Vector level = vector_of_turns(vector_of(header->forward), vector_of(header->right), longitude);
    return vector_fma(vector_of(header->up), real_sine_of_turns(latitude),
                      vector_scale(level, real_sine_of_turns(0.25f - fabs(latitude))));
}

// Returns the ray of sample `index`, through a point of each pixel. dx and dy run from -1 to 1 across the
// pixel, and 0 is the center. Coordinates are half pixels from the image's center, 2 i + 1 - width, which are
// exact and odd-symmetric, so that a mirrored scene gives the mirrored image bit for bit.
static inline Ray camera_ray(global const SceneHeader *header, Pixels pixels, scalar dx, scalar dy,
                             uint index, mask active)
{
    Sample sample;
    if (HAS_LENS || HAS_AREA_LIGHTS) sample = sample_of_pixels(pixels.x, pixels.y, index);
    real x = real_from_integer(pixels.x * 2 + 1 - integer_of(header->image.x)) + dx;
    real y = real_from_integer(integer_of(header->image.y) - 1 - pixels.y * 2) + dy;
    Vector origin = vector_of(header->eye), direction = vector_of(header->forward);
    bool has_lens = HAS_LENS && header->lens_right.w > 0;
    bool is_orthographic = HAS_ORTHOGRAPHIC && header->lens_up.w == CAMERA_ORTHOGRAPHIC;
    Vector right = vector_of(header->right), up = vector_of(header->up);
    if (is_orthographic)
        origin = vector_fma(right, x, vector_fma(up, y, origin));
    else if (HAS_EQUIRECTANGULAR && header->lens_up.w == CAMERA_EQUIRECTANGULAR)
        direction = equirectangular_direction(header, x, y);
    else
        direction = vector_fma(right, x, vector_fma(up, y, direction));
    if (has_lens) {
        SquarePoint point = disc_of_square(sample_point(&sample, SAMPLED_LENS));
        Vector offset = vector_fma(vector_of(header->lens_right), point.x,
                                   vector_scale(vector_of(header->lens_up), point.y));
        direction = vector_fma(offset, (real)(-header->lens_right.w), direction);
        origin = vector_add(origin, offset);
    }
    Ray ray = ray_make_unit(origin, vector_normalize(direction), active);
    if (HAS_AREA_LIGHTS) ray.sample = sample;
    if (IS_CERTIFIED) ray.direction_error = (real)(header->forward.w * UNIT_ROUNDOFF);
    if (!has_lens && !is_orthographic) ray_set_common_origin(&ray, COMMON_ORIGIN_EYE, mask_none());
    return ray;
}

#endif
