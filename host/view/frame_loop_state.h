// The state of a FrameLoop, and the functions that its files share.
#pragma once

#include "host/view/frame_loop.h"
#include "host/view/preview.h"
#include "host/view/watch.h"
#include <pthread.h>
#include <stdatomic.h>

// The data that the window's thread and the loop's thread exchange. Every access holds the mutex.
typedef struct {
    FrameRequest request;
    unsigned request_number;
    SceneState scene_state;
    ImageSize scene_size;
    char *save_path, *message;
    Frame ready;
    SceneUpdate update;
    uint32_t probe[2]; // the pixel of the last question
    char *facts;       // the answer
    Text written;      // into the scene's file; the watch has not reported it yet
    bool has_ready, has_update, has_probe, quits;
    bool reloads; // the scene's files have changed, or have not been read
} SharedState;

struct FrameLoop {
    FrameLoopOptions options; // constant
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t changed; // the shared state
    SharedState shared;

    // used by both threads without the mutex
    Stage *stage;
    atomic_bool has_news;     // a request that was not yet read
    atomic_bool first_is_due; // new requests do not end the render
    atomic_bool ends;         // the current render and all later ones

    // owned by the loop's thread
    bool is_mistaken;     // whether the scene's file, as it is now, has a mistake
    bool has_preview;     // the request's first frame is coarse, or of arrays that another eye saw
    uint32_t divisor;     // the coarse frame's
    uint32_t scene_frame; // of the animation, at which the scene was read last
    Scene scene;          // with the request's camera
    Watch *watch;
    RenderSettings settings;
    Compute compute;
    Renderer *renderer;  // NULL: not open, or failed
    Renderer *reference; // in double, for the error view; NULL: not open
    FrameRequest current;
    unsigned current_number;
    double move_seconds, render_start;
    double expected_move; // to another eye, in seconds; decays after a slow move
    Film film; // of the image or the coarse frame; its color is a sum of samples, at the end their mean
    Frame frame;
    Preview preview;
};

// frame_exchange.c

// Returns whether the current render should end. It is the renderers' `stop`, whose context is the loop.
bool render_stops(void *context);

// Called by the thread that watches the scene's files.
void files_changed(void *context);

typedef enum { WORK_RENDER, WORK_SAVE, WORK_PROBE, WORK_RELOAD, WORK_END } Work;

// Waits for the next work and returns it. WORK_SAVE sets the path, which the caller frees.
Work work_wait(FrameLoop *loop, bool can_save, char **save_path);
// Sets the pixel of a question that has no answer yet. Returns false if there is none.
bool probe_acquire(FrameLoop *loop, uint32_t pixel[2]);
// Takes ownership of the facts.
void facts_publish(FrameLoop *loop, char *facts);
// Takes ownership of the message. "" removes the last one; others are appended to those not yet taken.
void message_publish(FrameLoop *loop, char *message);
// Takes ownership of the messages.
void messages_publish(FrameLoop *loop, MessageList *messages);
void frame_publish(FrameLoop *loop, uint32_t samples);
// Publishes the scene. A view that follows the scene's camera gets it. A camera that was changed in the file
// becomes the view's, and the window asks for its image.
void scene_publish(FrameLoop *loop);
// Publishes that the scene cannot be read or rendered.
void refusal_publish(FrameLoop *loop);

// frame_fill.c

// Fills the frame with the film's display values and the report. The film's color is the sum of `samples`
// samples; the error view shows it until the errors are known.
void frame_fill(FrameLoop *loop, uint32_t samples);
void distances_fill(FrameLoop *loop);

// frame_render.c

// Renders the current request until another comes. Returns true if its image is complete.
bool request_render(FrameLoop *loop);
// Answers the question about a pixel, if there is one.
void probe_answer(FrameLoop *loop);
void renderers_close(FrameLoop *loop);
// Publishes the device's failure and closes the device; the next request opens it again.
void failure_publish(FrameLoop *loop);
// Estimates the time of a move to another eye before one was measured.
double move_guess(const Renderer *renderer);

// scene_reload.c

// Returns whether the scene's file is what was written into it here.
bool is_own_write(FrameLoop *loop);
// Reads the scene at the current request's frame, for the first time or again. Returns false with a message
// published if it has a mistake, and keeps the previous scene.
bool scene_reload(FrameLoop *loop);
