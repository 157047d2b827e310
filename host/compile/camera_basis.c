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
    double half_pixel_up = camera->projection == PROJECTION_EQUIRECTANGULAR ? M_PI / 2 / height : half_pixel;
    CameraBasis basis = {
        forward, vector_scale(right, half_pixel), vector_scale(up, half_pixel_up), forward, {0}};
    if (camera->shift[0] != 0 || camera->shift[1] != 0) { // adding 0 could change the sign of a zero
        const double frame = 2 * camera->half_tangent;
        basis.shift = vector_add(vector_scale(right, camera->shift[0] * frame),
                                 vector_scale(up, camera->shift[1] * frame));
        if (camera->projection != PROJECTION_ORTHOGRAPHIC) basis.middle = vector_add(forward, basis.shift);
    }
    return basis;
}

// The roundings of the three vectors, which are perpendicular, add up to sqrt 3, those of two sums to 2, of
// an offset in the pixel to 1 and of the unit length to 1. If the frame is shifted, the middle and the
// offset from it, each at most |middle| + |d| long, may cancel down to the ray's d, which is at least 1 long
// (docs/numerics.md).
double camera_direction_error(const CameraBasis *basis)
{
    return vector_is_zero(basis->shift) ? 7 : CAMERA_SHIFT_ERROR * (1 + vector_length(basis->middle));
}
