#include "host/view/frame_loop.h"

#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/numbers.h"
#include "host/base/output.h"
#include "host/view/camera_file.h"
#include "host/view/pixel_facts.h"
#include "host/view/preview.h"
#include "host/view/watch.h"
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { REST_NANOSECONDS = 150 * 1000 * 1000 };

struct FrameLoop {
    FrameLoopOptions options;
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t changed;

    // under the mutex
    FrameRequest request;
    unsigned request_number;
    bool quits;
    bool reloads; // the scene's files have changed, or have not been read
    SceneState scene_state;
    ImageSize scene_size;
    char *save_path, *message;
    Frame ready;
    bool has_ready;
    Camera file_camera;
    bool has_camera;
    uint32_t probe[2]; // a pixel
    bool has_probe;
    char *facts;  // of the last one
    Text written; // into the scene's file, and not yet noticed

    // the thread's own
    Scene scene;      // with the request's camera
    bool is_mistaken; // its file, as it is now
    Watch *watch;
    RenderSettings settings;
    Compute compute;
    Renderer *renderer;  // NULL: not open, or failed
    Renderer *reference; // in double, of the view of errors; NULL: not open
    FrameRequest current;
    unsigned current_number;
    bool has_preview; // its first frame, coarse or of arrays that another eye saw
    uint32_t divisor; // of that
    double move_seconds, render_start;
    double expected_move; // to another eye, in seconds: of the scene as it is, little by little forgotten
    Film film;            // of the image or the coarse frame: sums of samples, at the end their mean
    Frame frame;
    Preview preview;
};

// Renderers ask one function without context, so there is one loop per process.
static atomic_bool has_news;     // a request that was not yet read, or the end
static atomic_bool first_is_due; // a frame that must appear, whatever is asked for meanwhile
static atomic_bool ends;

static bool render_stops(void)
{
    return atomic_load(&ends) || (atomic_load(&has_news) && !atomic_load(&first_is_due));
}

void frame_free(Frame *frame)
{
    free(frame->pixels);
    free(frame->summary);
    free(frame->distances);
    *frame = (Frame){0};
}

// Takes the message. "" removes the last one; others are added to those that were not yet taken.
static void message_publish(FrameLoop *loop, char *message)
{
    pthread_mutex_lock(&loop->mutex);
    char *waiting = loop->message;
    loop->message = message;
    if (waiting && *waiting && *message) {
        if (asprintf(&loop->message, "%s%s", waiting, message) < 0) fault("out of memory");
        free(message);
    }
    free(waiting);
    pthread_mutex_unlock(&loop->mutex);
    loop->options.notify(loop->options.notify_context);
}

// Takes the messages.
static void messages_publish(FrameLoop *loop, MessageList *messages)
{
    char *text = NULL;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    if (stream) {
        message_list_print(messages, stream);
        fclose(stream);
    }
    message_list_free(messages);
    if (text && size > 0)
        message_publish(loop, text);
    else
        free(text);
}

static void frame_publish(FrameLoop *loop, uint32_t samples, bool complete)
{
    loop->frame.number = loop->current_number;
    loop->frame.samples = samples;
    loop->frame.complete = complete;
    pthread_mutex_lock(&loop->mutex);
    Frame taken = loop->ready;
    loop->ready = loop->frame;
    loop->has_ready = true;
    pthread_mutex_unlock(&loop->mutex);
    loop->frame = taken;
    loop->options.notify(loop->options.notify_context);
}

static double seconds_of(const NamedLaunch *launches, size_t count)
{
    double seconds = 0;
    for (size_t i = 0; i < count; i++)
        seconds += launches[i].time.trusted ? launches[i].time.event_seconds : launches[i].time.host_seconds;
    return seconds;
}

static char *summary_make(const FrameLoop *loop, uint32_t samples)
{
    const RenderReport *report = renderer_report(loop->renderer);
    double launches = seconds_of(report->launches.items, report->launches.count);
    double reads = seconds_of(report->reads.items, report->reads.count);
    double rays = (double)film_pixel_count(&loop->film) * samples;
    Text text = {0};
    text_appendf(&text, "%s\n", loop->options.device->name);
    text_appendf(&text, "%s, %u lanes, %ux%u, %u of %u samples, %.1f million camera rays/s\n",
                 precision_names[loop->settings.precision], report->lanes, loop->film.width,
                 loop->film.height, samples, loop->settings.sample_count, rays / launches / 1e6);
    text_appendf(&text, "ms: flatten %.2f, bvh %.2f, upload %.2f, build %.1f, launches %.1f, read-back %.2f",
                 1e3 * report->flatten_seconds, 1e3 * report->bvh_seconds, 1e3 * report->upload_seconds,
                 1e3 * report->build_seconds, 1e3 * launches, 1e3 * reads);
    return text.items;
}

