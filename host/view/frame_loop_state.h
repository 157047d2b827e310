// The state of a FrameLoop, and the functions that its files share.
#pragma once

#include "host/view/frame_loop.h"
#include "host/view/preview.h"
#include "host/view/watch.h"
#include <pthread.h>
#include <stdatomic.h>

// The states of the loop's thread. state_run does the work of each and returns the next one:
//
//     WAIT ──files changed──▶ RELOAD ──image due──▶ BEGIN
//       ├────request────────▶ BEGIN ──coarse frame first──▶ PREVIEW ──▶ REST ──▶ ROUNDS
//       │                       └─────full size at once───────────────────────▶ ROUNDS ──error view──▶ ERRORS
//       ├────question───────▶ PROBE
//       ├────complete image─▶ SAVE
//       └────closed─────────▶ END
//
// A state returns to WAIT when its work is done and no arrow continues, when the device failed and, from
// PREVIEW to ERRORS, when a request, a changed file or the end of the loop ended the render.
typedef enum {
    LOOP_WAIT,    // reports a failure of the device, and waits for work
    LOOP_RELOAD,  // re-reads the scene, because one of its files changed
    LOOP_BEGIN,   // starts on the request, and reads the scene if the request is for another of its frames
    LOOP_PREVIEW, // renders a coarse frame
    LOOP_REST,    // waits until the camera rests
    LOOP_ROUNDS,  // renders the image in rounds
    LOOP_ERRORS,  // replaces the image by its heat map of errors
    LOOP_PROBE,   // answers a question about a pixel
    LOOP_SAVE,    // saves the image
    LOOP_END
} LoopState;

// The data that the threads exchange, by the invariants of frame_exchange.c.
typedef struct {
    FrameRequest request;
    unsigned request_number;
    char *save_path, *message;
    Frame ready;
    SceneUpdate update;
    uint32_t probe[2]; // the pixel of the last question
    char *facts;       // the answer
    Text camera_text;  // of the camera's file, as the scene was read from it or as the window wrote it
    bool is_written;   // by the window, since the scene was read
    bool is_stale;     // others have changed the scene's files since they were read
    bool has_ready, has_update, has_probe;
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
    atomic_bool has_news;     // a request or a changed file that was not yet read
    atomic_bool first_is_due; // a moving camera's first frame, for which news does not end the render
    atomic_bool ends;         // the loop, and so the current render

    // owned by the loop's thread
    bool is_mistaken;     // whether the scene's file, as it is now, has a mistake
    bool is_complete;     // the current request's image of the scene has all samples
    bool has_preview;     // the request's first frame is coarse, or of arrays that another eye saw
    uint32_t divisor;     // the coarse frame's
    uint32_t scene_frame; // of the animation, at which the scene was read last
    Scene scene;          // with the request's camera
    Watch *watch;
    RenderSettings settings;
    Compute compute;
    Renderer *renderer;  // NULL if it is not open or has failed
    Renderer *reference; // in double, for the error view, or NULL
    FrameRequest current;
    unsigned current_number;
    double move_seconds, render_start;
    double expected_move; // to another eye, in seconds; decays after a slow move
    Film film; // of the image or the coarse frame; its color is a sum of samples, at the end their mean
    Frame frame;
    Preview preview;
};

// frame_exchange.c

void exchange_open(FrameLoop *loop);
// Ends the current render and the loop.
void exchange_quit(FrameLoop *loop);
// Frees what was not acquired. The loop's thread must have ended.
void exchange_close(FrameLoop *loop);

// Returns whether the current render should end. It is the renderers' `stop`, whose context is the loop.
bool render_stops(void *context);

// Records that a file of the scene changed. The thread that watches the files calls it with the loop.
void file_changed(void *context, const char *path);

// Waits for the next work and returns its state. LOOP_BEGIN has then read the request.
LoopState work_wait(FrameLoop *loop);
// Waits for that long unless the current render should end. Returns whether it should.
bool news_await(FrameLoop *loop, long nanoseconds);
// Returns the path to which the image is to be saved. The caller frees it.
char *save_path_acquire(FrameLoop *loop);
// Sets the pixel of a question that has no answer yet. Returns false if there is none.
bool probe_acquire(FrameLoop *loop, uint32_t pixel[2]);
// Takes ownership of the facts.
void facts_publish(FrameLoop *loop, char *facts);
// Takes ownership of the message. "" removes the last one; others are appended to one that the window has not
// acquired.
void message_publish(FrameLoop *loop, char *message);
// Takes ownership of the messages.
void messages_publish(FrameLoop *loop, MessageList *messages);
void frame_publish(FrameLoop *loop, uint32_t samples);
// Publishes the scene. A view that follows the scene's camera gets it. A camera that was changed in the file
// becomes the view's, and the window asks for its image.
void scene_publish(FrameLoop *loop);
// Publishes that the scene cannot be read or rendered.
void refusal_publish(FrameLoop *loop);
// Records that the scene's files are about to be read. Takes ownership of the camera file's text.
void reading_begin(FrameLoop *loop, Text camera_text);
// Exchanges the text that is being written into the camera's file, and the camera that it has, for the shared
// ones. `old` is the text that it is derived from.
void written_store(FrameLoop *loop, const Text *old, Text *written, Camera *camera);
// Exchanges them back, because the write failed.
void written_restore(FrameLoop *loop, Text *written, Camera *camera);
// Returns whether the window's write of this text into the camera's file is all that changed in the scene's
// files since they were read.
bool written_matches(FrameLoop *loop, const Text *camera_text);

// frame_fill.c

// Fills the frame with the film's display values and the report. The film's color is the sum of `samples`
// samples; the error view shows it until the errors are known.
void frame_fill(FrameLoop *loop, uint32_t samples);
void distances_fill(FrameLoop *loop);

// frame_render.c

// Chooses how the current request begins. Returns true if that is by a preview.
bool request_begin(FrameLoop *loop);
// Return false if the render was ended or failed. errors_render follows rounds_render.
bool preview_render(FrameLoop *loop);
bool rounds_render(FrameLoop *loop);
bool errors_render(FrameLoop *loop);
// Waits until no request has come for a while if a move to another eye takes long, as in a large scene.
// Returns false if one came.
bool camera_rests(FrameLoop *loop);
// Answers the question about a pixel, if there is one.
void probe_answer(FrameLoop *loop);
void renderers_close(FrameLoop *loop);
// Publishes the device's failure and closes the device; the next request opens it again.
void failure_publish(FrameLoop *loop);
// Estimates the time of a move to another eye before one was measured.
double move_guess(const Renderer *renderer);

// scene_reload.c

// Returns whether only the window has changed the scene's files since they were read.
bool is_own_write(FrameLoop *loop);
// Reads the scene at the current request's frame, for the first time or again. Returns false with a message
// published if it has a mistake, and keeps the previous scene.
bool scene_reload(FrameLoop *loop);
