// The state of the window, and the functions that its files share.
#pragma once

#include "host/view/caption.h"
#include "host/view/window.h"
#include <SDL.h>

typedef enum { DRAG_NONE, DRAG_ORBIT, DRAG_PAN, DRAG_LOOK, DRAG_TIME } Drag;

// The SDL objects of the window.
typedef struct {
    SDL_Window *window;
    SDL_Renderer *renderer;
    SDL_Texture *texture; // the frame's pixels
    Caption *caption;
    Uint32 frame_event;
} Screen;

typedef struct {
    Drag drag;
    double at[2], pan_distance; // in pixels
    Vector3 pivot;              // the point that was last picked, and where
    double pivot_at[2];
    double flown_seconds; // the moment up to which the camera has flown
} Mouse;

typedef struct {
    bool is_running, key_is_due; // a key is recorded once the scene of its frame was read
    double start_seconds;        // the moment, and the frame of the animation then, from which it plays
    uint32_t start_frame;
} Play;

// The facts of the pixel under the cursor.
typedef struct {
    double at[2];     // the cursor, in pixels
    char *text;       // NULL if not shown or not known yet
    unsigned request; // the request whose image the text describes
    bool are_shown;
    bool needs_probe; // the loop has not been asked about the pixel
    bool prints_next; // the next text is also printed on standard output
} PixelFacts;

// All of it is owned by the window's thread. The FrameLoop has what the thread that renders owns and what
// both share.
typedef struct {
    const WindowOptions *options;
    FrameLoop *frames;
    Screen screen;

    FrameRequest wanted;    // the image to show, whose camera is the scene's until the user moves it
    FrameRequest sent;      // the last request; the next one is due once `wanted` differs from it
    unsigned request;       // its number, 0 before the first
    unsigned image_request; // the number of the last one for another view, precision or size
    bool resends;           // the next one is due even if `wanted` equals `sent`

    // what the loop has delivered
    SceneUpdate scene;
    Frame frame;

    Mouse mouse;
    Play play;
    PixelFacts facts;
    char *message; // at the bottom, until the next key
    Text stage;    // what keeps the next frame waiting, or empty
    bool shows_help, shows_times, redraws, closes;
} Window;

// window.c
const char *scene_name(const Window *window);
// Takes the message; NULL shows none.
void message_show(Window *window, char *message);
// Returns whether `wanted` must be requested.
bool request_is_due(const Window *window);
// Sends a request if it is due.
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
int time_line_height(const Window *window); // in pixels, or 0 if there is none
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
