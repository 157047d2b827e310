// Passes data between the thread of the window and that of the loop. All of it is under the mutex.
#include "host/view/frame_loop_state.h"

#include "host/base/file.h"
#include "host/base/memory.h"
#include <stdlib.h>
#include <string.h>

bool render_stops(void *context)
{
    const FrameLoop *loop = context;
    return atomic_load(&loop->ends) || (atomic_load(&loop->has_news) && !atomic_load(&loop->first_is_due));
}

void message_publish(FrameLoop *loop, char *message)
{
    pthread_mutex_lock(&loop->mutex);
    char *waiting = loop->shared.message;
    loop->shared.message = message;
    if (waiting && *waiting && *message) {
        loop->shared.message = text_format("%s%s", waiting, message);
        free(message);
    }
    free(waiting);
    pthread_mutex_unlock(&loop->mutex);
    loop->options.notify(loop->options.notify_context);
}

void messages_publish(FrameLoop *loop, MessageList *messages)
{
    char *text = message_list_text(messages);
    message_list_free(messages);
    if (text) message_publish(loop, text);
}

void frame_publish(FrameLoop *loop, uint32_t samples)
{
    loop->frame.number = loop->current_number;
    loop->frame.samples = samples;
    pthread_mutex_lock(&loop->mutex);
    Frame taken = loop->shared.ready;
    loop->shared.ready = loop->frame;
    loop->shared.has_ready = true;
    pthread_mutex_unlock(&loop->mutex);
    loop->frame = taken;
    stage_end(loop->stage);
    loop->options.notify(loop->options.notify_context);
}

void scene_publish(FrameLoop *loop)
{
    const Camera *camera = &loop->scene.camera;
    ImageSize size = {0};
    scene_choose_image_size(&loop->scene, &size.width, &size.height);
    pthread_mutex_lock(&loop->mutex);
    SceneUpdate *update = &loop->shared.update;
    update->has_new_camera |= loop->shared.scene_state == SCENE_LOADING ||
                              (update->frame == loop->scene_frame && !cameras_equal(&update->camera, camera));
    update->camera = *camera;
    update->frame = loop->scene_frame;
    update->frame_count = file_obstacle(loop->options.scene_path) ? 0 : loop->scene.frame_count;
    update->frame_rate = loop->scene.frame_rate;
    loop->shared.has_update = true;
    if (loop->current.follows_scene) loop->current.camera = *camera;
    loop->shared.scene_state = SCENE_LOADED;
    loop->shared.scene_size = size;
    pthread_mutex_unlock(&loop->mutex);
    loop->options.notify(loop->options.notify_context);
}

void refusal_publish(FrameLoop *loop)
{
    pthread_mutex_lock(&loop->mutex);
    if (loop->shared.scene_state == SCENE_LOADING) loop->shared.scene_state = SCENE_REFUSED;
    pthread_mutex_unlock(&loop->mutex);
    loop->options.notify(loop->options.notify_context);
}

void files_changed(void *context)
{
    FrameLoop *loop = context;
    pthread_mutex_lock(&loop->mutex);
    loop->shared.reloads = true;
    atomic_store(&loop->has_news, true);
    pthread_cond_signal(&loop->changed);
    pthread_mutex_unlock(&loop->mutex);
}

bool probe_acquire(FrameLoop *loop, uint32_t pixel[2])
{
    pthread_mutex_lock(&loop->mutex);
    const bool has_probe = loop->shared.has_probe;
    memcpy(pixel, loop->shared.probe, sizeof loop->shared.probe);
    loop->shared.has_probe = false;
    pthread_mutex_unlock(&loop->mutex);
    return has_probe;
}

void facts_publish(FrameLoop *loop, char *facts)
{
    pthread_mutex_lock(&loop->mutex);
    free(loop->shared.facts);
    loop->shared.facts = facts;
    pthread_mutex_unlock(&loop->mutex);
    loop->options.notify(loop->options.notify_context);
}

