// The devices of a command's images, and a renderer on each.
#pragma once

#include "host/cli/options.h"
#include "host/cli/ranks.h"

typedef struct {
    OpenDevices devices;
    Renderer **renderers; // as many; NULL, or with the last image's scene or only its kernels
    bool is_open;
    bool is_single;                 // only one of those that are listed, see devices_open_one
    size_t number;                  // of that one
    const char *reference_selector; // NULL: not given
    bool is_unfit;                  // the last image's settings or scene do not fit a device
} RenderDevices;

// Opens the devices that the options select and applies --work-group and --build-options. Returns true if
// they are already open; false with a message if there is none or one does not allow the work-group.
bool render_devices_open(RenderDevices *open, const CommonOptions *common);
// Gives their renderers, and the ranks, another scene. If others are left, those that fail are removed, and
// of all devices those that the scene or settings do not fit. False: with messages, these do not fit a
// device, else the device failed.
bool render_devices_start(RenderDevices *open, const Scene *scene, const RenderSettings *settings,
                          const Ranks *ranks, MessageList *messages);
// After an image: frees its scene, and removes the devices that failed while others are left.
void render_devices_rest(RenderDevices *open);
// False: the last one failed.
bool render_devices_work(const RenderDevices *open);
// As devices_close.
int render_devices_close(RenderDevices *open, int status);
