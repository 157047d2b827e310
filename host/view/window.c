#include "host/view/window_state.h"

#include "host/base/file.h"
#include <stdlib.h>
#include <string.h>

// Milliseconds between checks for interrupts, and between steps while the camera flies or frames play.
enum { WAIT_AT_REST = 100, WAIT_IN_FLIGHT = 4 };

static void frame_notify(void *context)
{
    Window *window = context;
    SDL_PushEvent(&(SDL_Event){.type = window->screen.frame_event});
}

const char *scene_name(const Window *window)
{
    return file_base_name(window->options->frames.scene_path);
}

void message_show(Window *window, char *message)
{
    free(window->message);
    window->message = message;
    window->redraws = true;
}

// Returns whether two requests differ in more than the camera and the animation's frame.
static bool is_other_image(const FrameRequest *a, const FrameRequest *b)
{
    return a->size.width != b->size.width || a->size.height != b->size.height || a->view != b->view ||
           a->precision != b->precision;
}

bool request_is_due(const Window *window)
{
    const FrameRequest *wanted = &window->wanted, *sent = &window->sent;
    return window->request == 0 || window->resends || wanted->scene_frame != sent->scene_frame ||
           is_other_image(wanted, sent) || !cameras_equal(&wanted->camera, &sent->camera);
}

void request_send(Window *window)
{
    FrameRequest *wanted = &window->wanted;
    if (window->scene.state != SCENE_LOADED || !request_is_due(window)) return;
    wanted->follows_scene = cameras_equal(&wanted->camera, &window->scene.camera);
    wanted->is_moving = window->request > 0;
    window->request = frame_loop_request(window->frames, wanted);
    if (is_other_image(wanted, &window->sent)) window->image_request = window->request;
    window->sent = *wanted;
    window->resends = false;
}

// Asks for the facts of the pixel under the cursor, if they are shown.
static void facts_request(Window *window)
{
    const double *at = window->facts.at;
    const ImageSize size = window->wanted.size;
    const bool is_inside = at[0] >= 0 && at[1] >= 0 && at[0] < size.width && at[1] < size.height;
    if (window->facts.are_shown && window->facts.needs_probe && is_inside && window->request > 0) {
        frame_loop_probe(window->frames, (uint32_t)at[0], (uint32_t)at[1]);
        window->facts.needs_probe = false;
    }
}

static void facts_show(Window *window, char *facts)
{
    if (window->facts.prints_next) fputs(facts, stdout);
    fflush(stdout);
    window->facts.prints_next = false;
    free(window->facts.text);
    window->facts.text = facts;
    window->redraws = true;
}

// Reads the size. Called repeatedly, since at the event of a new size SDL 2 on SDL 3 still has the old one.
static void size_read(Window *window)
{
    int width = 1, height = 1;
    SDL_GetRendererOutputSize(window->screen.renderer, &width, &height);
    if (width > 0 && height > 0) window->wanted.size = (ImageSize){(uint32_t)width, (uint32_t)height};
}

