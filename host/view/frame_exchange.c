// Passes data between the window's thread and the loop's thread. These invariants hold:
//
//  1. `shared` is accessed only in this file and only with the mutex. While a thread holds the mutex, it does
//     not read or write files, render, or call `notify`. So the window waits for the renderer only in
//     frame_loop_close.
//  2. The loop's thread alone accesses the members of FrameLoop that it owns. `options` are constant.
//  3. Everything allocated has one owner. Publishing moves a text to `shared`, and acquiring moves it out. A
//     frame is exchanged for another. The loop fills the first of three, `shared` has the newest complete
//     one, and the window shows the third.
//  4. Requests are numbered from 1. A request replaces one that was not read. `current_number` is that of the
//     last one read, and a frame has the number of the request that it shows.
//  5. `has_news` is set, with the mutex, by each request and each change of a file, and is cleared when both
//     have been read. Renderers poll it between launches without the mutex.
//  6. `first_is_due` is set only by a request for a moving camera, until its first frame is published or its
//     work ends. News does not end the render until then, so that each drag of the mouse shows frames.
//  7. `ends` is set once, with the mutex, and never cleared.
//  8. Each change for which the loop may wait signals `changed`. Each one for which the window may wait calls
//     `notify`.
//  9. `is_stale` is set by every change to a file except the window's own writes, and cleared before the
//     files are read. A change during the reading sets it again. `update.camera` is the camera of
//     `camera_text`.
#include "host/view/frame_loop_state.h"

#include "host/base/file.h"
#include "host/base/memory.h"
#include <stdlib.h>
#include <string.h>

void exchange_open(FrameLoop *loop)
{
    loop->shared.reloads = true;
    pthread_mutex_init(&loop->mutex, NULL);
    pthread_condattr_t steady;
    pthread_condattr_init(&steady);
    pthread_condattr_setclock(&steady, CLOCK_MONOTONIC);
    pthread_cond_init(&loop->changed, &steady);
    pthread_condattr_destroy(&steady);
}

void exchange_close(FrameLoop *loop)
{
    pthread_mutex_destroy(&loop->mutex);
    pthread_cond_destroy(&loop->changed);
    frame_free(&loop->shared.ready);
    free(loop->shared.save_path);
    free(loop->shared.message);
    free(loop->shared.facts);
    text_free(&loop->shared.camera_text);
}

static SharedState *shared_lock(FrameLoop *loop)
{
    pthread_mutex_lock(&loop->mutex);
    return &loop->shared;
}

static void shared_unlock(FrameLoop *loop)
{
    pthread_mutex_unlock(&loop->mutex);
}

// Ends a change for the window.
static void shared_publish(FrameLoop *loop)
{
    shared_unlock(loop);
    loop->options.notify(loop->options.notify_context);
}

// Ends a change for the loop.
static void shared_signal(FrameLoop *loop)
{
    pthread_cond_signal(&loop->changed);
    shared_unlock(loop);
}

// The loop's thread.

bool render_stops(void *context)
{
    const FrameLoop *loop = context;
    return atomic_load(&loop->ends) || (atomic_load(&loop->has_news) && !atomic_load(&loop->first_is_due));
}

// Returns the state of the most urgent work, or LOOP_WAIT if there is none.
static LoopState work_choose(const FrameLoop *loop)
{
    const SharedState *shared = &loop->shared;
    const bool can_save = loop->is_complete && loop->renderer && loop->current.view == VIEW_COLOR;
    if (atomic_load(&loop->ends)) return LOOP_END;
    if (shared->reloads) return LOOP_RELOAD;
    if (shared->request_number != loop->current_number) return LOOP_BEGIN;
    if (loop->renderer && shared->has_probe) return LOOP_PROBE;
    return can_save && shared->save_path ? LOOP_SAVE : LOOP_WAIT;
}

LoopState work_wait(FrameLoop *loop)
{
    SharedState *shared = shared_lock(loop);
    atomic_store(&loop->first_is_due, false);
    LoopState work;
    while ((work = work_choose(loop)) == LOOP_WAIT)
        pthread_cond_wait(&loop->changed, &loop->mutex);
    if (work == LOOP_RELOAD) shared->reloads = false;
    if (work == LOOP_BEGIN) {
        loop->current = shared->request;
        if (loop->current.follows_scene) loop->current.camera = shared->update.camera;
        loop->current_number = shared->request_number;
    }
    atomic_store(&loop->has_news, shared->reloads || shared->request_number != loop->current_number);
    shared_unlock(loop);
    return work;
}

bool news_await(FrameLoop *loop, long nanoseconds)
{
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += nanoseconds;
    until.tv_sec += until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    shared_lock(loop);
    while (!render_stops(loop) && pthread_cond_timedwait(&loop->changed, &loop->mutex, &until) == 0)
        continue;
    shared_unlock(loop);
    return render_stops(loop);
}

bool probe_acquire(FrameLoop *loop, uint32_t pixel[2])
{
    SharedState *shared = shared_lock(loop);
    const bool has_probe = shared->has_probe;
    memcpy(pixel, shared->probe, sizeof shared->probe);
    shared->has_probe = false;
    shared_unlock(loop);
    return has_probe;
}

char *save_path_acquire(FrameLoop *loop)
{
    SharedState *shared = shared_lock(loop);
    char *path = shared->save_path;
    shared->save_path = NULL;
    shared_unlock(loop);
    return path;
}

static bool texts_equal(const Text *a, const Text *b)
{
    return a->count == b->count && memcmp(text_c(a), text_c(b), a->count) == 0;
}

void reading_begin(FrameLoop *loop, Text camera_text)
{
    SharedState *shared = shared_lock(loop);
    text_free(&shared->camera_text);
    shared->camera_text = camera_text;
    shared->is_written = shared->is_stale = false;
    shared_unlock(loop);
}

