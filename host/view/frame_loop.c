// Runs the thread of the loop.
#include "host/view/frame_loop_state.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include <stdlib.h>

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
    const CompleteImage image = {&loop->scene, &loop->settings, loop->renderer, &film};
    const bool saved = loop->options.save(loop->options.save_context, path, &image, &messages);
    messages_publish(loop, &messages);
    free(narrow);
    if (saved) message_publish(loop, text_format("saved %s\n", path));
    free(path);
}

static void *loop_run(void *context)
{
    FrameLoop *loop = context;
    bool is_complete = false;
    char *save_path = NULL;
    for (Work work; (work = work_wait(loop, is_complete && loop->renderer && loop->current.view == VIEW_COLOR,
                                      &save_path)) != WORK_END;) {
        if (work == WORK_SAVE) image_save(loop, save_path);
        if (work == WORK_PROBE) probe_answer(loop);
        if (work == WORK_PROBE && !compute_ok(&loop->compute)) failure_publish(loop);
        if (work == WORK_RELOAD && !is_own_write(loop)) is_complete = !scene_reload(loop) && is_complete;
        if (work == WORK_RENDER && loop->current.scene_frame != loop->scene_frame) scene_reload(loop);
        if (work == WORK_RENDER || (work == WORK_RELOAD && !is_complete && loop->current_number > 0))
            is_complete = request_render(loop);
        stage_end(loop->stage);
    }
    renderers_close(loop);
    compute_close(&loop->compute);
    return NULL;
}

FrameLoop *frame_loop_open(const FrameLoopOptions *options)
{
    FrameLoop *loop = memory_allocate_zeroed(1, sizeof *loop);
    loop->options = *options;
    loop->shared.reloads = true;
    loop->settings = options->settings;
    loop->stage = stage_open(false);
    loop->settings.stop = render_stops;
    loop->settings.stop_context = loop;
    loop->settings.stage = loop->stage;
    loop->settings.band_seconds = 0.01;
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
    atomic_store(&loop->ends, true);
    pthread_mutex_lock(&loop->mutex);
    loop->shared.quits = true;
    pthread_cond_signal(&loop->changed);
    pthread_mutex_unlock(&loop->mutex);
    pthread_join(loop->thread, NULL);
    watch_close(loop->watch);
    stage_close(loop->stage);
    scene_free(&loop->scene);
    pthread_mutex_destroy(&loop->mutex);
    pthread_cond_destroy(&loop->changed);
    film_free(&loop->film);
    frame_free(&loop->frame);
    frame_free(&loop->shared.ready);
    free(loop->shared.save_path);
    free(loop->shared.message);
    free(loop->shared.facts);
    text_free(&loop->shared.written);
    free(loop);
}
