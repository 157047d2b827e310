#include "host/view/window.h"

#include "host/base/clock.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/view/camera_yaml.h"
#include "host/view/caption.h"
#include "host/view/keys.h"
#include <SDL.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define HELP_ROW(input, effect) {input, effect},
static const struct {
    const char *input, *effect;
} help_rows[] = {VIEW_KEY_LIST(HELP_ROW)};

static const double ARROW_ANGLE = 5 * M_PI / 180;
static const double WHEEL_FACTOR = 0.9; // of the distance, per notch
static const double FLY_SPEED = 1;      // distances to the point looked at, per second

// In milliseconds: how often interrupts are noticed, and the camera flies.
enum { WAIT_AT_REST = 100, WAIT_IN_FLIGHT = 4 };

typedef enum { DRAG_NONE, DRAG_ORBIT, DRAG_PAN, DRAG_LOOK } Drag;

typedef struct {
    const WindowOptions *options;
    SDL_Window *window;
    SDL_Renderer *target;
    SDL_Texture *texture; // the frame's pixels
    int texture_width, texture_height;
    Caption *caption;
    FrameLoop *frames;
    Uint32 frame_event;

    ImageSize size;             // in pixels, which a point of the window may have several of
    Camera camera, file_camera; // the view's, and the scene's own
    View view;
    Precision precision;
    bool camera_changed, image_changed;
    bool is_loaded; // the scene
    double open_seconds;
    unsigned request;
    Frame frame;

    Drag drag;
    double mouse[2], pan_distance; // in pixels
    Vector3 pivot;                 // the point that was last picked, and where
    double pivot_at[2];
    double flown_seconds; // the moment up to which the camera has flown

    char *message;   // at the bottom, until the next key
    double hover[2]; // the cursor, in pixels
    char *facts;     // of the pixel there; NULL: not shown, or not known yet
    bool shows_facts, facts_are_due, prints_facts;
    unsigned facts_request; // whose image they are of
    bool shows_help, shows_times, redraws, closes;
} Window;

static void frame_notify(void *context)
{
    Window *window = context;
    SDL_PushEvent(&(SDL_Event){.type = window->frame_event});
}

