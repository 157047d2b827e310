// The options of `glint render`.
#pragma once

#include "host/cli/image_output.h"
#include "host/cli/options.h"
#include "host/cli/timing.h"

typedef struct {
    CommonOptions common;
    char **scenes;
    size_t scene_count;
    const char *scene; // the one that is rendered
    const char *checkpoint;
    ImageOutputOptions output; // path: of several scenes, their folder
    uint32_t width, height;    // 0: not given
    uint32_t sample_count, bounce_count;
    uint32_t region[4]; // x, y, width, height
    bool has_region, has_transfer, quiet;
    ErrorBudget budget; // limit 0: none
    TimingStyle timing;
} RenderOptions;

// OPTIONS_READ, or the exit status: help was asked for, or a usage fault is printed.
int render_options_read(RenderOptions *options, int argument_count, char **arguments);

// Of one scene; chooses the size and region that the options leave to it. False with a message.
bool render_settings_make(RenderSettings *settings, RenderOptions *options, const Scene *scene);
