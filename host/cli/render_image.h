// Renders one image of glint render into a file.
#pragma once

#include "host/cli/ranks.h"
#include "host/cli/render_devices.h"
#include "host/cli/render_options.h"

// Renders options.scene into the file `path`. `ranks` may be NULL. Prints failures and returns the exit
// status.
int image_file_render(RenderOptions options, const char *path, RenderDevices *open, Ranks *ranks);
