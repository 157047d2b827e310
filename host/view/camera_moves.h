// Moves a camera by mouse and keys. Angles are in radians; pixels are counted from the image's top left.
#pragma once

#include "host/scene/scene.h"
#include <stdint.h>

typedef struct {
    uint32_t width, height;
} ImageSize;

typedef struct {
    Vector3 origin, direction; // unit
} CameraRay;

bool cameras_equal(const Camera *a, const Camera *b);

// Returns the ray through a pixel's center, from the center of the lens.
CameraRay camera_ray(const Camera *camera, ImageSize size, double x, double y);

// Turns the camera about `up` and then about the image's horizontal axis. Both axes pass through a point,
// which stays where it is in the image. Positive angles turn the view to the left and up. The view stays a
// degree away from `up`, so that it does not turn over.
void camera_orbit(Camera *camera, Vector3 pivot, double yaw, double pitch);

// Moves sideways so that a point `distance` along the ray through one pixel is seen in another.
void camera_pan(Camera *camera, ImageSize size, double distance, const double from[2], const double to[2]);

// Moves towards a point, which stays where it is in the image, to `factor` of the distance to it. With
// parallel rays the image shows `factor` of what it showed.
void camera_dolly(Camera *camera, Vector3 pivot, double factor);

// Moves along the view, to the right and up.
void camera_fly(Camera *camera, double forward, double right, double up);

// Turns towards a point. A point at the eye has no effect.
void camera_look_at(Camera *camera, Vector3 point);
