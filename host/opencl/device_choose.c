// Chooses devices by the user's selectors.
#include "host/opencl/device.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>

const char *device_selector(const char *option)
{
    if (option) return option;
    const char *selector = getenv("GLINT_DEVICE");
    return selector && selector[0] != '\0' ? selector : NULL;
}

// Ranks GPUs before CPUs before other devices.
static int device_rank(const Device *device)
{
    return device->type & CL_DEVICE_TYPE_GPU ? 2 : device->type & CL_DEVICE_TYPE_CPU ? 1 : 0;
}

static bool is_number(const char *selector)
{
    return selector[0] != '\0' && selector[strspn(selector, "0123456789")] == '\0';
}

// Returns whether the name contains the selector. A number must match a whole number there, so 51 does not
// match "haswell-avx512".
static bool name_matches(const char *name, const char *selector)
{
    if (!is_number(selector)) return strcasestr(name, selector) != NULL;
    for (const char *at = name + strcspn(name, "0123456789"); *at; at += strcspn(at, "0123456789")) {
        size_t length = strspn(at, "0123456789");
        if (length == strlen(selector) && strncmp(at, selector, length) == 0) return true;
        at += length;
    }
    return false;
}

// Returns whether the selector is the PCI place, with or without its domain.
static bool pci_matches(const char *pci, const char *selector)
{
    const char *bus = strchr(pci, ':');
    return bus && (strcasecmp(pci, selector) == 0 || strcasecmp(bus + 1, selector) == 0);
}

static bool device_matches(const Device *device, const char *selector)
{
    if (!selector) return true;
    if (selector[0] == '\0') return false;
    if (strcasecmp(selector, "gpu") == 0) return (device->type & CL_DEVICE_TYPE_GPU) != 0;
    if (strcasecmp(selector, "cpu") == 0) return (device->type & CL_DEVICE_TYPE_CPU) != 0;
    return name_matches(device->name, selector) || name_matches(device->platform_name, selector) ||
           name_matches(device->board, selector) || pci_matches(device->pci, selector) ||
           strcasecmp(device->uuid, selector) == 0;
}

// Returns whether the selector is a device's index. A number such as "3090" can be part of a name instead.
static bool selector_is_index(const DeviceList *list, const char *selector, size_t *index)
{
    if (!selector || !is_number(selector)) return false;
    *index = strtoul(selector, NULL, 10);
    return *index < list->count;
}

// Appends the devices, of which none matches.
static void devices_write(Text *text, const DeviceList *list)
{
    for (size_t i = 0; i < list->count; i++) {
        const Device *device = &list->items[i];
        const char *why;
        text_appendf(text, "%s%u (%s, %s", i ? "; " : "; the devices are: ", device->index, device->name,
                     device_type_name(device->type));
        if (!device_usable(device, &why)) text_appendf(text, ", unusable: %s", why);
        text_append(text, ")", 1);
    }
}

// Appends what may be wrong if there is no device.
static void advice_write(Text *text, const DeviceList *list)
{
    if (fault_limits()[0] != '\0') {
        text_appendf(text, "; a driver may need more");
        return;
    }
    text_appendf(text, "; PoCL runs on any CPU: `apt install pocl-opencl-icd` on Debian and Ubuntu");
    if (list->platform_count > 0)
        text_appendf(text, "; if it is installed, its cache needs a writable folder: set HOME, "
                           "XDG_CACHE_HOME or POCL_CACHE_DIR");
}

static void no_match_report(const DeviceList *list, const char *selector, MessageList *messages)
{
    const char *variable = getenv("GLINT_DEVICE");
    OWNED char *failure = device_list_failure_text(list);
    OwnedText text = {0};
    if (list->count == 0)
        text_appendf(&text, "no OpenCL device on %u platform%s", list->platform_count,
                     text_plural(list->platform_count));
    else if (selector && selector[0] == '\0')
        text_appendf(&text, "the name of a device is empty");
    else if (selector)
        text_appendf(&text, "no usable device matches %s\"%s\"",
                     variable && strcmp(variable, selector) == 0 ? "GLINT_DEVICE " : "", selector);
    else
        text_appendf(&text, "no usable device");
    if (failure) text_appendf(&text, " (%s)", failure);
    text_appendf(&text, "%s", fault_limits());
    if (list->count > 0)
        devices_write(&text, list);
    else
        advice_write(&text, list);
    message_error(messages, "%s", text_c(&text));
}

const Device *device_choose(const DeviceList *list, const char *selector, MessageList *messages)
{
    const Device *best = NULL;
    size_t index = 0;
    bool is_index = selector_is_index(list, selector, &index);
    for (size_t i = 0; i < list->count; i++) {
        const Device *device = &list->items[i];
        if (is_index ? i != index : !device_matches(device, selector)) continue;
        if (!device_usable(device, NULL)) continue;
        if (!best || device_rank(device) > device_rank(best)) best = device;
    }
    if (!best) no_match_report(list, selector, messages);
    return best;
}

const Device *device_choose_reference(const DeviceList *list, const char *selector, MessageList *messages)
{
    const Device *best = selector ? device_choose(list, selector, messages) : NULL;
    for (size_t i = 0; i < list->count && !selector; i++) {
        const Device *other = &list->items[i];
        if (!device_usable(other, NULL) || !other->fp64) continue;
        if (!best || device_rank(other) > device_rank(best)) best = other;
    }
    if (!best || best->fp64) return best;
    message_error(messages, "the reference device \"%s\" has no 64-bit floating point", best->name);
    return NULL;
}

static bool any_matches(const DeviceList *list, const char *selector)
{
    for (size_t i = 0; i < list->count; i++)
        if (device_matches(&list->items[i], selector)) return true;
    return false;
}

static size_t devices_choose_all(const DeviceList *list, const Device **chosen, MessageList *messages)
{
    size_t count = 0;
    for (size_t i = 0; i < list->count; i++)
        if (device_usable(&list->items[i], NULL)) chosen[count++] = &list->items[i];
    if (count == 0) no_match_report(list, NULL, messages);
    return count;
}

static bool is_listed(const Device *const *chosen, size_t count, const Device *device)
{
    for (size_t i = 0; i < count; i++)
        if (chosen[i] == device) return true;
    return false;
}

size_t devices_choose(const DeviceList *list, const char *selector, const Device ***devices,
                      MessageList *messages)
{
    const Device **chosen = *devices = memory_allocate_zeroed(list->count, sizeof *chosen);
    if (selector && strcasecmp(selector, "all") == 0) return devices_choose_all(list, chosen, messages);
    // a name may contain a comma, such as llvmpipe's
    bool is_single = !selector || !strchr(selector, ',') || any_matches(list, selector);
    size_t count = 0;
    for (const char *at = selector, *end;; at = end + 1) {
        end = is_single ? NULL : strchr(at, ',');
        OWNED char *part = at ? memory_copy_part(at, end ? (size_t)(end - at) : strlen(at)) : NULL;
        const Device *device = device_choose(list, part, messages);
        if (!device) return 0;
        if (is_listed(chosen, count, device)) {
            message_error(messages, "device %u (%s) is listed twice", device->index, device->name);
            return 0;
        }
        chosen[count++] = device;
        if (!end) return count;
    }
}
