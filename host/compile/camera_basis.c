#include "host/compile/camera_basis.h"

CameraBasis camera_basis(const Camera *camera, uint32_t width, uint32_t height)
{
    Vector3 forward = vector_normalize(vector_subtract(camera->look_at, camera->position));
    Vector3 right = vector_cross(forward, vector_normalize(camera->up));
    // below this sine the cross product is rounding noise, not a direction
    if (vector_length(right) < 1e-12) right = vector_cross(forward, vector_least_aligned_axis(forward));
    right = vector_normalize(right);
    Vector3 up = vector_cross(right, forward);
    double span = camera->field_axis == FIELD_VERTICAL ? height : width;
    double half_pixel = camera->half_tangent / span;
    return (CameraBasis){forward, vector_scale(right, half_pixel), vector_scale(up, half_pixel)};
}