// The frame's pixels of the film; but of errors those of its color.
static void frame_fill(FrameLoop *loop, uint32_t samples)
{
    const Film *film = &loop->film;
    Frame *frame = &loop->frame;
    const bool fits = frame->width == film->width && frame->height == film->height;
    if (!fits) {
        frame_free(frame);
        frame->pixels = memory_allocate(3 * film_pixel_count(film), 1);
        frame->width = film->width;
        frame->height = film->height;
    }
    free(frame->distances);
    frame->distances = NULL;
    free(frame->summary);
    frame->summary = summary_make(loop, samples);
    const Camera *camera = &loop->current.camera;
    if (view_aovs[loop->current.view])
        view_aov(frame->pixels, film, loop->current.view,
                 vector_length(vector_subtract(camera->look_at, camera->position)));
    else
        view_color(frame->pixels, film, samples < loop->settings.sample_count ? samples : 1,
                   loop->scene.color_meaning == COLORS_DISPLAY ? TRANSFER_NONE : TRANSFER_SRGB);
}

static void distances_fill(FrameLoop *loop)
{
    size_t count = film_pixel_count(&loop->film);
    loop->frame.distances = memory_allocate(count, sizeof *loop->frame.distances);
    numbers_narrow(loop->frame.distances, loop->film.t, count);
}

static bool cameras_equal(const Camera *a, const Camera *b)
{
    return vectors_equal(a->position, b->position) && vectors_equal(a->look_at, b->look_at) &&
           vectors_equal(a->up, b->up) && a->field_axis == b->field_axis &&
           a->half_tangent == b->half_tangent;
}

static bool is_last(const Film *film, const Film *band)
{
    return band->first_row + band->height == film->height;
}

// Answers the question about a pixel, if there is one.
static void probe_answer(FrameLoop *loop)
{
    pthread_mutex_lock(&loop->mutex);
    const bool has_probe = loop->has_probe;
    const uint32_t x = loop->probe[0], y = loop->probe[1];
    loop->has_probe = false;
    pthread_mutex_unlock(&loop->mutex);
    if (!has_probe) return;
    const PixelView view = {loop->renderer, &loop->scene, loop->options.scene_path, loop->current.size,
                            loop->settings.bounce_count};
    char *facts = pixel_facts(&view, x, y);
    pthread_mutex_lock(&loop->mutex);
    free(loop->facts);
    loop->facts = facts;
    pthread_mutex_unlock(&loop->mutex);
    loop->options.notify(loop->options.notify_context);
}

static bool preview_take(void *context, const Film *band, double fraction_done)
{
    (void)fraction_done;
    film_copy_band(context, band);
    return true;
}

static bool pass_take(void *context, const Film *band, uint32_t samples)
{
    FrameLoop *loop = context;
    film_copy_band(&loop->film, band);
    if (!atomic_load(&first_is_due)) probe_answer(loop);
    if (!is_last(&loop->film, band)) return true;
    const bool is_first = samples == 1 && band->layers[LAYER_COLOR];
    if (is_first && loop->current.is_moving && !loop->has_preview)
        preview_note(&loop->preview, 1, loop->move_seconds, clock_seconds() - loop->render_start,
                     (double)film_pixel_count(&loop->film));
    if (is_first && view_aovs[loop->current.view]) return true; // what it is made of is yet to come
    frame_fill(loop, samples);
    if (!is_first) distances_fill(loop);
    bool complete = !is_first && samples == loop->settings.sample_count && loop->current.view != VIEW_ERROR;
    frame_publish(loop, samples, complete);
    atomic_store(&first_is_due, false);
    return true;
}

static void film_fit(FrameLoop *loop, unsigned aovs)
{
    Film *film = &loop->film;
    const uint32_t light_count = (uint32_t)loop->scene.lights.count;
    bool fits = film->width == loop->settings.width && film->height == loop->settings.height &&
                film->light_count == light_count;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        fits = fits && (film->layers[layer] || !(aovs >> layer & 1));
    if (fits) return;
    film_free(film);
    *film = film_allocate(loop->settings.width, loop->settings.height, light_count, aovs);
}