static const char *scene_name(const Window *window)
{
    const char *path = window->options->frames.scene_path, *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static void title_set(const Window *window)
{
    const uint32_t count = window->view == VIEW_COLOR ? window->options->frames.settings.sample_count : 1;
    Text title = {0};
    // ASCII: in the C locale SDL sets no other title
    text_appendf(&title, "%s, %s, %s, %ux%u", scene_name(window), view_names[window->view],
                 precision_names[window->precision], window->size.width, window->size.height);
    if (window->request == 0 || !window->frame.pixels)
        text_appendf(&title, ", preparing");
    else if (window->frame.samples < count)
        text_appendf(&title, ", %u of %u samples", window->frame.samples, count);
    else
        text_appendf(&title, ", %u %s", count, count == 1 ? "sample" : "samples");
    text_appendf(&title, " - glint (H: help)");
    SDL_SetWindowTitle(window->window, text_c(&title));
    text_free(&title);
}

static void message_show(Window *window, char *message)
{
    free(window->message);
    window->message = message;
    window->redraws = true;
}

// Pixels of a position in the window's points.
static void position_set(const Window *window, double position[2], int x, int y)
{
    int width, height;
    SDL_GetWindowSize(window->window, &width, &height);
    position[0] = x * (double)window->size.width / width;
    position[1] = y * (double)window->size.height / height;
}

static double target_distance(const Window *window)
{
    return vector_length(vector_subtract(window->camera.look_at, window->camera.position));
}

// The distance to what is seen in a pixel, where the shown image is of this camera and knows it; else 0.
static double distance_known(const Window *window, const double at[2])
{
    const Frame *frame = &window->frame;
    bool is_inside = at[0] >= 0 && at[0] < frame->width && at[1] >= 0 && at[1] < frame->height;
    bool is_current = frame->number == window->request && !window->camera_changed && !window->image_changed;
    if (!frame->distances || !is_inside || !is_current) return 0;
    float distance = frame->distances[(size_t)at[1] * frame->width + (size_t)at[0]];
    return distance < INFINITY ? (double)distance : 0;
}

// The point seen in a pixel: where that is not known, the point that was last picked there, or one as far
// away as the point looked at.
static void pivot_pick(Window *window, const double at[2])
{
    double distance = distance_known(window, at);
    if (distance <= 0 && memcmp(at, window->pivot_at, sizeof window->pivot_at) == 0) return;
    if (distance <= 0) distance = target_distance(window);
    Vector3 ray = camera_ray(&window->camera, window->size, at[0], at[1]);
    window->pivot = vector_add(window->camera.position, vector_scale(ray, distance));
    memcpy(window->pivot_at, at, sizeof window->pivot_at);
}

static void drag_begin(Window *window, const SDL_MouseButtonEvent *event)
{
    position_set(window, window->mouse, event->x, event->y);
    pivot_pick(window, window->mouse);
    if (event->button == SDL_BUTTON_LEFT && event->clicks == 2) {
        camera_look_at(&window->camera, window->pivot);
        window->camera_changed = true;
        return;
    }
    bool pans = event->button == SDL_BUTTON_MIDDLE || SDL_GetModState() & KMOD_SHIFT;
    window->drag = event->button == SDL_BUTTON_RIGHT ? DRAG_LOOK : pans ? DRAG_PAN : DRAG_ORBIT;
    window->pan_distance = vector_length(vector_subtract(window->pivot, window->camera.position));
    window->flown_seconds = clock_seconds();
}

static void drag_move(Window *window, const SDL_MouseMotionEvent *event)
{
    if (window->drag == DRAG_NONE) return;
    double to[2];
    position_set(window, to, event->x, event->y);
    double right = to[0] - window->mouse[0], down = to[1] - window->mouse[1];
    Camera *camera = &window->camera;
    if (window->drag == DRAG_ORBIT) {
        double angle = M_PI / window->size.height;
        camera_orbit(camera, window->pivot, -right * angle, -down * angle);
    } else if (window->drag == DRAG_PAN) {
        camera_pan(camera, window->size, window->pan_distance, window->mouse, to);
    } else {
        // what is ahead follows the mouse's way
        double tangent = camera->half_tangent * 2 /
                         (camera->field_axis == FIELD_VERTICAL ? window->size.height : window->size.width);
        double angle = fmin(tangent, M_PI / window->size.height);
        camera_orbit(camera, camera->position, -right * angle, -down * angle);
    }
    memcpy(window->mouse, to, sizeof to);
    window->camera_changed = true;
}

static void wheel_turn(Window *window, const SDL_MouseWheelEvent *event)
{
    double at[2];
    position_set(window, at, event->mouseX, event->mouseY);
    pivot_pick(window, at);
    camera_dolly(&window->camera, window->pivot, pow(WHEEL_FACTOR, event->y));
    window->camera_changed = true;
}

static void fly(Window *window)
{
    double now = clock_seconds(), seconds = now - window->flown_seconds;
    window->flown_seconds = now;
    const Uint8 *keys = SDL_GetKeyboardState(NULL);
    int forward = keys[SDL_SCANCODE_W] - keys[SDL_SCANCODE_S];
    int right = keys[SDL_SCANCODE_D] - keys[SDL_SCANCODE_A];
    int up = keys[SDL_SCANCODE_E] - keys[SDL_SCANCODE_Q];
    if (forward == 0 && right == 0 && up == 0) return;
    double step = FLY_SPEED * target_distance(window) * seconds;
    camera_fly(&window->camera, forward * step, right * step, up * step);
    window->camera_changed = true;
}

static void arrow_turn(Window *window, double yaw, double pitch)
{
    camera_orbit(&window->camera, window->camera.look_at, yaw * ARROW_ANGLE, pitch * ARROW_ANGLE);
    window->camera_changed = true;
}

static void camera_write(Window *window)
{
    MessageList messages = {0};
    char *text = NULL;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    if (!stream) return;
    if (frame_loop_write_camera(window->frames, &window->camera, &messages)) {
        window->file_camera = window->camera;
        fprintf(stream, "camera written to %s\n", window->options->frames.scene_path);
    }
    message_list_print(&messages, stream);
    message_list_free(&messages);
    fclose(stream);
    fputs(text, stderr);
    message_show(window, text);
}

static void camera_print(Window *window)
{
    Text yaml = {0};
    camera_write_yaml(&yaml, &window->camera, (double)window->size.width / window->size.height);
    fputs(text_c(&yaml), stdout);
    fflush(stdout);
    message_show(window, yaml.items);
    if (window->options->writes_camera) camera_write(window);
}

static void request_send(Window *window)
{
    if (!window->is_loaded || (!window->camera_changed && !window->image_changed)) return;
    bool is_moving = window->request > 0;
    const FrameRequest request = {window->camera, window->size, window->view, window->precision, is_moving};
    window->request = frame_loop_request(window->frames, &request);
    window->camera_changed = window->image_changed = false;
}

// Saves as SCENE-1.png, or with the first number that is free.
static void image_save(Window *window, const char *ending)
{
    const char *name = scene_name(window), *dot = strrchr(name, '.');
    Text path = {0};
    int number = 0;
    do {
        text_free(&path);
        text_appendf(&path, "%.*s-%d.%s", dot ? (int)(dot - name) : INT_MAX, name, ++number, ending);
    } while (access(text_c(&path), F_OK) == 0);
    request_send(window); // what is saved is what was asked for before
    frame_loop_save(window->frames, text_c(&path));
    text_free(&path);
}

static void facts_toggle(Window *window)
{
    int x, y;
    SDL_GetMouseState(&x, &y);
    position_set(window, window->hover, x, y);
    window->shows_facts = window->facts_are_due = window->prints_facts = !window->shows_facts;
    free(window->facts);
    window->facts = NULL;
    window->redraws = true;
}

// Asks for the facts of the pixel under the cursor, if they are shown, and takes them.
static void facts_exchange(Window *window)
{
    const double *at = window->hover;
    const bool is_inside =
        at[0] >= 0 && at[1] >= 0 && at[0] < window->size.width && at[1] < window->size.height;
    if (window->shows_facts && window->facts_are_due && is_inside && window->request > 0) {
        frame_loop_probe(window->frames, (uint32_t)at[0], (uint32_t)at[1]);
        window->facts_are_due = false;
    }
    char *facts = frame_loop_take_facts(window->frames);
    if (!facts) return;
    if (window->prints_facts) fputs(facts, stdout);
    fflush(stdout);
    window->prints_facts = false;
    free(window->facts);
    window->facts = facts;
    window->redraws = true;
}

static void full_screen_toggle(const Window *window)
{
    bool is_full = SDL_GetWindowFlags(window->window) & SDL_WINDOW_FULLSCREEN_DESKTOP;
    SDL_SetWindowFullscreen(window->window, is_full ? 0 : SDL_WINDOW_FULLSCREEN_DESKTOP);
}

static void key_press(Window *window, const SDL_KeyboardEvent *event)
{
    if (window->drag == DRAG_LOOK && event->keysym.sym != SDLK_ESCAPE) return; // they fly
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
    case SDLK_r:
        window->camera = window->file_camera;
        window->camera_changed = true;
        break;
    case SDLK_c:
        camera_print(window);
        break;
    case SDLK_s:
        if (window->view == VIEW_COLOR)
            image_save(window, event->keysym.mod & KMOD_SHIFT ? "exr" : "png");
        else
            message_show(window, memory_copy_text("only the color is saved (V)"));
        break;
    case SDLK_f:
        full_screen_toggle(window);
        break;
    case SDLK_v: {
        unsigned step = event->keysym.mod & KMOD_SHIFT ? VIEW_COUNT - 1 : 1;
        window->view = (View)((window->view + step) % VIEW_COUNT);
        window->image_changed = true;
        break;
    }
    case SDLK_1:
    case SDLK_2:
    case SDLK_3:
    case SDLK_4:
        window->precision = (Precision)(event->keysym.sym - SDLK_1);
        window->image_changed = true;
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

static void size_read(Window *window)
{
    int width = 1, height = 1;
    SDL_GetRendererOutputSize(window->target, &width, &height);
    if (width < 1 || height < 1) return;
    window->size = (ImageSize){(uint32_t)width, (uint32_t)height};
    window->image_changed = true;
}

// Events about a scene and its camera, which are not there until the scene is loaded.
static bool needs_scene(const SDL_Event *event)
{
    switch (event->type) {
    case SDL_MOUSEBUTTONDOWN:
    case SDL_MOUSEMOTION:
    case SDL_MOUSEWHEEL:
        return true;
    case SDL_KEYDOWN:
        return event->key.keysym.sym != SDLK_ESCAPE && event->key.keysym.sym != SDLK_f &&
               event->key.keysym.sym != SDLK_h;
    default:
        return false;
    }
}

static void event_handle(Window *window, const SDL_Event *event)
{
    if (!window->is_loaded && needs_scene(event)) return;
    switch (event->type) {
    case SDL_QUIT:
        window->closes = true;
        break;
    case SDL_WINDOWEVENT:
        if (event->window.event == SDL_WINDOWEVENT_SIZE_CHANGED) size_read(window);
        window->redraws = true;
        break;
    case SDL_MOUSEBUTTONDOWN:
        drag_begin(window, &event->button);
        break;
    case SDL_MOUSEBUTTONUP:
        window->drag = DRAG_NONE;
        break;
    case SDL_MOUSEMOTION:
        position_set(window, window->hover, event->motion.x, event->motion.y);
        window->facts_are_due = true;
        drag_move(window, &event->motion);
        break;
    case SDL_MOUSEWHEEL:
        wheel_turn(window, &event->wheel);
        break;
    case SDL_KEYDOWN:
        key_press(window, &event->key);
        break;
    default:
        break;
    }
}

static void frame_show(Window *window)
{
    const Frame *frame = &window->frame;
    int width = (int)frame->width, height = (int)frame->height;
    if (!window->texture || window->texture_width != width || window->texture_height != height) {
        if (window->texture) SDL_DestroyTexture(window->texture);
        window->texture = SDL_CreateTexture(window->target, SDL_PIXELFORMAT_RGB24,
                                            SDL_TEXTUREACCESS_STREAMING, width, height);
        window->texture_width = width;
        window->texture_height = height;
    }
    if (window->texture) SDL_UpdateTexture(window->texture, NULL, frame->pixels, 3 * width);
    window->redraws = true;
}

static void help_draw(const Window *window)
{
    Text help = {0};
    for (size_t i = 0; i < sizeof help_rows / sizeof *help_rows; i++)
        text_appendf(&help, "%s%-12s  %s", i > 0 ? "\n" : "", help_rows[i].input, help_rows[i].effect);
    caption_draw(window->caption, CAPTION_TOP, text_c(&help));
    text_free(&help);
}

// The times, and what the pixel under the cursor sees.
static void facts_draw(const Window *window)
{
    Text text = {0};
    if (window->shows_times && window->frame.summary) text_appendf(&text, "%s", window->frame.summary);
    if (window->shows_facts && window->facts)
        text_appendf(&text, "%s%s", text.count > 0 ? "\n" : "", window->facts);
    caption_draw(window->caption, CAPTION_TOP, text_c(&text));
    text_free(&text);
}

static void waiting_draw(const Window *window)
{
    Text text = {0};
    text_appendf(&text, "%s: %.0f s", window->is_loaded ? "preparing scene and kernels" : "loading the scene",
                 clock_seconds() - window->open_seconds);
    caption_draw(window->caption, CAPTION_BOTTOM, text_c(&text));
    text_free(&text);
}

static void draw(Window *window)
{
    SDL_SetRenderDrawColor(window->target, 0, 0, 0, 255);
    SDL_RenderClear(window->target);
    if (window->texture) SDL_RenderCopy(window->target, window->texture, NULL, NULL);
    if (window->shows_help)
        help_draw(window);
    else
        facts_draw(window);
    if (window->message)
        caption_draw(window->caption, CAPTION_BOTTOM, window->message);
    else if (!window->texture)
        waiting_draw(window);
    SDL_RenderPresent(window->target);
    title_set(window);
    window->redraws = false;
}

static void message_take(Window *window)
{
    char *message = frame_loop_take_message(window->frames);
    if (!message) return;
    size_t length = strlen(message);
    if (length > 0) fprintf(stderr, "%s%s", message, message[length - 1] == '\n' ? "" : "\n");
    message_show(window, message);
}

// The window's size in points, at most what the display has room for.
static ImageSize size_fit(ImageSize size)
{
    SDL_Rect room;
    if (SDL_GetDisplayUsableBounds(0, &room) != 0 || room.w < 1 || room.h < 1) return size;
    double factor = fmin(1, fmin((double)room.w / size.width, (double)room.h / size.height));
    return (ImageSize){(uint32_t)fmax(1, size.width * factor), (uint32_t)fmax(1, size.height * factor)};
}

// The size is the scene's own unless another was asked for.
static void scene_receive(Window *window)
{
    ImageSize size;
    window->is_loaded = frame_loop_scene(window->frames, &size) == SCENE_LOADED;
    if (!window->is_loaded || window->options->size.width > 0) return;
    size = size_fit(size);
    SDL_SetWindowSize(window->window, (int)size.width, (int)size.height);
    size_read(window);
}

static bool is_refused(const Window *window)
{
    ImageSize size;
    return frame_loop_scene(window->frames, &size) == SCENE_REFUSED;
}

static void work_exchange(Window *window)
{
    if (!window->is_loaded) scene_receive(window);
    if (frame_loop_take_camera(window->frames, &window->file_camera)) {
        window->camera = window->file_camera;
        window->camera_changed = true;
    }
    request_send(window);
    if (frame_loop_take(window->frames, &window->frame)) {
        window->facts_are_due |= window->frame.number != window->facts_request;
        window->facts_request = window->frame.number;
        frame_show(window);
    }
    facts_exchange(window);
    message_take(window);
}

static WindowEnd events_run(Window *window)
{
    while (!window->closes) {
        SDL_Event event;
        int wait = window->drag == DRAG_LOOK ? WAIT_IN_FLIGHT : WAIT_AT_REST;
        for (int had = SDL_WaitEventTimeout(&event, wait); had; had = SDL_PollEvent(&event))
            event_handle(window, &event);
        if (window->options->stop()) return WINDOW_STOPPED;
        if (window->drag == DRAG_LOOK) fly(window);
        work_exchange(window);
        if (!window->is_loaded && is_refused(window)) {
            message_take(window); // it may have come since the last look, together with the refusal
            return WINDOW_REFUSED;
        }
        if (window->redraws || !window->texture) draw(window);
    }
    return WINDOW_CLOSED;
}

static WindowEnd window_fault(const char *what)
{
    fprintf(stderr, "glint: %s: %s\n", what, SDL_GetError());
    return WINDOW_ABSENT;
}

static void window_close(Window *window)
{
    if (window->window) SDL_HideWindow(window->window); // a kernel may still be built for a while
    if (window->frames) frame_loop_close(window->frames);
    frame_free(&window->frame);
    free(window->message);
    free(window->facts);
    caption_close(window->caption);
    if (window->texture) SDL_DestroyTexture(window->texture);
    if (window->target) SDL_DestroyRenderer(window->target);
    if (window->window) SDL_DestroyWindow(window->window);
    SDL_Quit();
}

// Without a display SDL takes a driver that shows nothing.
static bool display_exists(void)
{
    const char *driver = SDL_GetCurrentVideoDriver(), *wanted = getenv("SDL_VIDEODRIVER");
    return (wanted && wanted[0]) || (strcmp(driver, "offscreen") != 0 && strcmp(driver, "dummy") != 0);
}

static bool window_open(Window *window)
{
    const WindowOptions *options = window->options;
    const ImageSize usual = {1280, 720};
    ImageSize size = size_fit(options->size.width > 0 ? options->size : usual);
    SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "linear");
    window->window =
        SDL_CreateWindow(scene_name(window), SDL_WINDOWPOS_UNDEFINED, SDL_WINDOWPOS_UNDEFINED,
                         (int)size.width, (int)size.height, SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI);
    if (window->window) window->target = SDL_CreateRenderer(window->window, -1, SDL_RENDERER_PRESENTVSYNC);
    if (!window->target) return false;
    size_read(window);
    window->caption = caption_open(window->target, (float)window->size.width / (float)size.width);
    window->precision = options->frames.settings.precision;
    window->frame_event = SDL_RegisterEvents(1);
    FrameLoopOptions frames = options->frames;
    frames.notify = frame_notify;
    frames.notify_context = window;
    window->frames = frame_loop_open(&frames);
    return true;
}

WindowEnd window_run(const WindowOptions *options)
{
    if (SDL_Init(SDL_INIT_VIDEO) != 0) return window_fault("no window can be opened");
    Window window = {
        .options = options, .open_seconds = clock_seconds(), .redraws = true, .pivot_at = {-1, -1}};
    WindowEnd end = WINDOW_ABSENT;
    if (!display_exists()) {
        fputs("glint: no window can be opened: there is no display; is DISPLAY or WAYLAND_DISPLAY set?\n",
              stderr);
        SDL_Quit();
    } else if (!window_open(&window)) {
        window_fault("no window can be opened");
        window_close(&window);
    } else {
        end = events_run(&window);
        window_close(&window);
    }
    return end;
}
