#include "host/cli/options.h"
#include "host/image/image.h"

#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <dirent.h>
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

const char *const lanes_choice_names[LANES_CHOICE_COUNT] = {"1", "4", "8", "16"};
const uint32_t lanes_choice_values[LANES_CHOICE_COUNT] = {1, 4, 8, 16};

// Reads decimal digits only. *end receives the position after them.
static bool digits_read(const char *value, const char **end, uint64_t *result)
{
    *result = 0;
    const char *at = value;
    for (; *at >= '0' && *at <= '9' && *result < 1u << 31; at++)
        *result = *result * 10 + (uint64_t)(*at - '0');
    *end = at;
    return at > value;
}

bool option_count(const char *option, const char *value, uint32_t smallest, uint32_t largest,
                  uint32_t *result)
{
    const char *end;
    uint64_t number;
    if (!digits_read(value, &end, &number) || *end != '\0' || number < smallest || number > largest) {
        fprintf(stderr, "glint: --%s: expected an integer from %u to %u, not \"%s\"\n", option, smallest,
                largest, value);
        return false;
    }
    *result = (uint32_t)number;
    return true;
}

// Reads WIDTHxHEIGHT. Prints an error that shows `example` if the value is malformed.
static bool sides_read(const char *option, const char *example, const char *value, uint32_t *width,
                       uint32_t *height)
{
    const uint64_t largest = IMAGE_SIDE_MAX;
    const char *at;
    uint64_t w, h;
    if (!digits_read(value, &at, &w) || (*at != 'x' && *at != 'X') || !digits_read(at + 1, &at, &h) ||
        *at != '\0' || w < 1 || h < 1 || w > largest || h > largest) {
        fprintf(stderr, "glint: --%s: expected WIDTHxHEIGHT, such as %s, each from 1 to %u, not \"%s\"\n",
                option, example, (unsigned)largest, value);
        return false;
    }
    *width = (uint32_t)w;
    *height = (uint32_t)h;
    return true;
}

bool option_size(const char *option, const char *value, uint32_t *width, uint32_t *height)
{
    return sides_read(option, "1280x720", value, width, height);
}

bool option_fraction(const char *option, const char *value, double *fraction)
{
    char *end;
    *fraction = strtod(value, &end);
    if (end != value && *end == '\0' && *fraction >= 0 && *fraction <= 1) return true;
    fprintf(stderr, "glint: --%s: expected a number from 0 to 1, not \"%s\"\n", option, value);
    return false;
}

bool option_error_budget(const char *option, const char *value, ErrorBudget *budget)
{
    char *end;
    *budget = (ErrorBudget){.limit = strtod(value, &end)};
    if (end == value || !(budget->limit > 0 && isfinite(budget->limit)) || (*end != ':' && *end != '\0')) {
        fprintf(stderr,
                "glint: --%s: expected a number above 0, perhaps with a metric, such as 0.01:flip, "
                "not \"%s\"\n",
                option, value);
        return false;
    }
    unsigned metric = ERROR_RMSE;
    if (*end == ':' && !option_choice(option, end + 1, error_metric_names, ERROR_METRIC_COUNT, &metric))
        return false;
    budget->metric = (ErrorMetric)metric;
    return true;
}

bool option_max_pixels(const char *value)
{
    uint32_t largest;
    if (!option_count("max-pixels", value, 1, UINT32_MAX, &largest)) return false;
    image_limit_pixels(largest);
    return true;
}

bool option_folder(const char *option, const char *path)
{
    if (mkdir(path, 0777) != 0 && errno != EEXIST) {
        fprintf(stderr, "glint: --%s: cannot create the folder '%s': %s\n", option, path, strerror(errno));
        return false;
    }
    if (access(path, W_OK | X_OK) == 0) return true;
    fprintf(stderr, "glint: --%s: cannot write to '%s': %s\n", option, path, strerror(errno));
    return false;
}

bool option_empty_folder(const char *option, const char *path)
{
    if (!option_folder(option, path)) return false;
    DIR *folder = opendir(path);
    if (!folder) {
        fprintf(stderr, "glint: --%s: cannot read the folder '%s': %s\n", option, path, strerror(errno));
        return false;
    }
    bool is_empty = true;
    for (const struct dirent *item; (item = readdir(folder));)
        is_empty &= strcmp(item->d_name, ".") == 0 || strcmp(item->d_name, "..") == 0;
    closedir(folder);
    if (!is_empty) fprintf(stderr, "glint: --%s: the folder '%s' is not empty\n", option, path);
    return is_empty;
}

