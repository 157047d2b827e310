// Computes the camera's frame in double, so that every device starts from the same bits.
#pragma once

#include "host/scene/scene.h"
#include <stdint.h>

typedef struct {
    Vector3 forward;   // unit
    Vector3 right, up; // half a pixel along the image's width and height, at distance 1, in its middle
    // The middle of the image, as seen from the eye, at distance 1: `forward` unless the frame is shifted.
    // With parallel rays, the middle is at `shift` and the rays run along `forward`.
    Vector3 middle, shift;
} CameraBasis;

// Returns the frame. The world axis least aligned with the view (the first of x, y, z in a tie) replaces an
// `up` that is zero or parallel to the view.
CameraBasis camera_basis(const Camera *camera, uint32_t width, uint32_t height);

// Returns a bound on the error of a kernel's rays in perspective, in units of roundoff of their length. With
// a shifted frame the bound is CAMERA_SHIFT_ERROR times 1 + |middle|. Beyond CAMERA_DIRECTION_ERROR_MAX the
// rays of the eye are farther off than cull spheres allow at `certified`.
enum { CAMERA_DIRECTION_ERROR_MAX = 32, CAMERA_SHIFT_ERROR = 6 };
double camera_direction_error(const CameraBasis *basis);