static void renderers_close(FrameLoop *loop)
{
    renderer_close(loop->renderer);
    renderer_close(loop->reference);
    loop->renderer = loop->reference = NULL;
}

static void failure_publish(FrameLoop *loop)
{
    message_publish(loop, compute_failure_text(&loop->compute));
    renderers_close(loop);
    compute_close(&loop->compute);
}

// Before the first move is timed: several threads do what one did.
static double move_guess(const Renderer *renderer)
{
    return renderer_report(renderer)->flatten_seconds / 2;
}

// Opens or moves the renderer for an image of the divisor. False, with a message published, if it cannot.
static bool renderer_prepare(FrameLoop *loop, uint32_t divisor, uint32_t samples, bool is_preview)
{
    double start = clock_seconds();
    RenderSettings *settings = &loop->settings;
    const ImageSize size = loop->current.size;
    settings->width = settings->region_width = (size.width + divisor - 1) / divisor;
    settings->height = settings->region_height = (size.height + divisor - 1) / divisor;
    settings->sample_count = samples;
    settings->is_preview = is_preview;
    loop->scene.camera = loop->current.camera;
    MessageList messages = {0};
    bool prepared = true;
    if (loop->renderer && settings->precision != loop->current.precision) renderers_close(loop);
    settings->precision = loop->current.precision;
    if (loop->renderer) {
        prepared = renderer_move(loop->renderer, &loop->scene, settings, &messages);
        renderer_report_restart(loop->renderer);
    } else {
        if (!loop->compute.context) compute_open(&loop->compute, loop->options.device);
        loop->renderer = renderer_open(&loop->compute, &loop->scene, settings, &messages);
        prepared = loop->renderer != NULL;
        if (prepared) loop->expected_move = move_guess(loop->renderer);
        start = clock_seconds();
    }
    messages_publish(loop, &messages);
    if (!compute_ok(&loop->compute)) failure_publish(loop);
    loop->render_start = clock_seconds();
    loop->move_seconds = loop->render_start - start;
    if (!is_preview) loop->expected_move = fmax(0.7 * loop->expected_move, loop->move_seconds);
    return prepared;
}

// Large scenes take long to move to another eye: that waits until no other request has come for a while.
// False: one came.
static bool camera_rests(FrameLoop *loop)
{
    if (loop->expected_move > PREVIEW_SECONDS) {
        struct timespec until;
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_nsec += REST_NANOSECONDS;
        until.tv_sec += until.tv_nsec / 1000000000;
        until.tv_nsec %= 1000000000;
        pthread_mutex_lock(&loop->mutex);
        while (!render_stops() && pthread_cond_timedwait(&loop->changed, &loop->mutex, &until) == 0)
            continue;
        pthread_mutex_unlock(&loop->mutex);
    }
    return !render_stops();
}

static bool preview_render(FrameLoop *loop)
{
    const unsigned aovs = view_aovs[loop->current.view];
    if (!renderer_prepare(loop, loop->divisor, 1, true)) return false;
    film_fit(loop, aovs);
    atomic_store(&first_is_due, true);
    if (!renderer_render(loop->renderer, aovs, preview_take, &loop->film)) return false;
    preview_note(&loop->preview, loop->divisor, loop->move_seconds, clock_seconds() - loop->render_start,
                 (double)film_pixel_count(&loop->film));
    frame_fill(loop, 1);
    frame_publish(loop, 0, false);
    atomic_store(&first_is_due, false);
    return camera_rests(loop);
}

// Replaces the image by the heat map of its errors. False: stopped, or failed.
static bool errors_render(FrameLoop *loop)
{
    RenderSettings settings = loop->settings;
    settings.precision = PRECISION_DOUBLE;
    settings.lanes = 0;
    MessageList messages = {0};
    bool prepared = true;
    if (loop->reference)
        prepared = renderer_move(loop->reference, &loop->scene, &settings, &messages);
    else
        prepared =
            (loop->reference = renderer_open(&loop->compute, &loop->scene, &settings, &messages)) != NULL;
    messages_publish(loop, &messages);
    Film film;
    if (!prepared || !renderer_render_film(loop->reference, 0, &film)) return false;
    frame_fill(loop, 1);
    double largest = view_error(loop->frame.pixels, &loop->film, &film);
    film_free(&film);
    char *summary = loop->frame.summary;
    if (asprintf(&loop->frame.summary, "%s\nlargest error against double: %.3g", summary, largest) < 0)
        fault("out of memory");
    free(summary);
    distances_fill(loop);
    frame_publish(loop, 1, true);
    return true;
}

