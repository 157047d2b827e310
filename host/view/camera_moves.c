#include "host/view/camera_moves.h"

#include "host/compile/camera_basis.h"
#include "host/scene/portable.h"

static const double POLE_ANGLE = M_PI / 180; // the smallest between the view and `up`

bool cameras_equal(const Camera *a, const Camera *b)
{
    return vectors_equal(a->position, b->position) && vectors_equal(a->look_at, b->look_at) &&
           vectors_equal(a->up, b->up) && a->field_axis == b->field_axis &&
           a->half_tangent == b->half_tangent && a->shift[0] == b->shift[0] && a->shift[1] == b->shift[1] &&
           a->projection == b->projection && a->lens.radius == b->lens.radius &&
           a->lens.distance == b->lens.distance && a->lens.focus == b->lens.focus &&
           vectors_equal(a->lens.point, b->lens.point);
}

static void camera_move(Camera *camera, Vector3 by)
{
    camera->position = vector_add(camera->position, by);
    camera->look_at = vector_add(camera->look_at, by);
}

CameraRay camera_ray(const Camera *camera, ImageSize size, double x, double y)
{
    CameraBasis basis = camera_basis(camera, size.width, size.height);
    Vector3 right = vector_scale(basis.right, 2 * x + 1 - size.width);
    Vector3 up = vector_scale(basis.up, size.height - 1 - 2 * y);
    if (camera->projection == PROJECTION_EQUIRECTANGULAR) {
        const double longitude = M_PI * ((2 * x + 1) / size.width - 1),
                     latitude = M_PI / 2 * (1 - (2 * y + 1) / size.height);
        const Vector3 level = vector_add(vector_scale(basis.forward, cos(longitude)),
                                         vector_scale(vector_normalize(basis.right), sin(longitude)));
        return (CameraRay){camera->position,
                           vector_add(vector_scale(level, cos(latitude)),
                                      vector_scale(vector_normalize(basis.up), sin(latitude)))};
    }
    Vector3 across = vector_add(vector_add(right, up), basis.shift);
    if (camera->projection == PROJECTION_ORTHOGRAPHIC)
        return (CameraRay){vector_add(camera->position, across), basis.forward};
    return (CameraRay){camera->position, vector_normalize(vector_add(basis.forward, across))};
}

static void camera_rotate(Camera *camera, Vector3 pivot, Vector3 axis, double angle)
{
    Vector3 position = vector_subtract(camera->position, pivot);
    Vector3 look_at = vector_subtract(camera->look_at, pivot);
    camera->position = vector_add(pivot, vector_rotated(position, axis, angle));
    camera->look_at = vector_add(pivot, vector_rotated(look_at, axis, angle));
}

// Replaces an unusable `up` of a camera by that of its image.
static void camera_set_upright(Camera *camera)
{
    CameraBasis basis = camera_basis(camera, 1, 1);
    Vector3 up = vector_normalize(camera->up);
    bool is_usable = vector_length(vector_cross(basis.forward, up)) > 1e-9;
    camera->up = is_usable ? up : vector_normalize(basis.up);
}

void camera_orbit(Camera *camera, Vector3 pivot, double yaw, double pitch)
{
    camera_set_upright(camera);
    camera_rotate(camera, pivot, camera->up, yaw);
    CameraBasis basis = camera_basis(camera, 1, 1);
    double to_up = acos(fmax(-1, fmin(vector_dot(basis.forward, camera->up), 1)));
    double most = fmax(0, to_up - POLE_ANGLE), least = fmin(0, to_up - (M_PI - POLE_ANGLE));
    camera_rotate(camera, pivot, vector_normalize(basis.right), fmax(least, fmin(pitch, most)));
}

void camera_pan(Camera *camera, ImageSize size, double distance, const double from[2], const double to[2])
{
    CameraBasis basis = camera_basis(camera, size.width, size.height);
    Vector3 ray = camera_ray(camera, size, from[0], from[1]).direction;
    if (camera->projection == PROJECTION_EQUIRECTANGULAR) {
        Vector3 other = camera_ray(camera, size, to[0], to[1]).direction;
        camera_move(camera, vector_scale(vector_subtract(ray, other), distance));
        return;
    }
    double depth =
        camera->projection == PROJECTION_ORTHOGRAPHIC ? 1 : distance * vector_dot(basis.forward, ray);
    Vector3 right = vector_scale(basis.right, 2 * depth * (from[0] - to[0]));
    Vector3 up = vector_scale(basis.up, 2 * depth * (to[1] - from[1]));
    camera_move(camera, vector_add(right, up));
}

void camera_dolly(Camera *camera, Vector3 pivot, double factor)
{
    if (camera->projection == PROJECTION_ORTHOGRAPHIC) {
        Vector3 forward = vector_normalize(vector_subtract(camera->look_at, camera->position));
        Vector3 to_pivot = vector_subtract(pivot, camera->position);
        Vector3 across = vector_subtract(to_pivot, vector_scale(forward, vector_dot(to_pivot, forward)));
        camera->half_tangent *= factor;
        camera_move(camera, vector_scale(across, 1 - factor));
        return;
    }
    camera_move(camera, vector_scale(vector_subtract(pivot, camera->position), 1 - factor));
}

void camera_fly(Camera *camera, double forward, double right, double up)
{
    CameraBasis basis = camera_basis(camera, 1, 1);
    Vector3 sideways = vector_add(vector_scale(vector_normalize(basis.right), right),
                                  vector_scale(vector_normalize(basis.up), up));
    camera_move(camera, vector_add(vector_scale(basis.forward, forward), sideways));
}

void camera_look_at(Camera *camera, Vector3 point)
{
    if (!vector_is_zero(vector_subtract(point, camera->position))) camera->look_at = point;
}