// Returns whether an event is about a scene and its camera, which do not exist until the scene is loaded.
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
    if (window->scene.state != SCENE_LOADED && needs_scene(event)) return;
    switch (event->type) {
    case SDL_QUIT:
        window->closes = true;
        break;
    case SDL_WINDOWEVENT:
        window->redraws = true;
        break;
    case SDL_MOUSEBUTTONDOWN:
        drag_begin(window, &event->button);
        break;
    case SDL_MOUSEBUTTONUP:
        window->mouse.drag = DRAG_NONE;
        break;
    case SDL_MOUSEMOTION:
        position_set(window, window->facts.at, event->motion.x, event->motion.y);
        window->facts.needs_probe = true;
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

static void message_receive(Window *window, char *message)
{
    size_t length = strlen(message);
    if (length > 0) fprintf(stderr, "%s%s", message, message[length - 1] == '\n' ? "" : "\n");
    if (length > 0)
        window->play.is_running = window->play.key_is_due = false; // each frame might bring another
    message_show(window, message);
}

// Returns the window's size in points, at most what fits the display.
static ImageSize window_size_fit(ImageSize size)
{
    SDL_Rect room;
    if (SDL_GetDisplayUsableBounds(0, &room) != 0 || room.w < 1 || room.h < 1) return size;
    double factor = fmin(1, fmin((double)room.w / size.width, (double)room.h / size.height));
    return (ImageSize){(uint32_t)fmax(1, size.width * factor), (uint32_t)fmax(1, size.height * factor)};
}

// Gives the window the size of the first scene's image, unless another was asked for.
static void scene_size_set(Window *window)
{
    if (window->options->size.width > 0) return;
    const ImageSize size = window_size_fit(window->scene.size);
    SDL_SetWindowSize(window->screen.window, (int)size.width, (int)size.height);
    size_read(window);
}

static void scene_receive(Window *window, const SceneUpdate *scene)
{
    const SceneUpdate old = window->scene;
    FrameRequest *wanted = &window->wanted;
    const bool follows = cameras_equal(&wanted->camera, &old.camera);
    window->scene = *scene;
    if (scene->state == SCENE_REFUSED) return;
    if (old.state == SCENE_LOADING) scene_size_set(window);
    if (follows || scene->has_new_camera) wanted->camera = scene->camera;
    // the loop moves the camera of a request that follows the scene
    if (window->sent.follows_scene && !scene->has_new_camera) window->sent.camera = scene->camera;
    window->play.is_running &= has_time_line(window);
    if (wanted->scene_frame > 0 && wanted->scene_frame >= scene->frame_count)
        scene_frame_show(window, (int64_t)scene->frame_count - 1);
    if (scene->frame_rate != old.frame_rate)
        scene_frame_show(window, wanted->scene_frame); // at the new rate from here
}

static void work_exchange(Window *window)
{
    SceneUpdate scene;
    const LoopNews news = frame_loop_acquire(window->frames, &window->frame, &scene);
    if (news.has_scene) scene_receive(window, &scene);
    key_record(window);
    request_send(window);
    if (news.has_frame) {
        window->facts.needs_probe |= window->frame.number != window->facts.request;
        window->facts.request = window->frame.number;
        frame_show(window);
    }
    facts_request(window);
    if (news.facts) facts_show(window, news.facts);
    if (news.message) message_receive(window, news.message);
    stage_show(window);
}

static WindowEnd events_run(Window *window)
{
    while (!window->closes) {
        SDL_Event event;
        int wait = window->mouse.drag == DRAG_LOOK || window->play.is_running ? WAIT_IN_FLIGHT : WAIT_AT_REST;
        for (int had = SDL_WaitEventTimeout(&event, wait); had; had = SDL_PollEvent(&event))
            event_handle(window, &event);
        if (window->options->stop(window->options->stop_context)) return WINDOW_STOPPED;
        size_read(window);
        if (window->mouse.drag == DRAG_LOOK) fly(window);
        if (window->play.is_running) play(window);
        work_exchange(window);
        if (window->scene.state == SCENE_REFUSED) return WINDOW_REFUSED;
        if (window->redraws) window_draw(window);
    }
    return WINDOW_CLOSED;
}

static void window_close(Window *window)
{
    const Screen *screen = &window->screen;
    if (screen->window) SDL_HideWindow(screen->window); // a kernel may still be built for a while
    if (window->frames) frame_loop_close(window->frames);
    frame_free(&window->frame);
    free(window->message);
    free(window->facts.text);
    text_free(&window->stage);
    caption_close(screen->caption);
    if (screen->texture) SDL_DestroyTexture(screen->texture);
    if (screen->renderer) SDL_DestroyRenderer(screen->renderer);
    // X11's window stays until the process ends. The loop's last event to it may still be on its way, on a
    // separate connection, and Xlib ends the process with status 1 if it finds no window.
    const char *driver = SDL_GetCurrentVideoDriver();
    if (driver && strcmp(driver, "x11") == 0) return;
    if (screen->window) SDL_DestroyWindow(screen->window);
    SDL_Quit();
}

static bool is_set(const char *variable)
{
    const char *value = getenv(variable);
    return value && value[0];
}

// Returns whether a display exists. Without one, SDL 2 uses a driver that shows nothing, SDL 3 none.
static bool display_exists(void)
{
    const char *driver = SDL_GetCurrentVideoDriver();
    if (is_set("SDL_VIDEODRIVER")) return true;
    if (!driver) return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
    return strcmp(driver, "offscreen") != 0 && strcmp(driver, "dummy") != 0;
}

// Returns the pixels per point of the window as the scale of text. If that is 1, as on X11, the scale is
// larger on a display of many pixels per inch.
static float text_scale(const Window *window, ImageSize size)
{
    const float pixels = (float)window->wanted.size.width / (float)size.width, usual_dpi = 96;
    float dpi;
    if (pixels > 1 ||
        SDL_GetDisplayDPI(SDL_GetWindowDisplayIndex(window->screen.window), &dpi, NULL, NULL) != 0)
        return pixels;
    return SDL_clamp(dpi / usual_dpi, 1.0F, 3.0F); // displays may misreport their size
}

static bool window_open(Window *window)
{
    const WindowOptions *options = window->options;
    const ImageSize usual = {1280, 720};
    ImageSize size = window_size_fit(options->size.width > 0 ? options->size : usual);
    SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "linear");
    // where SDL draws in software, OpenGL is software too, and slower; SDL would open the window a second
    // time for it
    SDL_SetHintWithPriority(SDL_HINT_FRAMEBUFFER_ACCELERATION, "0", SDL_HINT_DEFAULT);
    Screen *screen = &window->screen;
    screen->window =
        SDL_CreateWindow(scene_name(window), SDL_WINDOWPOS_UNDEFINED, SDL_WINDOWPOS_UNDEFINED,
                         (int)size.width, (int)size.height, SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI);
    if (screen->window) screen->renderer = SDL_CreateRenderer(screen->window, -1, SDL_RENDERER_PRESENTVSYNC);
    if (!screen->renderer) return false;
    size_read(window);
    screen->caption = caption_open(screen->renderer, text_scale(window, size));
    window->wanted.precision = options->frames.settings.precision;
    screen->frame_event = SDL_RegisterEvents(1);
    FrameLoopOptions frames = options->frames;
    frames.notify = frame_notify;
    frames.notify_context = window;
    window->frames = frame_loop_open(&frames);
    return true;
}

WindowEnd window_run(const WindowOptions *options)
{
    const bool has_video = SDL_Init(SDL_INIT_VIDEO) == 0;
    Window window = {.options = options, .redraws = true, .mouse.pivot_at = {-1, -1}};
    WindowEnd end = WINDOW_ABSENT;
    if (!display_exists()) {
        fputs("glint: no window can be opened: there is no display; is DISPLAY or WAYLAND_DISPLAY set?\n",
              stderr);
        SDL_Quit();
    } else if (!has_video || !window_open(&window)) {
        fprintf(stderr, "glint: no window can be opened: %s\n", SDL_GetError());
        window_close(&window);
    } else {
        end = events_run(&window);
        window_close(&window);
    }
    return end;
}