// The image of the current request, as far as no other comes. True: it is complete.
static bool request_render(FrameLoop *loop)
{
    const ImageSize size = loop->current.size;
    const View view = loop->current.view;
    const unsigned aovs = AOV_T | view_aovs[view];
    const bool is_moving = loop->current.is_moving;
    loop->divisor = is_moving ? preview_divisor(&loop->preview, size.width, size.height) : 1;
    loop->has_preview = is_moving && (loop->divisor > 1 || loop->expected_move > PREVIEW_SECONDS);
    const uint32_t samples = view == VIEW_COLOR ? loop->options.settings.sample_count : 1;
    bool complete = (!loop->has_preview || preview_render(loop)) && renderer_prepare(loop, 1, samples, false);
    if (complete) {
        film_fit(loop, aovs);
        atomic_store(&first_is_due, is_moving && !loop->has_preview);
        complete = renderer_accumulate(loop->renderer, aovs, pass_take, loop) &&
                   (view != VIEW_ERROR || errors_render(loop));
        atomic_store(&first_is_due, false);
    }
    if (loop->renderer && !compute_ok(&loop->compute)) failure_publish(loop);
    return complete;
}

static void image_save(FrameLoop *loop, char *path)
{
    Film film = loop->film;
    float *narrow = NULL;
    film.is_double = renderer_report(loop->renderer)->is_double;
    if (!film.is_double) {
        film.layers[LAYER_COLOR] = narrow = film_narrow_color(&film);
        film.real_size = sizeof *narrow;
    }
    MessageList messages = {0};
    bool saved = loop->options.save(loop->options.save_context, path, &loop->scene, &loop->settings,
                                    loop->renderer, &film, &messages);
    messages_publish(loop, &messages);
    free(narrow);
    if (saved) {
        Text text = {0};
        text_appendf(&text, "saved %s\n", path);
        message_publish(loop, text.items);
    }
    free(path);
}

// The scene's file is watched before it is read, and so are those that it names: no change is missed. They
// stay watched where the scene has a mistake, which may lie in one of them.
static void file_watch(void *context, const char *path)
{
    const FrameLoop *loop = context;
    watch_add(loop->watch, path);
}

static void files_changed(void *context)
{
    FrameLoop *loop = context;
    pthread_mutex_lock(&loop->mutex);
    loop->reloads = true;
    atomic_store(&has_news, true);
    pthread_cond_signal(&loop->changed);
    pthread_mutex_unlock(&loop->mutex);
}

// A camera that was changed in the file becomes the view's: the window asks for its image.
static void scene_publish(FrameLoop *loop)
{
    const Camera *camera = &loop->scene.camera;
    ImageSize size = {0};
    loop->options.choose_size(&loop->scene, &size.width, &size.height);
    pthread_mutex_lock(&loop->mutex);
    loop->has_camera |= loop->scene_state == SCENE_LOADING || !cameras_equal(&loop->file_camera, camera);
    loop->file_camera = *camera;
    loop->scene_state = SCENE_LOADED;
    loop->scene_size = size;
    pthread_mutex_unlock(&loop->mutex);
    loop->options.notify(loop->options.notify_context);
}

static void refusal_publish(FrameLoop *loop)
{
    pthread_mutex_lock(&loop->mutex);
    if (loop->scene_state == SCENE_LOADING) loop->scene_state = SCENE_REFUSED;
    pthread_mutex_unlock(&loop->mutex);
    loop->options.notify(loop->options.notify_context);
}

// Replaces the renderer by one of the scene. False: the scene cannot be rendered, and the last one stays.
static bool renderer_renew(FrameLoop *loop, const Scene *scene, MessageList *messages)
{
    if (loop->current_number == 0) return true; // no image was asked for
    if (!loop->compute.context)
        compute_open(&loop->compute, loop->options.device); // the device had failed
    else if (!loop->renderer)
        return true; // the last one cannot be rendered either
    Scene seen = *scene;
    seen.camera = loop->current.camera;
    Renderer *renderer = renderer_open(&loop->compute, &seen, &loop->settings, messages);
    if (!renderer && compute_ok(&loop->compute)) return false;
    renderers_close(loop);
    loop->renderer = renderer;
    if (renderer) loop->expected_move = move_guess(renderer);
    if (!renderer) compute_close(&loop->compute); // the image, which is due, opens it again or says why not
    return true;
}

