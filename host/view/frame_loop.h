// Renders what the window shows on a separate thread. While the camera moves, it renders coarse frames, and
// at rest the image in rounds until it has all samples. A new request ends the work on the previous one. The
// scene is re-read when its files change and for another frame of an animation.
#pragma once

#include "host/image/image.h"
#include "host/import/load.h"
#include "host/render/renderer.h"
#include "host/view/camera_moves.h"
#include "host/view/views.h"

// An image that has all its samples, with what rendered it.
typedef struct {
    const Scene *scene;
    const RenderSettings *settings;
    Renderer *renderer;
    const Film *film;
} CompleteImage;

typedef struct {
    const Device *device;
    const char *scene_path;
    SceneOptions scene_options;
    bool writes_camera;      // whether frame_loop_write_camera may be called; the camera's file is YAML
    RenderSettings settings; // of everything but the size
    // Called on the loop's thread when there is something to acquire.
    void (*notify)(void *context);
    void *notify_context;
    // Writes the color of a complete image in the precision of its render. Returns false with a message if
    // it cannot.
    bool (*save)(void *context, const char *path, const CompleteImage *image, MessageList *messages);
    void *save_context;
} FrameLoopOptions;

// Returns the path of the file that has the camera.
static inline const char *camera_path(const FrameLoopOptions *options)
{
    return options->scene_options.camera ? options->scene_options.camera : options->scene_path;
}

typedef struct {
    unsigned number; // of the request
    uint32_t width, height;
    uint8_t *pixels; // display values, RGB, from the top left
    // The distance from the eye to each pixel's hit point, infinite where nothing is hit, or NULL until it is
    // known.
    float *distances;
    uint32_t samples;     // per pixel, or 0 for a coarse frame
    double largest_error; // of a heat map of errors, or negative for another frame
    char *summary;        // lines with the device, the precision, the samples and the times
} Frame;

void frame_free(Frame *frame); // and zeroes

typedef struct FrameLoop FrameLoop;

// Opens a loop, which starts to read the scene.
FrameLoop *frame_loop_open(const FrameLoopOptions *options);
// Ends the work and waits for it.
void frame_loop_close(FrameLoop *loop);

// Appends the stage of the work that the next frame waits for, such as "reading bunny.obj 41%", and sets the
// seconds since that work began. Returns false if there is none.
bool frame_loop_stage(FrameLoop *loop, Text *text, double *seconds);

typedef struct {
    Camera camera;
    bool follows_scene;   // replaces the camera by the scene's own at that frame
    uint32_t scene_frame; // of the animation
    ImageSize size;
    View view;
    Precision precision;
    bool is_moving; // a coarse frame first
} FrameRequest;

// Asks for an image of the scene that was loaded. Returns the request's number, from 1.
unsigned frame_loop_request(FrameLoop *loop, const FrameRequest *request);
// Asks for the color of the last request's image to be saved when it is complete.
void frame_loop_save(FrameLoop *loop, const char *path);

// Asks what a pixel of the last request's image sees. The answer is among the loop's news.
void frame_loop_probe(FrameLoop *loop, uint32_t x, uint32_t y);

// Writes the camera into the scene's file, which is not re-read because of that. With a `frame`, writes keys
// there. Returns false with messages if it cannot.
bool frame_loop_write_camera(FrameLoop *loop, const Camera *camera, const uint32_t *frame,
                             MessageList *messages);

// A scene is refused if its file has a mistake, which the message states, and no scene was read before.
typedef enum { SCENE_LOADING, SCENE_LOADED, SCENE_REFUSED } SceneState;

// The scene that was read last.
typedef struct {
    SceneState state;     // the other members are set once it is loaded
    ImageSize size;       // of its image
    Camera camera;        // the scene's own
    bool has_new_camera;  // differs from the previous one of the same frame, or is the first
    uint32_t frame;       // of the animation
    uint32_t frame_count; // 0 if it is not given or if the file cannot be re-read, as standard input
    double frame_rate;    // 0 if it is not given
} SceneUpdate;

// What has changed since the last call of frame_loop_acquire.
typedef struct {
    bool has_frame, has_scene;
    char *facts;   // the answer to the last question, or NULL
    char *message; // messages about mistakes, failures and saved images, "" if a mistake was fixed, or NULL
} LoopNews;

// Exchanges `frame` for the newest one, and sets `scene` to the scene that was read or refused last, if they
// are new. The caller frees the texts.
LoopNews frame_loop_acquire(FrameLoop *loop, Frame *frame, SceneUpdate *scene);
