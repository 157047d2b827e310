// The state of a FrameLoop, and what the files that work on it have from one another.
#pragma once

#include "host/view/frame_loop.h"
#include "host/view/preview.h"
#include "host/view/watch.h"
#include <pthread.h>

struct FrameLoop {
    FrameLoopOptions options;
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    Stage *stage;

    // under the mutex
    FrameRequest request;
    unsigned request_number;
    SceneState scene_state;
    ImageSize scene_size;
    char *save_path, *message;
    Frame ready;
    Camera file_camera;
    uint32_t probe[2]; // a pixel
    char *facts;       // of the last one
    Text written;      // into the scene's file, and not yet noticed
    bool has_ready, has_camera, has_probe, quits;
    bool reloads; // the scene's files have changed, or have not been read

    // the thread's own
    bool is_mistaken; // the scene's file, as it is now
    bool has_preview; // the request's first frame is coarse, or of arrays that another eye saw
    uint32_t divisor; // of that
    Scene scene;      // with the request's camera
    Watch *watch;
    RenderSettings settings;
    Compute compute;
    Renderer *renderer;  // NULL: not open, or failed
    Renderer *reference; // in double, of the view of errors; NULL: not open
    FrameRequest current;
    unsigned current_number;
    double move_seconds, render_start;
    double expected_move; // to another eye, in seconds: of the scene as it is, little by little forgotten
    Film film;            // of the image or the coarse frame: sums of samples, at the end their mean
    Frame frame;
    Preview preview;
};

// frame_exchange.c

// The `stop` of the renderers, which has no context: so there is one loop per process.
bool render_stops(void);
// Ends all renders, now and to come; else allows them.
void renders_end(bool end);
// Whether a frame is due that must appear, whatever is asked for meanwhile.
void first_frame_set_due(bool is_due);
bool first_frame_is_due(void);

// The scene's files have changed: called by the thread that watches them.
void files_changed(void *context);

typedef enum { WORK_RENDER, WORK_SAVE, WORK_PROBE, WORK_RELOAD, WORK_END } Work;

// Waits for the next work, and takes it: of a save its path, which the caller frees.
Work work_wait(FrameLoop *loop, bool can_save, char **save_path);
// The pixel of a question that was not yet answered. False: there is none.
bool probe_take(FrameLoop *loop, uint32_t pixel[2]);
// Takes the facts.
void facts_publish(FrameLoop *loop, char *facts);
// Takes the message. "" removes the last one; others are added to those that were not yet taken.
void message_publish(FrameLoop *loop, char *message);
// Takes the messages.
void messages_publish(FrameLoop *loop, MessageList *messages);
void frame_publish(FrameLoop *loop, uint32_t samples, bool complete);
// A camera that was changed in the file becomes the view's: the window asks for its image.
void scene_publish(FrameLoop *loop);
// The scene cannot be read, or not be rendered.
void refusal_publish(FrameLoop *loop);

// frame_fill.c

// The display values of the film, the sum of so many samples, and the report. In the view of errors they are
// those of the color.
void frame_fill(FrameLoop *loop, uint32_t samples);
void distances_fill(FrameLoop *loop);

// frame_render.c

// Renders the current request, until another comes. True: its image is complete.
bool request_render(FrameLoop *loop);
// Answers the question about a pixel, if there is one.
void probe_answer(FrameLoop *loop);
void renderers_close(FrameLoop *loop);
// Shows what the device has failed at. The next request opens it again.
void failure_publish(FrameLoop *loop);
// The time of a move to another eye, before one is timed.
double move_guess(const Renderer *renderer);

// scene_reload.c

// Whether the scene's file is what was written into it here.
bool is_own_write(FrameLoop *loop);
// Reads the scene, for the first time or again. False, with a message published, where it has a mistake: the
// last one stays.
bool scene_reload(FrameLoop *loop);
