// The state of the window, and the functions that its files share.
#pragma once

#include "host/view/caption.h"
#include "host/view/window.h"
#include <SDL.h>

typedef enum { DRAG_NONE, DRAG_ORBIT, DRAG_PAN, DRAG_LOOK, DRAG_TIME } Drag;

typedef struct {
    const WindowOptions *options;
    SDL_Window *window;
    SDL_Renderer *target;
    SDL_Texture *texture; // the frame's pixels
    int texture_width, texture_height;
    Caption *caption;
    FrameLoop *frames;
    Uint32 frame_event;

    ImageSize size; // in pixels, which a point of the window may have several of
    Camera camera;  // follows the scene's own unless it was moved
    SceneUpdate scene;
    uint32_t scene_frame; // the animation's frame of the last or the next request
    View view;
    Precision precision;
    bool camera_changed, scene_frame_changed, image_changed;
    bool is_loaded;         // the scene
    unsigned request;       // the last one
    unsigned image_request; // the last one for another view, precision or size
    Frame frame;

    Drag drag;
    double mouse[2], pan_distance; // in pixels
    Vector3 pivot;                 // the point that was last picked, and where
    double pivot_at[2];
    double flown_seconds; // the moment up to which the camera has flown

    bool plays, key_is_due; // once the scene of its frame was read
    double play_seconds;    // the moment, and the frame of the animation then, from which it plays
    uint32_t play_frame;

    char *message;   // at the bottom, until the next key
    Text stage;      // what keeps the next frame waiting; empty: not shown
    double hover[2]; // the cursor, in pixels
    char *facts;     // of the pixel there; NULL: not shown, or not known yet
    bool shows_facts, facts_are_due, prints_facts;
    unsigned facts_request; // the request whose image they describe
    bool shows_help, shows_times, redraws, closes;
} Window;

// window.c
const char *scene_name(const Window *window);
// Takes the message; NULL shows none.
void message_show(Window *window, char *message);
// Asks for an image if the last one asked for is not what should be shown.
void request_send(Window *window);

// window_mouse.c
// Converts a position in the window's points to pixels.
void position_set(const Window *window, double position[2], int x, int y);
void drag_begin(Window *window, const SDL_MouseButtonEvent *event);
void drag_move(Window *window, const SDL_MouseMotionEvent *event);
void wheel_turn(Window *window, const SDL_MouseWheelEvent *event);
// Moves the camera by the keys that were held since the last call.
void fly(Window *window);

// window_time.c
bool has_time_line(const Window *window);
// Shows a frame of the animation. Numbers before the first frame and behind the last wrap around.
void scene_frame_show(Window *window, int64_t frame);
void play_toggle(Window *window);
// Shows the frame that is due, once the last one is shown.
void play(Window *window);
int time_line_height(const Window *window); // in pixels; 0: there is none
// Returns whether a position in pixels is in the time line.
bool is_in_time_line(const Window *window, const double at[2]);
// Shows the frame at a position.
void time_line_follow(Window *window, const double at[2]);
void time_line_draw(const Window *window);

// window_keys.c
// Records the camera at this frame of the animation if asked to and once the scene of the frame was read.
void key_record(Window *window);
void key_press(Window *window, const SDL_KeyboardEvent *event);

// window_draw.c
void frame_show(Window *window); // from the next drawing on
// Sets the text of the loop's current stage if that takes long.
void stage_show(Window *window);
void window_draw(Window *window);