bool written_matches(FrameLoop *loop, const Text *camera_text)
{
    const SharedState *shared = shared_lock(loop);
    const bool is_own =
        shared->is_written && !shared->is_stale && texts_equal(camera_text, &shared->camera_text);
    shared_unlock(loop);
    return is_own;
}

void message_publish(FrameLoop *loop, char *message)
{
    SharedState *shared = shared_lock(loop);
    char *waiting = shared->message;
    shared->message = message;
    if (waiting && *waiting && *message) {
        shared->message = text_format("%s%s", waiting, message);
        free(message);
    }
    free(waiting);
    shared_publish(loop);
}

void messages_publish(FrameLoop *loop, MessageList *messages)
{
    char *text = message_list_text(messages);
    message_list_free(messages);
    if (text) message_publish(loop, text);
}

void facts_publish(FrameLoop *loop, char *facts)
{
    SharedState *shared = shared_lock(loop);
    free(shared->facts);
    shared->facts = facts;
    shared_publish(loop);
}

void frame_publish(FrameLoop *loop, uint32_t samples)
{
    loop->frame.number = loop->current_number;
    loop->frame.samples = samples;
    stage_end(loop->stage);
    SharedState *shared = shared_lock(loop);
    const Frame older = shared->ready;
    shared->ready = loop->frame;
    shared->has_ready = true;
    loop->frame = older;
    atomic_store(&loop->first_is_due, false);
    shared_publish(loop);
}

void scene_publish(FrameLoop *loop)
{
    const Camera *camera = &loop->scene.camera;
    const char *path = loop->options.scene_path;
    const bool can_reread = strcmp(path, "-") != 0 && !file_obstacle(path);
    if (loop->current.follows_scene) loop->current.camera = *camera;
    SharedState *shared = shared_lock(loop);
    SceneUpdate *update = &shared->update;
    update->has_new_camera |= update->state == SCENE_LOADING ||
                              (update->frame == loop->scene_frame && !cameras_equal(&update->camera, camera));
    update->state = SCENE_LOADED;
    update->size = (ImageSize){0};
    scene_choose_image_size(&loop->scene, &update->size.width, &update->size.height);
    update->camera = *camera;
    update->frame = loop->scene_frame;
    update->frame_count = can_reread ? loop->scene.animation.frame_count : 0;
    update->frame_rate = loop->scene.animation.frame_rate;
    shared->has_update = true;
    shared_publish(loop);
}

void refusal_publish(FrameLoop *loop)
{
    SharedState *shared = shared_lock(loop);
    if (shared->update.state == SCENE_LOADING) {
        shared->update.state = SCENE_REFUSED;
        shared->has_update = true;
    }
    shared_publish(loop);
}

// The thread that watches the scene's files.

void file_changed(void *context, const char *path)
{
    FrameLoop *loop = context;
    SharedState *shared = shared_lock(loop);
    shared->reloads = true;
    shared->is_stale |= !path || strcmp(path, camera_path(&loop->options)) != 0;
    atomic_store(&loop->has_news, true);
    shared_signal(loop);
}

// The window's thread.

void exchange_quit(FrameLoop *loop)
{
    shared_lock(loop);
    atomic_store(&loop->ends, true);
    shared_signal(loop);
}

unsigned frame_loop_request(FrameLoop *loop, const FrameRequest *request)
{
    SharedState *shared = shared_lock(loop);
    shared->request = *request;
    const unsigned number = ++shared->request_number;
    atomic_store(&loop->has_news, true);
    shared_signal(loop);
    return number;
}

void frame_loop_save(FrameLoop *loop, const char *path)
{
    SharedState *shared = shared_lock(loop);
    free(shared->save_path);
    shared->save_path = memory_copy_text(path);
    shared_signal(loop);
}

void frame_loop_probe(FrameLoop *loop, uint32_t x, uint32_t y)
{
    SharedState *shared = shared_lock(loop);
    shared->probe[0] = x;
    shared->probe[1] = y;
    shared->has_probe = true;
    shared_signal(loop);
}

LoopNews frame_loop_acquire(FrameLoop *loop, Frame *frame, SceneUpdate *scene)
{
    SharedState *shared = shared_lock(loop);
    const LoopNews news = {shared->has_ready, shared->has_update, shared->facts, shared->message};
    if (news.has_frame) {
        const Frame shown = *frame;
        *frame = shared->ready;
        shared->ready = shown;
    }
    if (news.has_scene) *scene = shared->update;
    shared->has_ready = shared->has_update = shared->update.has_new_camera = false;
    shared->facts = shared->message = NULL;
    shared_unlock(loop);
    return news;
}

static void camera_exchange(SharedState *shared, Text *text, Camera *camera)
{
    const Text earlier_text = shared->camera_text;
    const Camera earlier_camera = shared->update.camera;
    shared->camera_text = *text;
    shared->update.camera = *camera;
    *text = earlier_text;
    *camera = earlier_camera;
}

void written_store(FrameLoop *loop, const Text *old, Text *written, Camera *camera)
{
    SharedState *shared = shared_lock(loop);
    shared->is_written = true;
    shared->is_stale |= !texts_equal(old, &shared->camera_text); // others wrote the file
    camera_exchange(shared, written, camera);
    shared_unlock(loop);
}

void written_restore(FrameLoop *loop, Text *written, Camera *camera)
{
    camera_exchange(shared_lock(loop), written, camera);
    shared_unlock(loop);
}

bool frame_loop_stage(FrameLoop *loop, Text *text, double *seconds)
{
    return stage_write(loop->stage, text, seconds);
}