Work work_wait(FrameLoop *loop, bool can_save, char **save_path)
{
    pthread_mutex_lock(&loop->mutex);
    while (!loop->shared.quits && !loop->shared.reloads &&
           loop->shared.request_number == loop->current_number && !(can_save && loop->shared.save_path) &&
           !(loop->renderer && loop->shared.has_probe))
        pthread_cond_wait(&loop->changed, &loop->mutex);
    Work work = WORK_SAVE;
    if (loop->shared.quits) {
        work = WORK_END;
    } else if (loop->shared.reloads) {
        work = WORK_RELOAD;
        loop->shared.reloads = false;
    } else if (loop->shared.request_number != loop->current_number) {
        work = WORK_RENDER;
        loop->current = loop->shared.request;
        if (loop->current.follows_scene) loop->current.camera = loop->shared.update.camera;
        loop->current_number = loop->shared.request_number;
    } else if (loop->renderer && loop->shared.has_probe) {
        work = WORK_PROBE;
    } else {
        *save_path = loop->shared.save_path;
        loop->shared.save_path = NULL;
    }
    atomic_store(&loop->has_news, loop->shared.request_number != loop->current_number);
    pthread_mutex_unlock(&loop->mutex);
    return work;
}

SceneState frame_loop_scene(FrameLoop *loop, ImageSize *size)
{
    pthread_mutex_lock(&loop->mutex);
    SceneState state = loop->shared.scene_state;
    *size = loop->shared.scene_size;
    pthread_mutex_unlock(&loop->mutex);
    return state;
}

unsigned frame_loop_request(FrameLoop *loop, const FrameRequest *request)
{
    pthread_mutex_lock(&loop->mutex);
    loop->shared.request = *request;
    unsigned number = ++loop->shared.request_number;
    atomic_store(&loop->has_news, true);
    pthread_cond_signal(&loop->changed);
    pthread_mutex_unlock(&loop->mutex);
    return number;
}

void frame_loop_save(FrameLoop *loop, const char *path)
{
    pthread_mutex_lock(&loop->mutex);
    free(loop->shared.save_path);
    loop->shared.save_path = memory_copy_text(path);
    pthread_cond_signal(&loop->changed);
    pthread_mutex_unlock(&loop->mutex);
}

void frame_loop_probe(FrameLoop *loop, uint32_t x, uint32_t y)
{
    pthread_mutex_lock(&loop->mutex);
    loop->shared.probe[0] = x;
    loop->shared.probe[1] = y;
    loop->shared.has_probe = true;
    pthread_cond_signal(&loop->changed);
    pthread_mutex_unlock(&loop->mutex);
}

// Moves a text of the loop to the caller and sets it to NULL.
static char *text_acquire(FrameLoop *loop, char **text)
{
    pthread_mutex_lock(&loop->mutex);
    char *taken = *text;
    *text = NULL;
    pthread_mutex_unlock(&loop->mutex);
    return taken;
}

char *frame_loop_acquire_facts(FrameLoop *loop)
{
    return text_acquire(loop, &loop->shared.facts);
}

bool frame_loop_acquire(FrameLoop *loop, Frame *frame)
{
    pthread_mutex_lock(&loop->mutex);
    bool is_new = loop->shared.has_ready;
    if (is_new) {
        Frame shown = *frame;
        *frame = loop->shared.ready;
        loop->shared.ready = shown;
        loop->shared.has_ready = false;
    }
    pthread_mutex_unlock(&loop->mutex);
    return is_new;
}

bool frame_loop_acquire_scene(FrameLoop *loop, SceneUpdate *update)
{
    pthread_mutex_lock(&loop->mutex);
    bool is_new = loop->shared.has_update;
    loop->shared.has_update = false;
    if (is_new) *update = loop->shared.update;
    loop->shared.update.has_new_camera = false;
    pthread_mutex_unlock(&loop->mutex);
    return is_new;
}

char *frame_loop_acquire_message(FrameLoop *loop)
{
    return text_acquire(loop, &loop->shared.message);
}

bool frame_loop_stage(FrameLoop *loop, Text *text, double *seconds)
{
    return stage_write(loop->stage, text, seconds);
}
