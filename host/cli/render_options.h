// Reads the options of `glint render`.
#pragma once

#include "host/cli/image_output.h"
#include "host/cli/options.h"
#include "host/cli/timing.h"
#include "host/measure/error_budget.h"

typedef struct {
    CommonOptions common;
    CommandOperands scenes;
    const char *scene;         // the current scene
    const char *checkpoint;    // the file, or a pattern for several frames
    ImageOutputOptions output; // the path is a folder for several scenes, and a pattern for several frames
    uint32_t sample_count;
    uint32_t region[4];                // x, y, width, height
    uint32_t first_frame, frame_count; // of an animation; a count of 0 if not given
    bool has_all_frames, has_region, has_transfer, has_format, quiet, skips_existing;
    bool has_several;   // whether there are several scenes or frames
    ErrorBudget budget; // a limit of 0 means none
    TimingStyle timing;
} RenderOptions;

// Returns OPTIONS_READ, or the exit status if help was requested or a usage fault was printed.
int render_options_read(RenderOptions *options, int argument_count, char **arguments);

// The place of the frame's number in a pattern of names, which is %d, or %0Nd for at least N digits.
typedef struct {
    const char *start, *end; // of the directive, or NULL if there is none
    int digits;
} FramePlace;

// Finds the first directive in the name of a file, not in those of its folders.
FramePlace frame_place_of(const char *pattern);

// Returns whether the output is a folder, for several images.
bool output_is_folder(const char *path);

// Sets the settings for one scene. If the options leave the size open, chooses it and stores it in them, so
// that all times of a shutter have the same. Returns false with a message if the region does not fit.
bool render_settings_make(RenderSettings *settings, RenderOptions *options, const Scene *scene);
