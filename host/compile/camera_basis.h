// The camera's frame, worked out in double so that every device starts from the same bits.
#pragma once

#include "host/scene/scene.h"
#include <stdint.h>

typedef struct {
    Vector3 forward;   // unit
    Vector3 right, up; // half a pixel along the image's width and height, at distance 1
} CameraBasis;

// Where `up` is zero or parallel to the view, the world axis least aligned with the view stands in for it
// (the first of x, y, z where several are).
CameraBasis camera_basis(const Camera *camera, uint32_t width, uint32_t height);
