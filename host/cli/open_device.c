#include "host/cli/open_device.h"

#include "host/base/array.h"
#include "host/base/exit_status.h"
#include <stdio.h>
#include <stdlib.h>

static void warnings_print(void *context, MessageList *warnings)
{
    (void)context;
    message_list_print(warnings, stderr);
}

WarningReceiver device_warnings = {.deliver = warnings_print};

const Device *device_find(DeviceList *devices, const char *selector)
{
    device_list_open(devices, &device_warnings);
    PrintedMessages messages = {0};
    return device_choose(devices, device_selector(selector), &messages);
}

const Device *device_choose_numbered(const DeviceList *devices, const char *selector, size_t number,
                                     MessageList *messages)
{
    const char *listed = device_selector(selector);
    OWNED const Device **chosen = NULL;
    const Device *first = listed ? NULL : device_choose(devices, NULL, messages);
    if (!listed && !first) return NULL;
    const size_t count = devices_choose(devices, listed ? listed : "all", &chosen, messages);
    size_t kept = 0;
    for (size_t i = 0; i < count; i++)
        if (!first || chosen[i]->type == first->type) chosen[kept++] = chosen[i];
    return kept > 0 ? chosen[number % kept] : NULL;
}

void devices_apply_options(DeviceList *devices, const CommonOptions *common)
{
    for (size_t i = 0; i < devices->count; i++) {
        devices->items[i].build_options = common->driver.build_options;
        devices->items[i].work_group[0] = common->driver.work_group[0];
        devices->items[i].work_group[1] = common->driver.work_group[1];
        devices->items[i].kernel_folder = common->driver.kernel_folder;
        devices->items[i].capture_folder = common->driver.capture_folder;
    }
}

// Pixels of a list and rays are launched in one dimension, so the first side must allow all of a group's
// work-items.
bool work_group_is_allowed(const Device *device)
{
    const size_t *group = device->work_group, *longest = device->longest_group_sides;
    const size_t items = group[0] * group[1], allowed = device->largest_work_group;
    const bool is_allowed = (allowed == 0 || items <= allowed) && (longest[0] == 0 || items <= longest[0]) &&
                            (longest[1] == 0 || group[1] <= longest[1]);
    if (is_allowed) return true;
    fprintf(stderr, "glint: --work-group: %zux%zu has %zu work-items; \"%s\" allows ", group[0], group[1],
            items, device->name);
    if (allowed > 0) fprintf(stderr, "%zu in a group%s", allowed, longest[0] > 0 ? ", " : "");
    if (longest[0] > 0) fprintf(stderr, "at most %zu by %zu", longest[0], longest[1]);
    fputc('\n', stderr);
    return false;
}

bool device_open(OpenDevice *open, const CommonOptions *common)
{
    *open = (OpenDevice){0};
    const Device *device = device_find(&open->devices, common->device);
    devices_apply_options(&open->devices, common);
    if (!device || !work_group_is_allowed(device)) {
        device_list_close(&open->devices);
        return false;
    }
    compute_open(&open->compute, device);
    return true;
}

bool reference_open(Compute *compute, const DeviceList *devices, const char *selector)
{
    const Device *device = compute->device;
    if (compute->reference || (!selector && device->fp64) || !compute_ok(compute)) return true;
    MessageList messages = {0};
    const Device *reference = device_choose_reference(devices, selector, &messages);
    messages_print(&messages, NULL);
    if (!reference) return !selector;
    if (!selector)
        stderr_print("\"%s\" computes in double for \"%s\", which has no 64-bit floating point%s",
                     reference->name, device->name, device_fp64_hint(device));
    if (reference != device) compute_open_reference(compute, reference);
    return true;
}

// Computes that are released only when the process ends. They are listed so that LeakSanitizer does not
// report them as leaks.
static ARRAY_OF(Compute) left;

int compute_end(Compute *compute, int status)
{
    OWNED char *unmap_failure = compute_unmap_failure_text(compute);
    if (compute_ok(compute) && unmap_failure) stderr_print("warning: %s", unmap_failure);
    if (!compute_ok(compute)) {
        OWNED char *failure = compute_failure_text(compute);
        stderr_print("%s", failure);
        status = EXIT_MACHINE;
    } else if (status != EXIT_INTERRUPTED) {
        array_push(left, *compute);
        *compute = (Compute){0};
    }
    compute_close(compute);
    return status;
}

int device_close(OpenDevice *open, int status)
{
    status = compute_end(&open->compute, status);
    device_list_close(&open->devices);
    return status;
}