static bool perturb_read(const char *value, CommonOptions *common)
{
    const char *at;
    uint64_t seed, scale = 1;
    bool valid = digits_read(value, &at, &seed) && seed >= 1 && seed <= UINT32_MAX;
    if (valid && *at == ':')
        valid = digits_read(at + 1, &at, &scale) && scale >= 1 && scale <= PERTURB_SCALE_MAX;
    if (!valid || *at != '\0') {
        fprintf(stderr,
                "glint: --perturb: expected a seed from 1 to %u, or SEED:SCALE with a scale from 1 to %d, "
                "not \"%s\"\n",
                UINT32_MAX, PERTURB_SCALE_MAX, value);
        return false;
    }
    common->perturb_seed = (uint32_t)seed;
    common->perturb_scale = (uint32_t)scale;
    return true;
}

static bool override_add(CommonOptions *common, const char *value)
{
    if (common->override_count == OVERRIDES_MAX) {
        fprintf(stderr, "glint: --set: may be given at most %d times\n", OVERRIDES_MAX);
        return false;
    }
    common->overrides[common->override_count++] = value;
    return true;
}

static void choices_print(const char *const *names, size_t count, const char *value)
{
    for (size_t i = 0; i < count; i++)
        fprintf(stderr, "%s%s", i == 0 ? "" : i + 1 == count ? " or " : ", ", names[i]);
    const char *near = text_nearest(value, names, count);
    fprintf(stderr, ", not \"%s\"", value);
    if (near) fprintf(stderr, "; did you mean %s?", near);
    fputc('\n', stderr);
}

bool option_choice(const char *option, const char *value, const char *const *names, size_t count,
                   unsigned *result)
{
    for (size_t i = 0; i < count; i++)
        if (strcmp(value, names[i]) == 0) {
            *result = (unsigned)i;
            return true;
        }
    fprintf(stderr, "glint: --%s: expected ", option);
    choices_print(names, count, value);
    return false;
}

bool option_list(const char *option, const char *value, OptionItem read, void *items, size_t item_size,
                 size_t most, size_t *count)
{
    *count = 0;
    for (const char *at = value;; at++) {
        const size_t length = strcspn(at, ",");
        char *word = memory_copy_text(at);
        word[length] = '\0';
        const bool has_room = *count < most;
        if (!has_room) fprintf(stderr, "glint: --%s: expected at most %zu values\n", option, most);
        const bool is_read = has_room && read(option, word, (char *)items + *count * item_size);
        free(word);
        if (!is_read) return false;
        (*count)++;
        at += length;
        if (*at == '\0') return true;
    }
}

bool option_set(const char *option, const char *value, const char *const *names, size_t count,
                unsigned *result)
{
    *result = 0;
    for (const char *at = value;; at++) {
        size_t length = strcspn(at, ",");
        size_t i = 0;
        while (i < count && (strlen(names[i]) != length || strncmp(at, names[i], length) != 0))
            i++;
        if (i == count) {
            char *word = memory_copy_part(at, length);
            fprintf(stderr, "glint: --%s: expected names separated by commas, of ", option);
            choices_print(names, count, word);
            free(word);
            return false;
        }
        *result |= 1u << i;
        at += length;
        if (*at == '\0') return true;
    }
}

bool option_common(CommonOptions *common, int option, const char *value, bool *valid)
{
    unsigned choice = 0;
    *valid = true;
    switch (option) {
    case OPTION_DEVICE:
        common->device = value;
        return true;
    case OPTION_PRECISION:
        *valid = option_choice("precision", value, precision_names, PRECISION_COUNT, &choice);
        common->precision = (Precision)choice;
        common->has_precision = true;
        return true;
    case OPTION_LANES:
        *valid = option_choice("lanes", value, lanes_choice_names, LANES_CHOICE_COUNT, &choice);
        common->lanes = lanes_choice_values[choice];
        return true;
    case OPTION_BVH:
        *valid = option_choice("bvh", value, bvh_choice_names, BVH_CHOICE_COUNT, &choice);
        common->bvh = (BvhChoice)choice;
        return true;
    case OPTION_NO_CACHE:
        common->no_cache = true;
        return true;
    case OPTION_LENIENT:
        common->lenient = true;
        return true;
    case OPTION_SET:
        *valid = override_add(common, value);
        return true;
    case OPTION_CAMERA:
        common->camera = value;
        *valid = strcmp(value, "-") != 0;
        if (!*valid) fputs("glint: --camera: expected the name of a file, not \"-\"\n", stderr);
        return true;
    case OPTION_MAX_PIXELS:
        *valid = option_max_pixels(value);
        return true;
    case OPTION_REFERENCE_DEVICE:
        common->reference_device = value;
        return true;
    case OPTION_WORK_GROUP:
        *valid = sides_read("work-group", "16x4", value, &common->work_group[0], &common->work_group[1]);
        return true;
    case OPTION_BUILD_OPTIONS:
        common->build_options = value;
        return true;
    case OPTION_KEEP_KERNELS:
        *valid = option_folder("keep-kernels", value);
        common->kernel_folder = value;
        return true;
    case OPTION_PERTURB:
        *valid = perturb_read(value, common);
        return true;
    default:
        return false;
    }
}

