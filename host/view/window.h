// The window of glint view. It shows what a FrameLoop renders, and turns mouse and keys into requests.
#pragma once

#include "host/view/frame_loop.h"

typedef struct {
    FrameLoopOptions frames;     // all but notify
    ImageSize size;              // of the window, reduced to fit the display, or 0 for the scene's own
    bool (*stop)(void *context); // returns true to end it, at an interrupt
    void *stop_context;
} WindowOptions;

typedef enum { WINDOW_CLOSED, WINDOW_STOPPED, WINDOW_ABSENT, WINDOW_REFUSED } WindowEnd;

// Opens the window and returns when it is closed. Returns WINDOW_ABSENT if it cannot be opened and
// WINDOW_REFUSED if the scene's file has a mistake, with the reason printed.
WindowEnd window_run(const WindowOptions *options);
