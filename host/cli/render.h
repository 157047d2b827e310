// glint render, scene by scene: with other ranks' devices, or as one of several processes.
#pragma once

#include "host/cli/ranks.h"

typedef struct RenderCommand RenderCommand;

// NULL: help was asked for, or a mistake is printed, and *status is the exit status.
RenderCommand *render_command_open(int argument_count, char **arguments, int *status);
// Of the devices only one is used: the number modulo their count, see devices_open_one.
void render_command_choose_device(RenderCommand *command, size_t number);

// False with a message, before anything is rendered: an image would overwrite a file that one of several
// scenes is read from. Reads them where an image exists already.
bool render_command_spares_scenes(RenderCommand *command);
// Opens the devices before the first scene is read. False with a message.
bool render_command_open_devices(RenderCommand *command);

size_t render_command_count(const RenderCommand *command); // of scenes
const char *render_command_scene(const RenderCommand *command, size_t index);
const char *render_command_path(const RenderCommand *command, size_t index); // of its image

// Renders one scene; `ranks` or NULL. Returns its exit status.
int render_command_run(RenderCommand *command, size_t index, Ranks *ranks);
// Whether the last scene or the settings did not fit a device, which is a mistake where all are alike.
bool render_command_is_unfit(const RenderCommand *command);
// Adds a scene's status to the command's.
void render_command_note(RenderCommand *command, int status);
// Renders the scenes from `first` on, as far as the command goes on, and notes their statuses: its last work.
void render_command_run_from(RenderCommand *command, size_t first, Ranks *ranks);

// Warns of each device that failed, whose work the others do: the command has not failed.
void render_command_drop_devices(RenderCommand *command);
// Returns the command's exit status.
int render_command_close(RenderCommand *command);