// Whether the scene's file is what was written into it here.
static bool is_own_write(FrameLoop *loop)
{
    pthread_mutex_lock(&loop->mutex);
    Text written = loop->written;
    loop->written = (Text){0};
    pthread_mutex_unlock(&loop->mutex);
    Text text = {0};
    MessageList messages = {0};
    bool same = written.count > 0 && text_read_file(&text, loop->options.scene_path, &messages) &&
                text.count == written.count && memcmp(text.items, written.items, text.count) == 0;
    message_list_free(&messages);
    text_free(&text);
    text_free(&written);
    return same;
}

// Reads the scene, for the first time or again. False, with a message published, where it has a mistake: the
// last one stays.
static bool scene_reload(FrameLoop *loop)
{
    const bool was_mistaken = loop->is_mistaken;
    MessageList messages = {0};
    SceneOptions options = loop->options.scene_options;
    options.file_named = file_watch;
    options.context = loop;
    Scene scene;
    watch_only(loop->watch, loop->options.scene_path);
    bool loaded = scene_load(&scene, loop->options.scene_path, &options, &messages);
    if (loaded && !renderer_renew(loop, &scene, &messages)) {
        scene_free(&scene);
        loaded = false;
    }
    loop->is_mistaken = !loaded;
    if (was_mistaken && messages.count == 0) message_publish(loop, memory_copy_text(""));
    messages_publish(loop, &messages);
    if (!loaded) {
        refusal_publish(loop);
        return false;
    }
    scene_free(&loop->scene);
    loop->scene = scene;
    scene_publish(loop);
    return true;
}

typedef enum { WORK_RENDER, WORK_SAVE, WORK_PROBE, WORK_RELOAD, WORK_END } Work;

// Waits for the next work.
static Work work_wait(FrameLoop *loop, bool can_save, char **save_path)
{
    pthread_mutex_lock(&loop->mutex);
    while (!loop->quits && !loop->reloads && loop->request_number == loop->current_number &&
           !(can_save && loop->save_path) && !(loop->renderer && loop->has_probe))
        pthread_cond_wait(&loop->changed, &loop->mutex);
    Work work = WORK_SAVE;
    if (loop->quits) {
        work = WORK_END;
    } else if (loop->reloads) {
        work = WORK_RELOAD;
        loop->reloads = false;
    } else if (loop->request_number != loop->current_number) {
        work = WORK_RENDER;
        loop->current = loop->request;
        loop->current_number = loop->request_number;
    } else if (loop->renderer && loop->has_probe) {
        work = WORK_PROBE;
    } else {
        *save_path = loop->save_path;
        loop->save_path = NULL;
    }
    atomic_store(&has_news, loop->request_number != loop->current_number);
    pthread_mutex_unlock(&loop->mutex);
    return work;
}

static void *loop_run(void *context)
{
    FrameLoop *loop = context;
    bool is_complete = false;
    char *save_path = NULL;
    for (Work work;
         (work = work_wait(loop, is_complete && loop->current.view == VIEW_COLOR, &save_path)) != WORK_END;) {
        if (work == WORK_SAVE) image_save(loop, save_path);
        if (work == WORK_PROBE) probe_answer(loop);
        if (work == WORK_PROBE && !compute_ok(&loop->compute)) failure_publish(loop);
        if (work == WORK_RELOAD && !is_own_write(loop)) is_complete = !scene_reload(loop) && is_complete;
        if (work == WORK_RENDER || (work == WORK_RELOAD && !is_complete && loop->current_number > 0))
            is_complete = request_render(loop);
    }
    renderers_close(loop);
    compute_close(&loop->compute);
    return NULL;
}

FrameLoop *frame_loop_open(const FrameLoopOptions *options)
{
    FrameLoop *loop = memory_allocate_zeroed(1, sizeof *loop);
    loop->options = *options;
    loop->reloads = true;
    loop->settings = options->settings;
    loop->settings.stop = render_stops;
    loop->settings.band_seconds = 0.01;
    atomic_store(&has_news, false);
    atomic_store(&ends, false);
    pthread_mutex_init(&loop->mutex, NULL);
    pthread_condattr_t steady;
    pthread_condattr_init(&steady);
    pthread_condattr_setclock(&steady, CLOCK_MONOTONIC);
    pthread_cond_init(&loop->changed, &steady);
    pthread_condattr_destroy(&steady);
    loop->watch = watch_open(files_changed, loop);
    if (pthread_create(&loop->thread, NULL, loop_run, loop) != 0) fault("cannot start a thread");
    return loop;
}

