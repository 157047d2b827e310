// Runs glint render scene by scene, with other ranks' devices or as one of several processes.
#pragma once

#include "host/cli/render_devices.h"
#include "host/cli/render_options.h"

typedef struct {
    RenderOptions options;
    size_t count;       // images: scenes, or frames of one
    char **paths;       // of the images
    RenderDevices open; // is_single and number may be set before it is opened
    int status;         // of the images so far
} RenderCommand;

// Reads the command line. Returns NULL and sets *status to the exit status if help was requested or a mistake
// was printed.
RenderCommand *render_command_open(int argument_count, char **arguments, int *status);

// Returns false with a message, before anything is rendered, if an image would overwrite a file that one of
// several scenes is read from. Reads only the scenes whose image exists.
bool render_command_check_overwrites(RenderCommand *command);
const char *render_command_scene(const RenderCommand *command, size_t index);

// Renders one image and returns its exit status. `ranks` may be NULL.
int render_command_run(RenderCommand *command, size_t index, Ranks *ranks);
// Merges a scene's status into the command's.
void render_command_record(RenderCommand *command, int status);
// Renders the scenes from `first` on until the command ends, and merges their statuses. Only the functions
// below may be called afterwards.
void render_command_run_from(RenderCommand *command, size_t first, Ranks *ranks);

// Warns of each failed device whose share the others rendered, which is not a failure of the command.
void render_command_drop_devices(RenderCommand *command);
// Returns the command's exit status.
int render_command_close(RenderCommand *command);
