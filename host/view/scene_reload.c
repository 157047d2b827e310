// Reads the scene initially and when its files change, and writes the camera into it.
#include "host/view/frame_loop_state.h"

#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include "host/view/camera_file.h"

// Watches a file of the scene before it is read, so that no change is missed. Files stay watched if the
// scene has a mistake, which may lie in any of them.
static void file_watch(void *context, const char *path)
{
    const FrameLoop *loop = context;
    watch_add(loop->watch, path);
}

// Replaces the renderer by one of the scene, which keeps the kernels that suit. Returns false, and keeps the
// previous one, if the scene cannot be rendered.
static bool renderer_renew(FrameLoop *loop, const Scene *scene, MessageList *messages)
{
    if (loop->current_number == 0) return true; // no image was asked for
    if (!loop->compute.context)
        compute_open(&loop->compute, loop->options.device); // the device had failed
    else if (!loop->renderer)
        return true; // the last one cannot be rendered either
    Scene seen = *scene;
    if (!loop->current.follows_scene) seen.camera = loop->current.camera;
    renderer_close(loop->reference);
    loop->reference = NULL;
    loop->renderer = renderer_reopen(loop->renderer, &loop->compute, &seen, &loop->settings, messages);
    if (loop->renderer) {
        loop->expected_move = move_guess(loop->renderer);
    } else if (compute_ok(&loop->compute)) {
        OwnedMessageList known = {0};
        loop->renderer = renderer_open(&loop->compute, &loop->scene, &loop->settings, &known);
        return false;
    } else {
        compute_close(&loop->compute); // the image, which is due, reopens it or reports why not
    }
    return true;
}

// Returns the text of the camera's file, empty if the window does not write it or if it cannot be read. The
// caller frees it.
static Text camera_text_read(const FrameLoop *loop)
{
    Text text = {0};
    const char *path = camera_path(&loop->options);
    if (loop->options.writes_camera && !file_obstacle(path)) text_read_file(&text, path, NULL);
    return text;
}

bool is_own_write(FrameLoop *loop)
{
    OwnedText text = camera_text_read(loop);
    return written_matches(loop, &text);
}

bool scene_reload(FrameLoop *loop)
{
    const bool was_mistaken = loop->is_mistaken;
    const bool is_other_frame = loop->current.scene_frame != loop->scene_frame;
    MessageList messages = {0};
    SceneOptions options = loop->options.scene_options;
    options.file_named = file_watch;
    options.context = loop;
    options.stage = loop->stage;
    options.frame = loop->scene_frame = loop->current.scene_frame;
    Scene scene;
    watch_only(loop->watch, loop->options.scene_path);
    reading_begin(loop, camera_text_read(loop));
    bool loaded = scene_load(&scene, loop->options.scene_path, &options, &messages);
    if (loaded && !renderer_renew(loop, &scene, &messages)) {
        scene_free(&scene);
        loaded = false;
    }
    loop->is_mistaken = !loaded;
    if (loaded && is_other_frame) message_list_free(&messages); // warnings, which the first frame had
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

bool frame_loop_write_camera(FrameLoop *loop, const Camera *camera, const uint32_t *frame,
                             MessageList *messages)
{
    const char *path = camera_path(&loop->options);
    OwnedText old = {0}, text = {0};
    if (!text_read_file(&old, path, messages)) return false;
    const Source source = {.file = path, .bytes = text_c(&old), .length = old.count};
    OutputFile output;
    if (!camera_replace(&text, &source, camera, frame, messages) || !output_open(&output, path, messages))
        return false;
    if (!output_write(&output, text.items, text.count, messages) || !output_finish(&output, messages)) {
        output_abandon(&output);
        return false;
    }
    // before the change is visible, so that the loop recognizes it as the window's
    Camera file_camera = *camera;
    written_store(loop, &old, &text, &file_camera);
    if (output_commit(&output, messages)) return true;
    written_restore(loop, &text, &file_camera);
    return false;
}
