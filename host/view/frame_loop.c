// Runs the thread of the loop through its states.
#include "host/view/frame_loop_state.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include <stdlib.h>

static void image_save(FrameLoop *loop)
{
    OWNED char *path = save_path_acquire(loop);
    OWNED float *narrow = NULL;
    Film film = loop->film;
    film.is_double = renderer_report(loop->renderer)->is_double;
    if (!film.is_double) {
        film.layers[LAYER_COLOR] = narrow = film_narrow_color(&film);
        film.real_size = sizeof *narrow;
    }
    MessageList messages = {0};
    const CompleteImage image = {&loop->scene, &loop->settings, loop->renderer, &film};
    const bool saved = loop->options.save(loop->options.save_context, path, &image, &messages);
    messages_publish(loop, &messages);
    if (saved) message_publish(loop, text_format("saved %s\n", path));
}

// Does the work of a state and returns the next one.
static LoopState state_run(FrameLoop *loop, LoopState state)
{
    switch (state) {
    case LOOP_WAIT:
        stage_end(loop->stage);
        if (!compute_ok(&loop->compute)) failure_publish(loop);
        return work_wait(loop);
    case LOOP_RELOAD:
        if (!is_own_write(loop) && scene_reload(loop)) loop->is_complete = false;
        return loop->is_complete || loop->current_number == 0 ? LOOP_WAIT : LOOP_BEGIN;
    case LOOP_BEGIN:
        loop->is_complete = false;
        if (loop->current.scene_frame != loop->scene_frame) scene_reload(loop);
        return request_begin(loop) ? LOOP_PREVIEW : LOOP_ROUNDS;
    case LOOP_PREVIEW:
        return preview_render(loop) ? LOOP_REST : LOOP_WAIT;
    case LOOP_REST:
        return camera_rests(loop) ? LOOP_ROUNDS : LOOP_WAIT;
    case LOOP_ROUNDS:
        loop->is_complete = rounds_render(loop);
        return loop->is_complete && loop->current.view == VIEW_ERROR ? LOOP_ERRORS : LOOP_WAIT;
    case LOOP_ERRORS:
        loop->is_complete = errors_render(loop);
        return LOOP_WAIT;
    case LOOP_PROBE:
        probe_answer(loop);
        return LOOP_WAIT;
    case LOOP_SAVE:
        image_save(loop);
        return LOOP_WAIT;
    case LOOP_END:
        break;
    }
    return LOOP_END;
}

static void *loop_run(void *context)
{
    FrameLoop *loop = context;
    for (LoopState state = LOOP_WAIT; state != LOOP_END;)
        state = state_run(loop, state);
    renderers_close(loop);
    compute_close(&loop->compute);
    return NULL;
}

FrameLoop *frame_loop_open(const FrameLoopOptions *options)
{
    FrameLoop *loop = memory_allocate_zeroed(1, sizeof *loop);
    loop->options = *options;
    loop->settings = options->settings;
    loop->stage = stage_open(false);
    loop->settings.stop = render_stops;
    loop->settings.stop_context = loop;
    loop->settings.stage = loop->stage;
    loop->settings.band_seconds = 0.01;
    exchange_open(loop);
    loop->watch = watch_open(file_changed, loop);
    if (pthread_create(&loop->thread, NULL, loop_run, loop) != 0) fault("cannot start a thread");
    return loop;
}

void frame_loop_close(FrameLoop *loop)
{
    exchange_quit(loop);
    pthread_join(loop->thread, NULL);
    watch_close(loop->watch);
    stage_close(loop->stage);
    scene_free(&loop->scene);
    film_free(&loop->film);
    frame_free(&loop->frame);
    exchange_close(loop);
    free(loop);
}