void frame_loop_close(FrameLoop *loop)
{
    atomic_store(&ends, true);
    pthread_mutex_lock(&loop->mutex);
    loop->quits = true;
    pthread_cond_signal(&loop->changed);
    pthread_mutex_unlock(&loop->mutex);
    pthread_join(loop->thread, NULL);
    watch_close(loop->watch);
    scene_free(&loop->scene);
    pthread_mutex_destroy(&loop->mutex);
    pthread_cond_destroy(&loop->changed);
    film_free(&loop->film);
    frame_free(&loop->frame);
    frame_free(&loop->ready);
    free(loop->save_path);
    free(loop->message);
    free(loop->facts);
    text_free(&loop->written);
    free(loop);
}

SceneState frame_loop_scene(FrameLoop *loop, ImageSize *size)
{
    pthread_mutex_lock(&loop->mutex);
    SceneState state = loop->scene_state;
    *size = loop->scene_size;
    pthread_mutex_unlock(&loop->mutex);
    return state;
}

unsigned frame_loop_request(FrameLoop *loop, const FrameRequest *request)
{
    pthread_mutex_lock(&loop->mutex);
    loop->request = *request;
    unsigned number = ++loop->request_number;
    atomic_store(&has_news, true);
    pthread_cond_signal(&loop->changed);
    pthread_mutex_unlock(&loop->mutex);
    return number;
}

void frame_loop_save(FrameLoop *loop, const char *path)
{
    pthread_mutex_lock(&loop->mutex);
    free(loop->save_path);
    loop->save_path = memory_copy_text(path);
    pthread_cond_signal(&loop->changed);
    pthread_mutex_unlock(&loop->mutex);
}

void frame_loop_probe(FrameLoop *loop, uint32_t x, uint32_t y)
{
    pthread_mutex_lock(&loop->mutex);
    loop->probe[0] = x;
    loop->probe[1] = y;
    loop->has_probe = true;
    pthread_cond_signal(&loop->changed);
    pthread_mutex_unlock(&loop->mutex);
}

char *frame_loop_take_facts(FrameLoop *loop)
{
    pthread_mutex_lock(&loop->mutex);
    char *facts = loop->facts;
    loop->facts = NULL;
    pthread_mutex_unlock(&loop->mutex);
    return facts;
}

bool frame_loop_write_camera(FrameLoop *loop, const Camera *camera, MessageList *messages)
{
    const char *path = loop->options.scene_path;
    Text old = {0}, text = {0};
    if (!text_read_file(&old, path, messages)) return false;
    const Source source = {.file = path, .bytes = text_c(&old), .length = old.count};
    OutputFile output;
    bool done = camera_replace(&text, &source, camera, messages);
    text_free(&old);
    if (!done || !output_open(&output, path, messages)) {
        text_free(&text);
        return false;
    }
    done = output_write(&output, text.items, text.count, messages) && output_finish(&output, messages);
    pthread_mutex_lock(&loop->mutex);
    if (done) {
        text_free(&loop->written);
        loop->written = text;
        loop->file_camera = *camera;
    }
    pthread_mutex_unlock(&loop->mutex);
    if (done) return output_commit(&output, messages);
    text_free(&text);
    output_abandon(&output);
    return false;
}

bool frame_loop_take(FrameLoop *loop, Frame *frame)
{
    pthread_mutex_lock(&loop->mutex);
    bool is_new = loop->has_ready;
    if (is_new) {
        Frame shown = *frame;
        *frame = loop->ready;
        loop->ready = shown;
        loop->has_ready = false;
    }
    pthread_mutex_unlock(&loop->mutex);
    return is_new;
}

bool frame_loop_take_camera(FrameLoop *loop, Camera *camera)
{
    pthread_mutex_lock(&loop->mutex);
    bool is_new = loop->has_camera;
    loop->has_camera = false;
    if (is_new) *camera = loop->file_camera;
    pthread_mutex_unlock(&loop->mutex);
    return is_new;
}

char *frame_loop_take_message(FrameLoop *loop)
{
    pthread_mutex_lock(&loop->mutex);
    char *message = loop->message;
    loop->message = NULL;
    pthread_mutex_unlock(&loop->mutex);
    return message;
}
