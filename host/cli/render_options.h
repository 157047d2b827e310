// Reads the options of `glint render`.
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
    ImageOutputOptions output; // with several scenes, its path is their folder
    uint32_t width, height;    // 0 if not given
    uint32_t sample_count, bounce_count;
    uint32_t region[4]; // x, y, width, height
    bool has_region, has_transfer, quiet;
    ErrorBudget budget; // a limit of 0 means none
    TimingStyle timing;
} RenderOptions;

// Returns OPTIONS_READ, or the exit status if help was requested or a usage fault was printed.
int render_options_read(RenderOptions *options, int argument_count, char **arguments);

// Sets the settings for one scene. Chooses the size and region if the options leave them open. Returns false
// with a message if the options do not fit the scene.
bool render_settings_make(RenderSettings *settings, RenderOptions *options, const Scene *scene);
