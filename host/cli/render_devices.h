// The devices of a command's images, with a renderer on each.
#pragma once

#include "host/cli/open_device.h"
#include "host/cli/ranks.h"

typedef struct {
    DeviceList list;
    struct {
        Compute *compute;
        bool is_dropped; // whether it failed and the other devices did its work
    } * items;
    Renderer **renderers; // one per device, with the last image's scene or only its kernels; may be NULL
    size_t count;
    bool is_open;
    bool are_all;   // whether "all" chose them, so that devices that do not suit a render are omitted
    bool is_single; // opens only one device, by device_choose_numbered
    size_t number;  // of that device
    const char *reference_selector; // NULL if not given
    bool has_warned_of_frames;
    bool is_unfit; // whether the last image's settings or scene did not fit a device
} RenderDevices;

// Opens the devices that the options select and applies the options to them, unless they are open. Returns
// false with a message if there is none or one does not allow the work-group.
bool render_devices_open(RenderDevices *open, const CommonOptions *common);
// Opens the renderers of the devices and of the ranks with another scene. As long as others are left, removes
// the devices that failed and, with --device all, those that the scene or settings do not fit. Returns false
// with messages if the scene or settings do not fit a device, and false with no message if the device failed.
bool render_devices_start(RenderDevices *open, const Scene *scene, const RenderSettings *settings,
                          const Ranks *ranks, MessageList *messages);
// Warns that a device failed and that the others render its share.
void render_devices_drop(RenderDevices *open, size_t index);
// Frees an image's scene, and removes the devices that failed while others are left.
void render_devices_release(RenderDevices *open);
// Returns whether every device that was not dropped works.
bool render_devices_work(const RenderDevices *open);
// Closes the devices. Returns EXIT_MACHINE with a message if a device that was not dropped failed, otherwise
// `status`.
int render_devices_close(RenderDevices *open, int status);
