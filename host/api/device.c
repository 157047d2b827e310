#include "host/api/handles.h"

#include "host/base/memory.h"
#include <stdlib.h>

static void info_set(GlintDeviceInfo *info, const Device *device)
{
    GlintDeviceInfo full = {.index = device->index,
                            .compute_units = device->compute_units,
                            .memory_bytes = device->memory_bytes,
                            .is_gpu = (device->type & CL_DEVICE_TYPE_GPU) != 0,
                            .is_cpu = (device->type & CL_DEVICE_TYPE_CPU) != 0,
                            .has_double = device->fp64,
                            .is_usable = device_usable(device, NULL)};
    snprintf(full.name, sizeof full.name, "%s", device->name);
    snprintf(full.platform, sizeof full.platform, "%s", device->platform_name);
    snprintf(full.driver, sizeof full.driver, "%s", device->driver);
    struct_write(info, &full, sizeof full);
}

GlintStatus glint_devices_list(GlintDeviceInfo *infos, size_t capacity, size_t *count, char **messages)
{
    MessageList list = {0};
    DeviceList devices;
    device_list_open(&devices, NULL);
    *count = devices.count;
    const bool is_sound =
        capacity == 0 || struct_has_size(infos, sizeof infos->size, "GlintDeviceInfo", &list);
    const size_t stride = infos ? infos->size : 0;
    for (size_t i = 0; is_sound && i < devices.count && i < capacity; i++) {
        GlintDeviceInfo *info = (GlintDeviceInfo *)(void *)((char *)infos + i * stride);
        info->size = stride;
        info_set(info, &devices.items[i]);
    }
    OWNED char *failure = device_list_failure_text(&devices);
    if (failure) message_error(&list, "%s", failure);
    const GlintStatus status = !is_sound ? GLINT_WRONG_INPUT : failure ? GLINT_DEVICE_FAILED : GLINT_DONE;
    device_list_close(&devices);
    return call_end(&list, NULL, status, messages);
}

static void warnings_keep(void *context, MessageList *warnings)
{
    GlintDevice *device = context;
    message_list_move(&device->warnings, warnings);
}

GlintStatus glint_device_open(const char *selector, GlintDevice **device, char **messages)
{
    MessageList list = {0};
    GlintDevice *opened = memory_allocate_zeroed(1, sizeof *opened);
    opened->receiver = (WarningReceiver){.deliver = warnings_keep, .context = opened};
    device_list_open(&opened->list, &opened->receiver);
    const Device *chosen = device_choose(&opened->list, device_selector(selector), &list);
    if (chosen) compute_open(&opened->compute, chosen);
    const GlintStatus status = call_end(&list, opened, chosen ? GLINT_DONE : GLINT_WRONG_INPUT, messages);
    // a progress function may trace and close tracers on the device that renders
    pthread_mutexattr_t recursive;
    pthread_mutexattr_init(&recursive);
    pthread_mutexattr_settype(&recursive, PTHREAD_MUTEX_RECURSIVE);
    pthread_mutex_init(&opened->mutex, &recursive);
    pthread_mutexattr_destroy(&recursive);
    *device = status == GLINT_DONE ? opened : NULL;
    if (!*device) glint_device_close(opened);
    return status;
}

void glint_device_close(GlintDevice *device)
{
    if (!device) return;
    compute_close(&device->compute);
    device_list_close(&device->list);
    message_list_free(&device->warnings);
    pthread_mutex_destroy(&device->mutex);
    free(device);
}

void glint_device_info(const GlintDevice *device, GlintDeviceInfo *info)
{
    info_set(info, device->compute.device);
}

Renderer *device_renderer(GlintDevice *device, const Scene *scene, const RenderSettings *settings,
                          MessageList *messages)
{
    Compute *compute = &device->compute;
    if (settings->precision == PRECISION_CERTIFIED && !compute->device->fp64 && !compute->reference &&
        compute_ok(compute)) {
        // renderer_open names what is missing
        const Device *reference = device_choose_reference(&device->list, NULL, NULL);
        if (reference) compute_open_reference(compute, reference);
    }
    return renderer_open(compute, scene, settings, messages);
}
