// Handles the keys.
#include "host/view/window_state.h"

#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/view/camera_yaml.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double ARROW_ANGLE = 5 * M_PI / 180;

static void arrow_turn(Window *window, double yaw, double pitch)
{
    Camera *camera = &window->wanted.camera;
    camera_orbit(camera, camera->look_at, yaw * ARROW_ANGLE, pitch * ARROW_ANGLE);
}

// Writes the camera. With a `frame`, writes keys there.
static void camera_write(Window *window, const uint32_t *frame)
{
    OwnedMessageList messages = {0};
    Text text = {0};
    if (frame_loop_write_camera(window->frames, &window->wanted.camera, frame, &messages)) {
        window->scene.camera = window->wanted.camera;
        text_appendf(&text, "camera written to %s", camera_path(&window->options->frames));
        if (frame) text_appendf(&text, " at frame %u", *frame);
        text_appendf(&text, "\n");
    }
    OWNED char *reasons = message_list_text(&messages);
    if (reasons) text_appendf(&text, "%s", reasons);
    fputs(text_c(&text), stderr);
    message_show(window, text.items);
}

static void camera_print(Window *window)
{
    Text yaml = {0};
    const ImageSize size = window->wanted.size;
    camera_write_yaml(&yaml, &window->wanted.camera, (double)size.width / size.height);
    fputs(text_c(&yaml), stdout);
    fflush(stdout);
    message_show(window, yaml.items);
    if (window->options->frames.writes_camera) camera_write(window, NULL);
}

static void key_ask(Window *window)
{
    if (!window->options->frames.writes_camera)
        message_show(window,
                     memory_copy_text("K writes to the scene's file; start glint view with --write-camera"));
    else if (!has_time_line(window))
        message_show(window, memory_copy_text("K needs an animation: a scene with 'frames' above 1"));
    else
        window->play.key_is_due = true;
    window->play.is_running = false;
}

void key_record(Window *window)
{
    if (!window->play.key_is_due || window->scene.frame != window->wanted.scene_frame) return;
    window->play.key_is_due = false;
    camera_write(window, &window->wanted.scene_frame);
}

// Asks for the image to be saved as SCENE-1.png, or with the first number that is free. An animation pauses,
// since only a complete image is saved.
static void save_ask(Window *window, const char *ending)
{
    if (window->wanted.view != VIEW_COLOR) {
        message_show(window, memory_copy_text("only the color view is saved: V changes the view"));
        return;
    }
    OWNED char *stem = file_stem(window->options->frames.scene_path), *path = NULL;
    int number = 0;
    do {
        free(path);
        path = text_format("%s-%d.%s", stem, ++number, ending);
    } while (access(path, F_OK) == 0);
    window->play.is_running = false;
    request_send(window); // so that the newest request's image is saved
    frame_loop_save(window->frames, path);
}

static void facts_toggle(Window *window)
{
    int x, y;
    SDL_GetMouseState(&x, &y);
    position_set(window, window->facts.at, x, y);
    window->facts.are_shown = window->facts.needs_probe = window->facts.prints_next =
        !window->facts.are_shown;
    free(window->facts.text);
    window->facts.text = NULL;
    window->redraws = true;
}

static void full_screen_toggle(const Window *window)
{
    bool is_full = SDL_GetWindowFlags(window->screen.window) & SDL_WINDOW_FULLSCREEN_DESKTOP;
    SDL_SetWindowFullscreen(window->screen.window, is_full ? 0 : SDL_WINDOW_FULLSCREEN_DESKTOP);
}

void key_press(Window *window, const SDL_KeyboardEvent *event)
{
    if (window->mouse.drag == DRAG_LOOK && event->keysym.sym != SDLK_ESCAPE) return; // keys fly the camera
    const bool has_shift = event->keysym.mod & KMOD_SHIFT;
    FrameRequest *wanted = &window->wanted;
    message_show(window, NULL);
    switch (event->keysym.sym) {
    case SDLK_LEFT:
        arrow_turn(window, -1, 0);
        break;
    case SDLK_RIGHT:
        arrow_turn(window, 1, 0);
        break;
    case SDLK_UP:
        arrow_turn(window, 0, -1);
        break;
    case SDLK_DOWN:
        arrow_turn(window, 0, 1);
        break;
    case SDLK_SPACE:
        if (event->repeat == 0) play_toggle(window);
        break;
    case SDLK_COMMA:
    case SDLK_PERIOD:
        window->play.is_running = false;
        scene_frame_show(window, wanted->scene_frame + (event->keysym.sym == SDLK_PERIOD ? INT64_C(1) : -1));
        break;
    case SDLK_r:
        wanted->camera = window->scene.camera;
        window->resends = true; // tries again after a failure
        break;
    case SDLK_c:
        camera_print(window);
        break;
    case SDLK_k:
        key_ask(window);
        break;
    case SDLK_s:
        save_ask(window, has_shift ? "exr" : "png");
        break;
    case SDLK_f:
        full_screen_toggle(window);
        break;
    case SDLK_v:
        wanted->view = (wanted->view + (has_shift ? VIEW_COUNT - 1 : 1)) % VIEW_COUNT;
        break;
    case SDLK_1:
    case SDLK_2:
    case SDLK_3:
    case SDLK_4:
        wanted->precision = (Precision)(event->keysym.sym - SDLK_1);
        window->resends = true; // repeats the reason if the device lacks the precision
        break;
    case SDLK_t:
        window->shows_times = !window->shows_times;
        break;
    case SDLK_i:
        facts_toggle(window);
        break;
    case SDLK_h:
        window->shows_help = !window->shows_help;
        break;
    case SDLK_ESCAPE:
        window->closes = true;
        break;
    default:
        break;
    }
}
