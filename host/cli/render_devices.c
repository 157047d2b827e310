#include "host/cli/render_devices.h"

#include "host/base/memory.h"
#include <stdio.h>
#include <stdlib.h>

bool render_devices_open(RenderDevices *open, const CommonOptions *common)
{
    const char *selector = common->device;
    if (open->is_open) return true;
    MessageList messages = {0};
    open->is_open = open->is_single ? devices_open_one(&open->devices, selector, open->number, &messages)
                                    : devices_open(&open->devices, selector);
    messages_print(&messages, NULL);
    if (open->is_open && !devices_apply_options(&open->devices, common)) {
        devices_abandon(&open->devices);
        open->devices = (OpenDevices){0};
        open->is_open = false;
    }
    if (open->is_open) open->renderers = memory_allocate_zeroed(open->devices.count, sizeof(Renderer *));
    return open->is_open;
}

// Prints why devices cannot render the image, and that the others render their share.
static void unfit_print(MessageList *unfit)
{
    for (size_t i = 0; i < unfit->count; i++)
        if (unfit->items[i].severity == MESSAGE_ERROR)
            fprintf(stderr, "glint: warning: the other devices continue without it: %s\n",
                    unfit->items[i].text);
    message_list_free(unfit);
}

bool render_devices_start(RenderDevices *open, const Scene *scene, const RenderSettings *settings,
                          const Ranks *ranks, MessageList *messages)
{
    Renderer **renderers = open->renderers;
    OpenDevices *devices = &open->devices;
    const size_t count = devices->count;
    Compute **computes = memory_allocate(count, sizeof *computes);
    MessageList *of_each = memory_allocate_zeroed(count, sizeof *of_each), unfit = {0};
    open->is_unfit = false;
    for (size_t i = 0; i < count; i++) {
        computes[i] = devices->items[i].compute;
        if (settings->precision == PRECISION_CERTIFIED &&
            !reference_open(computes[i], &devices->devices, open->reference_selector) &&
            open->reference_selector) {
            open->is_unfit = true;
            free(computes);
            free(of_each);
            return false;
        }
    }
    const RendererSet set = {renderers, computes, of_each, count};
    bool is_done = renderers_open(&set, scene, settings, ranks ? &ranks->remote : NULL, messages);
    for (size_t i = 0, kept = 0; i < count; i++) {
        Renderer *renderer = renderers[i];
        const bool fits = message_count(&of_each[i], MESSAGE_ERROR) == 0;
        const bool is_dispensable = is_done && devices->count > 1 && (fits || devices->are_all);
        message_list_move(renderer || !is_dispensable ? messages : &unfit, &of_each[i]);
        if (renderer || !is_dispensable) {
            open->is_unfit = open->is_unfit || !fits;
            renderers[kept++] = renderer;
            is_done = is_done && renderer;
        } else {
            if (fits) devices_drop(devices, kept);
            devices_remove(devices, kept);
        }
    }
    unfit_print(&unfit);
    free(of_each);
    free(computes);
    return is_done;
}

void render_devices_rest(RenderDevices *open)
{
    OpenDevices *devices = &open->devices;
    size_t kept = 0;
    for (size_t i = 0, count = devices->count; i < count; i++) {
        Renderer *renderer = open->renderers[i];
        if (devices->items[kept].is_dropped) {
            renderer_close(renderer);
            devices_remove(devices, kept);
        } else {
            renderer_release_scene(renderer);
            open->renderers[kept++] = renderer;
        }
    }
}

bool render_devices_work(const RenderDevices *open)
{
    for (size_t i = 0; i < open->devices.count; i++)
        if (!open->devices.items[i].is_dropped && !compute_ok(open->devices.items[i].compute)) return false;
    return true;
}

int render_devices_close(RenderDevices *open, int status)
{
    if (!open->is_open) return status;
    for (size_t i = 0; i < open->devices.count; i++)
        renderer_close(open->renderers[i]);
    free(open->renderers);
    return devices_close(&open->devices, status);
}
