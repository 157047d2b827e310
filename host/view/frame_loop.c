#include "host/view/frame_loop.h"

#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/numbers.h"
#include "host/image/transfer.h"
#include "host/view/preview.h"
#include "host/view/watch.h"
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    Camera camera;
    ImageSize size;
    unsigned number;
    bool is_moving;
} Request;

struct FrameLoop {
    FrameLoopOptions options;
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t changed;

    // under the mutex
    Request request;
    bool quits;
    bool reloads; // the scene's files have changed
    char *save_path, *message;
    Frame ready;
    bool has_ready;
    Camera file_camera;
    bool has_camera;

    // the thread's own
    Scene scene;      // with the request's camera
    bool is_mistaken; // its file, as it is now
    Watch *watch;
    RenderSettings settings;
    Compute compute;
    Renderer *renderer; // NULL: not open, or failed
    Request current;
    uint32_t divisor; // of its first frame
    double move_seconds, render_start;
    Film film; // of the image or the coarse frame: sums of samples, at the end their mean
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
    free(frame->distances);
    *frame = (Frame){0};
}

static void message_publish(FrameLoop *loop, char *message)
{
    pthread_mutex_lock(&loop->mutex);
    free(loop->message);
    loop->message = message;
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
    loop->frame.number = loop->current.number;
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

// The film's color as display values, as image files have them.
static void frame_fill(FrameLoop *loop, uint32_t divisor_of_sums)
{
    const Film *film = &loop->film;
    Frame *frame = &loop->frame;
    size_t row = 3 * (size_t)film->width;
    if (frame->width != film->width || frame->height != film->height) {
        frame_free(frame);
        frame->pixels = memory_allocate(row * film->height, 1);
        frame->width = film->width;
        frame->height = film->height;
    }
    free(frame->distances);
    frame->distances = NULL;
    float *values = memory_allocate(row, sizeof *values);
    for (uint32_t y = 0; y < film->height; y++) {
        const double *sums = film->color + y * row;
        for (size_t i = 0; i < row; i++)
            values[i] = (float)(sums[i] / divisor_of_sums);
        transfer_quantize(frame->pixels + y * row, values, row, loop->options.transfer, 8);
    }
    free(values);
}

static void distances_fill(FrameLoop *loop)
{
    size_t count = film_pixel_count(&loop->film);
    loop->frame.distances = memory_allocate(count, sizeof *loop->frame.distances);
    numbers_narrow(loop->frame.distances, loop->film.t, count);
}

static bool vectors_equal(Vector3 a, Vector3 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
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

static bool coarse_take(void *context, const Film *band, double fraction_done)
{
    (void)fraction_done;
    film_copy_band(context, band);
    return true;
}

static bool pass_take(void *context, const Film *band, uint32_t samples)
{
    FrameLoop *loop = context;
    film_copy_band(&loop->film, band);
    if (!is_last(&loop->film, band)) return true;
    const uint32_t count = loop->settings.sample_count;
    const bool is_first = samples == 1 && band->layers[LAYER_COLOR], has_distances = !is_first;
    if (is_first && loop->current.is_moving && loop->divisor == 1)
        preview_note(&loop->preview, 1, loop->move_seconds, clock_seconds() - loop->render_start,
                     (double)film_pixel_count(&loop->film));
    frame_fill(loop, samples < count ? samples : 1);
    if (has_distances) distances_fill(loop);
    frame_publish(loop, samples, samples == count && has_distances);
    atomic_store(&first_is_due, false);
    return true;
}

static void film_fit(FrameLoop *loop, unsigned aovs)
{
    Film *film = &loop->film;
    bool fits = film->width == loop->settings.width && film->height == loop->settings.height &&
                (film->t || !(aovs & AOV_T));
    if (fits) return;
    film_free(film);
    *film = film_allocate(loop->settings.width, loop->settings.height, 0, aovs);
}

static void failure_publish(FrameLoop *loop)
{
    message_publish(loop, compute_failure_text(&loop->compute));
    renderer_close(loop->renderer);
    loop->renderer = NULL;
    compute_close(&loop->compute);
}

// Opens or moves the renderer for an image of the divisor. False, with a message published, if it cannot.
static bool renderer_prepare(FrameLoop *loop, uint32_t divisor, uint32_t samples)
{
    double start = clock_seconds();
    RenderSettings *settings = &loop->settings;
    const ImageSize size = loop->current.size;
    settings->width = settings->region_width = (size.width + divisor - 1) / divisor;
    settings->height = settings->region_height = (size.height + divisor - 1) / divisor;
    settings->sample_count = samples;
    loop->scene.camera = loop->current.camera;
    MessageList messages = {0};
    bool prepared = true;
    if (loop->renderer) {
        prepared = renderer_move(loop->renderer, &loop->scene, settings, &messages);
        renderer_report_restart(loop->renderer);
    } else {
        if (!loop->compute.context) compute_open(&loop->compute, loop->options.device);
        loop->renderer = renderer_open(&loop->compute, &loop->scene, settings, &messages);
        prepared = loop->renderer != NULL;
    }
    messages_publish(loop, &messages);
    if (!compute_ok(&loop->compute)) failure_publish(loop);
    loop->render_start = clock_seconds();
    loop->move_seconds = loop->render_start - start;
    return prepared;
}

static bool coarse_render(FrameLoop *loop)
{
    if (!renderer_prepare(loop, loop->divisor, 1)) return false;
    film_fit(loop, 0);
    atomic_store(&first_is_due, true);
    if (!renderer_render(loop->renderer, 0, coarse_take, &loop->film)) return false;
    preview_note(&loop->preview, loop->divisor, loop->move_seconds, clock_seconds() - loop->render_start,
                 (double)film_pixel_count(&loop->film));
    frame_fill(loop, 1);
    frame_publish(loop, 0, false);
    atomic_store(&first_is_due, false);
    return !render_stops();
}

// The image of the current request, as far as no other comes. True: it is complete.
static bool request_render(FrameLoop *loop)
{
    const ImageSize size = loop->current.size;
    loop->divisor = loop->current.is_moving ? preview_divisor(&loop->preview, size.width, size.height) : 1;
    bool complete = (loop->divisor == 1 || coarse_render(loop)) &&
                    renderer_prepare(loop, 1, loop->options.settings.sample_count);
    if (complete) {
        film_fit(loop, AOV_T);
        atomic_store(&first_is_due, loop->current.is_moving && loop->divisor == 1);
        complete = renderer_accumulate(loop->renderer, AOV_T, pass_take, loop);
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

static void files_watch(const FrameLoop *loop)
{
    const Scene *scene = &loop->scene;
    const char **paths = memory_allocate(1 + scene->textures.count + scene->meshes.count, sizeof *paths);
    size_t count = 0;
    paths[count++] = loop->options.scene_path;
    for (size_t i = 0; i < scene->textures.count; i++)
        paths[count++] = scene->textures.items[i].path;
    for (size_t i = 0; i < scene->meshes.count; i++)
        if (scene->meshes.items[i].path) paths[count++] = scene->meshes.items[i].path;
    watch_set(loop->watch, paths, count);
    free(paths);
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
static void camera_publish(FrameLoop *loop, const Camera *camera)
{
    pthread_mutex_lock(&loop->mutex);
    loop->has_camera |= !cameras_equal(&loop->file_camera, camera);
    loop->file_camera = *camera;
    pthread_mutex_unlock(&loop->mutex);
    loop->options.notify(loop->options.notify_context);
}

// Reads the scene anew. False, with a message published, where it has a mistake: the last one stays.
static bool scene_reload(FrameLoop *loop)
{
    const bool was_mistaken = loop->is_mistaken;
    MessageList messages = {0};
    Scene scene;
    loop->is_mistaken =
        !scene_load(&scene, loop->options.scene_path, &loop->options.scene_options, &messages);
    if (was_mistaken && messages.count == 0) message_publish(loop, memory_copy_text(""));
    messages_publish(loop, &messages);
    if (loop->is_mistaken) return false;
    renderer_close(loop->renderer);
    loop->renderer = NULL;
    scene_free(&loop->scene);
    loop->scene = scene;
    files_watch(loop);
    camera_publish(loop, &scene.camera);
    return true;
}

typedef enum { WORK_RENDER, WORK_SAVE, WORK_RELOAD, WORK_END } Work;

// Waits for the next work.
static Work work_wait(FrameLoop *loop, bool is_complete, char **save_path)
{
    pthread_mutex_lock(&loop->mutex);
    while (!loop->quits && !loop->reloads && loop->request.number == loop->current.number &&
           !(is_complete && loop->save_path))
        pthread_cond_wait(&loop->changed, &loop->mutex);
    Work work = WORK_SAVE;
    if (loop->quits) {
        work = WORK_END;
    } else if (loop->reloads) {
        work = WORK_RELOAD;
        loop->reloads = false;
    } else if (loop->request.number != loop->current.number) {
        work = WORK_RENDER;
        loop->current = loop->request;
    } else {
        *save_path = loop->save_path;
        loop->save_path = NULL;
    }
    atomic_store(&has_news, loop->request.number != loop->current.number);
    pthread_mutex_unlock(&loop->mutex);
    return work;
}

static void *loop_run(void *context)
{
    FrameLoop *loop = context;
    bool is_complete = false;
    char *save_path = NULL;
    for (Work work; (work = work_wait(loop, is_complete, &save_path)) != WORK_END;) {
        if (work == WORK_SAVE) image_save(loop, save_path);
        if (work == WORK_RELOAD) is_complete = !scene_reload(loop) && is_complete;
        if (work == WORK_RENDER || (work == WORK_RELOAD && !is_complete)) is_complete = request_render(loop);
    }
    renderer_close(loop->renderer);
    compute_close(&loop->compute);
    return NULL;
}

FrameLoop *frame_loop_open(const FrameLoopOptions *options)
{
    FrameLoop *loop = memory_allocate_zeroed(1, sizeof *loop);
    loop->options = *options;
    loop->scene = *options->scene;
    *options->scene = (Scene){0};
    loop->file_camera = loop->scene.camera;
    loop->settings = options->settings;
    loop->settings.stop = render_stops;
    loop->settings.band_seconds = 0.01;
    atomic_store(&has_news, false);
    atomic_store(&ends, false);
    pthread_mutex_init(&loop->mutex, NULL);
    pthread_cond_init(&loop->changed, NULL);
    loop->watch = watch_open(files_changed, loop);
    files_watch(loop);
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
    free(loop);
}

unsigned frame_loop_request(FrameLoop *loop, const Camera *camera, ImageSize size, bool is_moving)
{
    pthread_mutex_lock(&loop->mutex);
    loop->request = (Request){*camera, size, loop->request.number + 1, is_moving};
    atomic_store(&has_news, true);
    unsigned number = loop->request.number;
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