int option_help(const char *text)
{
    fputs(text, stdout);
    return EXIT_DONE;
}

int option_usage_fault(const char *command, const char *what)
{
    fprintf(stderr, "glint %s: %s; see glint %s --help\n", command, what, command);
    return EXIT_USER;
}

bool option_only_scene(const char *command, int argument_count, char **arguments)
{
    if (optind + 1 == argument_count) return true;
    if (optind == argument_count)
        option_usage_fault(command, "no scene given");
    else
        fprintf(stderr, "glint %s: takes one scene, not also '%s'; see glint %s --help\n", command,
                arguments[optind + 1], command);
    return false;
}

void messages_print_once(MessageList *messages, MessageList *printed, const char *path)
{
    const char *ending = path ? strrchr(path, '.') : NULL;
    if (ending && strcasecmp(ending, ".rt") == 0 && message_count(messages, MESSAGE_ERROR) > 0)
        fputs("Error\n", stderr);
    message_list_remove(messages, printed);
    message_list_print(messages, stderr);
    message_list_move(printed, messages);
}

void messages_print(MessageList *messages, const char *path)
{
    MessageList printed = {0};
    messages_print_once(messages, &printed, path);
    message_list_free(&printed);
}

SceneOptions scene_options_of(const CommonOptions *common)
{
    return (SceneOptions){.lenient = common->lenient,
                          .overrides = common->overrides,
                          .override_name = "--set",
                          .override_count = common->override_count,
                          .frame = common->frame,
                          .camera = common->camera,
                          .stage = common->stage};
}

bool scene_open_once(Scene *scene, const char *path, const CommonOptions *common, MessageList *printed)
{
    MessageList messages = {0};
    const SceneOptions options = scene_options_of(common);
    bool loaded = scene_load(scene, path, &options, &messages);
    messages_print_once(&messages, printed, path);
    return loaded;
}

bool scene_open(Scene *scene, const char *path, const CommonOptions *common)
{
    MessageList printed = {0};
    const bool loaded = scene_open_once(scene, path, common, &printed);
    message_list_free(&printed);
    return loaded;
}

bool output_overwrites_scene(const char *path, const Scene *scene, const char *scene_path)
{
    if (!scene_was_read_from(scene, scene_path, path)) return false;
    fprintf(stderr, "glint: would overwrite '%s', which '%s' is read from; choose another with -o\n", path,
            scene_path);
    return true;
}

RenderSettings settings_whole(const CommonOptions *common, uint32_t width, uint32_t height)
{
    RenderSettings settings = settings_of_image(width, height, common->precision);
    settings.lanes = common->lanes;
    settings.bvh = common->bvh;
    settings.no_cache = common->no_cache;
    settings.perturb_seed = common->perturb_seed;
    settings.perturb_scale = common->perturb_scale;
    settings.stage = common->stage;
    return settings;
}

const Device *device_find(DeviceList *devices, const char *selector)
{
    device_list_open(devices);
    MessageList messages = {0};
    const Device *device = device_choose(devices, device_selector(selector), &messages);
    messages_print(&messages, NULL);
    return device;
}

