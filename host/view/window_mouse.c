// Moves the camera by the mouse, and by the keys that fly while it looks around.
#include "host/view/window_state.h"

#include "host/base/clock.h"
#include <string.h>

static const double WHEEL_FACTOR = 0.9; // of the distance, per notch
static const double FLY_SPEED = 1;      // distances to the point looked at, per second

void position_set(const Window *window, double position[2], int x, int y)
{
    int width, height;
    SDL_GetWindowSize(window->screen.window, &width, &height);
    position[0] = x * (double)window->wanted.size.width / width;
    position[1] = y * (double)window->wanted.size.height / height;
}

static double target_distance(const Window *window)
{
    return vector_length(vector_subtract(window->wanted.camera.look_at, window->wanted.camera.position));
}

// Returns the distance of what a pixel shows, or 0 if the shown image lacks it or has another camera.
static double distance_known(const Window *window, const double at[2])
{
    const Frame *frame = &window->frame;
    bool is_inside = at[0] >= 0 && at[0] < frame->width && at[1] >= 0 && at[1] < frame->height;
    if (!frame->distances || !is_inside || frame->number != window->request || request_is_due(window))
        return 0;
    float distance = frame->distances[(size_t)at[1] * frame->width + (size_t)at[0]];
    return distance < INFINITY ? (double)distance : 0;
}

// Sets the pivot to the point seen in a pixel. If that is not known, uses the point that was last picked
// there, or one as far away as the point looked at.
static void pivot_pick(Window *window, const double at[2])
{
    double distance = distance_known(window, at);
    if (distance <= 0 && memcmp(at, window->mouse.pivot_at, sizeof window->mouse.pivot_at) == 0) return;
    if (distance <= 0) distance = target_distance(window);
    const CameraRay ray = camera_ray(&window->wanted.camera, window->wanted.size, at[0], at[1]);
    window->mouse.pivot = vector_add(ray.origin, vector_scale(ray.direction, distance));
    memcpy(window->mouse.pivot_at, at, sizeof window->mouse.pivot_at);
}

void drag_begin(Window *window, const SDL_MouseButtonEvent *event)
{
    position_set(window, window->mouse.at, event->x, event->y);
    if (event->button == SDL_BUTTON_LEFT && is_in_time_line(window, window->mouse.at)) {
        window->mouse.drag = DRAG_TIME;
        time_line_follow(window, window->mouse.at);
        return;
    }
    pivot_pick(window, window->mouse.at);
    if (event->button == SDL_BUTTON_LEFT && event->clicks == 2) {
        camera_look_at(&window->wanted.camera, window->mouse.pivot);
        return;
    }
    bool pans = event->button == SDL_BUTTON_MIDDLE || SDL_GetModState() & KMOD_SHIFT;
    window->mouse.drag = event->button == SDL_BUTTON_RIGHT ? DRAG_LOOK : pans ? DRAG_PAN : DRAG_ORBIT;
    window->mouse.pan_distance =
        vector_length(vector_subtract(window->mouse.pivot, window->wanted.camera.position));
    window->mouse.flown_seconds = clock_seconds();
}

void drag_move(Window *window, const SDL_MouseMotionEvent *event)
{
    if (window->mouse.drag == DRAG_NONE) return;
    double to[2];
    position_set(window, to, event->x, event->y);
    if (window->mouse.drag == DRAG_TIME) {
        time_line_follow(window, to);
        return;
    }
    double right = to[0] - window->mouse.at[0], down = to[1] - window->mouse.at[1];
    Camera *camera = &window->wanted.camera;
    if (window->mouse.drag == DRAG_ORBIT) {
        double angle = M_PI / window->wanted.size.height;
        camera_orbit(camera, window->mouse.pivot, -right * angle, -down * angle);
    } else if (window->mouse.drag == DRAG_PAN) {
        camera_pan(camera, window->wanted.size, window->mouse.pan_distance, window->mouse.at, to);
    } else {
        // what is seen ahead follows the mouse
        double tangent =
            camera->half_tangent * 2 /
            (camera->field_axis == FIELD_VERTICAL ? window->wanted.size.height : window->wanted.size.width);
        double angle = fmin(tangent, M_PI / window->wanted.size.height);
        camera_orbit(camera, camera->position, -right * angle, -down * angle);
    }
    memcpy(window->mouse.at, to, sizeof to);
}

void wheel_turn(Window *window, const SDL_MouseWheelEvent *event)
{
    int x, y;
    double at[2];
    SDL_GetMouseState(&x, &y);
    position_set(window, at, x, y);
    pivot_pick(window, at);
    camera_dolly(&window->wanted.camera, window->mouse.pivot, pow(WHEEL_FACTOR, (double)event->preciseY));
}

void fly(Window *window)
{
    double now = clock_seconds(), seconds = now - window->mouse.flown_seconds;
    window->mouse.flown_seconds = now;
    const Uint8 *keys = SDL_GetKeyboardState(NULL);
    int forward = keys[SDL_SCANCODE_W] - keys[SDL_SCANCODE_S];
    int right = keys[SDL_SCANCODE_D] - keys[SDL_SCANCODE_A];
    int up = keys[SDL_SCANCODE_E] - keys[SDL_SCANCODE_Q];
    if (forward == 0 && right == 0 && up == 0) return;
    double step = FLY_SPEED * target_distance(window) * seconds;
    camera_fly(&window->wanted.camera, forward * step, right * step, up * step);
}
