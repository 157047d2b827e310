#include "host/cli/render_devices.h"

#include "host/base/memory.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool render_devices_open(RenderDevices *open, const CommonOptions *common)
{
    if (open->is_open) return true;
    const char *selector = device_selector(common->device);
    MessageList messages = {0};
    const Device *single = NULL;
    OWNED const Device **listed = NULL;
    device_list_open(&open->list, &device_warnings);
    devices_apply_options(&open->list, common);
    if (open->is_single)
        single = device_choose_numbered(&open->list, selector, open->number, &messages);
    else
        open->count = devices_choose(&open->list, selector, &listed, &messages);
    if (single) open->count = 1;
    messages_print(&messages, NULL);
    const Device *const *devices = single ? &single : listed;
    open->is_open = open->count > 0;
    for (size_t i = 0; i < open->count; i++)
        open->is_open = open->is_open && work_group_is_allowed(devices[i]);
    if (open->is_open) {
        open->are_all = !single && selector && strcasecmp(selector, "all") == 0;
        open->reference_selector = common->reference_device;
        open->items = memory_allocate_zeroed(open->count, sizeof *open->items);
        open->renderers = memory_allocate_zeroed(open->count, sizeof *open->renderers);
        for (size_t i = 0; i < open->count; i++) {
            open->items[i].compute = memory_allocate(1, sizeof *open->items[i].compute);
            compute_open(open->items[i].compute, devices[i]);
        }
    } else {
        open->count = 0;
        device_list_close(&open->list);
    }
    return open->is_open;
}

void render_devices_drop(RenderDevices *open, size_t index)
{
    OWNED char *failure = compute_failure_text(open->items[index].compute);
    stderr_print("warning: %s; the other devices render its share", failure);
    open->items[index].is_dropped = true;
}

// Closes a device that no renderer uses. Later devices move up.
static void device_remove(RenderDevices *open, size_t index)
{
    compute_close(open->items[index].compute);
    free(open->items[index].compute);
    open->count--;
    memmove(&open->items[index], &open->items[index + 1], (open->count - index) * sizeof *open->items);
}

// Prints why devices cannot render the image, and that the others render their share.
static void unfit_print(const MessageList *unfit)
{
    for (size_t i = 0; i < unfit->count; i++)
        if (unfit->items[i].severity == MESSAGE_ERROR)
            stderr_print("warning: %s; the other devices render its share", unfit->items[i].text);
}

bool render_devices_start(RenderDevices *open, const Scene *scene, const RenderSettings *settings,
                          const Ranks *ranks, MessageList *messages)
{
    Renderer **renderers = open->renderers;
    const size_t count = open->count;
    OWNED Compute **computes = memory_allocate(count, sizeof *computes);
    OWNED MessageList *of_each = memory_allocate_zeroed(count, sizeof *of_each);
    OwnedMessageList unfit = {0};
    open->is_unfit = false;
    for (size_t i = 0; i < count; i++) {
        computes[i] = open->items[i].compute;
        if (settings->precision == PRECISION_CERTIFIED &&
            !reference_open(computes[i], &open->list, open->reference_selector)) {
            open->is_unfit = true;
            return false;
        }
    }
    const RendererSet set = {renderers, computes, of_each, count};
    bool is_done = renderers_open(&set, scene, settings, ranks ? &ranks->remote : NULL, messages);
    for (size_t i = 0, kept = 0; i < count; i++) {
        Renderer *renderer = renderers[i];
        const bool fits = message_count(&of_each[i], MESSAGE_ERROR) == 0;
        const bool is_dispensable = is_done && open->count > 1 && (fits || open->are_all);
        message_list_move(renderer || !is_dispensable ? messages : &unfit, &of_each[i]);
        if (renderer || !is_dispensable) {
            open->is_unfit = open->is_unfit || !fits;
            renderers[kept++] = renderer;
            is_done = is_done && renderer;
        } else {
            if (fits) render_devices_drop(open, kept);
            device_remove(open, kept);
        }
    }
    unfit_print(&unfit);
    return is_done;
}

void render_devices_release(RenderDevices *open)
{
    size_t kept = 0;
    for (size_t i = 0, count = open->count; i < count; i++) {
        Renderer *renderer = open->renderers[i];
        if (open->items[kept].is_dropped) {
            renderer_close(renderer);
            device_remove(open, kept);
        } else {
            renderer_release_scene(renderer);
            open->renderers[kept++] = renderer;
        }
    }
}

bool render_devices_work(const RenderDevices *open)
{
    for (size_t i = 0; i < open->count; i++)
        if (!open->items[i].is_dropped && !compute_ok(open->items[i].compute)) return false;
    return true;
}

int render_devices_close(RenderDevices *open, int status)
{
    if (!open->is_open) return status;
    for (size_t i = 0; i < open->count; i++)
        renderer_close(open->renderers[i]);
    for (; open->count > 0; device_remove(open, 0))
        if (!open->items[0].is_dropped) status = compute_end(open->items[0].compute, status);
    free(open->renderers);
    free(open->items);
    device_list_close(&open->list);
    return status;
}