static void driver_options_apply(DeviceList *list, const CommonOptions *common)
{
    for (size_t i = 0; i < list->count; i++) {
        list->items[i].build_options = common->build_options;
        list->items[i].work_group[0] = common->work_group[0];
        list->items[i].work_group[1] = common->work_group[1];
        list->items[i].kernel_folder = common->kernel_folder;
        list->items[i].capture_folder = common->capture_folder;
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
    if (!is_allowed)
        fprintf(
            stderr,
            "glint: --work-group: %zux%zu has %zu work-items; \"%s\" allows %zu in a group, at most %zu by "
            "%zu\n",
            group[0], group[1], items, device->name, allowed, longest[0], longest[1]);
    return is_allowed;
}

bool device_open(OpenDevice *open, const CommonOptions *common)
{
    *open = (OpenDevice){0};
    const Device *device = device_find(&open->devices, common->device);
    driver_options_apply(&open->devices, common);
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
    if (!reference) return false;
    if (!selector)
        fprintf(stderr, "glint: \"%s\" works in double for \"%s\", which has no 64-bit floating point%s\n",
                reference->name, device->name, device_fp64_hint(device));
    if (reference != device) compute_open_reference(compute, reference);
    return true;
}

// Computes that only the process's end releases, listed so that LeakSanitizer can see that nothing else was
// leaked.
static struct {
    Compute *items;
    size_t count, capacity;
} left;

// Closes a Compute. Returns EXIT_MACHINE with a message if the device failed, else `status`.
static int compute_end(Compute *compute, int status)
{
    char *unmap_failure = compute_unmap_failure_text(compute);
    if (compute_ok(compute) && unmap_failure) fprintf(stderr, "glint: warning: %s\n", unmap_failure);
    free(unmap_failure);
    if (!compute_ok(compute)) {
        char *failure = compute_failure_text(compute);
        fprintf(stderr, "glint: %s\n", failure);
        free(failure);
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

// Closes the Compute, unless compute_end has done so, and frees it.
static void compute_free(Compute *compute)
{
    compute_close(compute);
    free(compute);
}

static void computes_open(OpenDevices *open, const Device *const *devices, size_t count)
{
    open->count = count;
    open->items = memory_allocate_zeroed(count, sizeof *open->items);
    for (size_t i = 0; i < count; i++) {
        open->items[i].compute = memory_allocate_zeroed(1, sizeof *open->items[i].compute);
        compute_open(open->items[i].compute, devices[i]);
    }
}

bool devices_open(OpenDevices *open, const char *selector)
{
    *open = (OpenDevices){0};
    device_list_open(&open->devices);
    MessageList messages = {0};
    const Device **devices;
    const char *listed = device_selector(selector);
    size_t count = devices_choose(&open->devices, listed, &devices, &messages);
    messages_print(&messages, NULL);
    open->are_all = listed && strcasecmp(listed, "all") == 0;
    computes_open(open, devices, count);
    free(devices);
    if (count == 0) devices_abandon(open);
    return count > 0;
}

bool devices_apply_options(OpenDevices *open, const CommonOptions *common)
{
    driver_options_apply(&open->devices, common);
    for (size_t i = 0; i < open->count; i++)
        if (!work_group_is_allowed(open->items[i].compute->device)) return false;
    return true;
}

bool devices_open_one(OpenDevices *open, const char *selector, size_t number, MessageList *messages)
{
    *open = (OpenDevices){0};
    device_list_open(&open->devices);
    const char *listed = device_selector(selector);
    const Device **devices;
    const Device *first = listed ? NULL : device_choose(&open->devices, NULL, messages);
    size_t count = devices_choose(&open->devices, listed ? listed : "all", &devices, messages), kept = 0;
    for (size_t i = 0; i < count; i++)
        if (!first || devices[i]->type == first->type) devices[kept++] = devices[i];
    if (kept > 0) computes_open(open, &devices[number % kept], 1);
    free(devices);
    if (kept == 0) devices_abandon(open);
    return kept > 0;
}

void devices_abandon(OpenDevices *open)
{
    for (size_t i = 0; i < open->count; i++)
        compute_free(open->items[i].compute);
    free(open->items);
    device_list_close(&open->devices);
}

void devices_drop(OpenDevices *open, size_t index)
{
    char *failure = compute_failure_text(open->items[index].compute);
    fprintf(stderr, "glint: warning: the other devices continue without it: %s\n", failure);
    free(failure);
    open->items[index].is_dropped = true;
}

void devices_remove(OpenDevices *open, size_t index)
{
    compute_free(open->items[index].compute);
    open->count--;
    memmove(&open->items[index], &open->items[index + 1], (open->count - index) * sizeof *open->items);
}

int devices_close(OpenDevices *open, int status)
{
    for (size_t i = 0; i < open->count; i++) {
        if (!open->items[i].is_dropped) status = compute_end(open->items[i].compute, status);
        compute_free(open->items[i].compute);
    }
    free(open->items);
    device_list_close(&open->devices);
    return status;
}
