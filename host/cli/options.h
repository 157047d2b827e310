// Shared by the commands: reading option values, opening the device, loading the scene.
#pragma once

#include "host/measure/error_budget.h"
#include "host/opencl/compute.h"
#include "host/render/renderer.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Options of every command that uses a device.
typedef struct {
    const char *device, *reference_device;
    Precision precision;
    bool has_precision; // given
    uint32_t lanes;     // 0: the device's default
    BvhChoice bvh;
    bool no_cache, lenient;
    uint32_t perturb_seed, perturb_scale; // 0: not given
    const char *build_options;            // NULL: not given
    uint32_t work_group[2];               // 0: not given
} CommonOptions;

// getopt_long values of long options; a command's own start at OPTION_OWN.
enum {
    OPTION_DEVICE = 256,
    OPTION_PRECISION,
    OPTION_LANES,
    OPTION_BVH,
    OPTION_NO_CACHE,
    OPTION_LENIENT,
    OPTION_MAX_PIXELS,
    OPTION_PERTURB,
    OPTION_REFERENCE_DEVICE,
    OPTION_WORK_GROUP,
    OPTION_BUILD_OPTIONS,
    OPTION_OWN
};

#define COMMON_LONG_OPTIONS                                                                                  \
    {"device", required_argument, NULL, OPTION_DEVICE},                                                      \
        {"precision", required_argument, NULL, OPTION_PRECISION},                                            \
        {"lanes", required_argument, NULL, OPTION_LANES}, {"bvh", required_argument, NULL, OPTION_BVH},      \
        {"no-cache", no_argument, NULL, OPTION_NO_CACHE},                                                    \
        {"max-pixels", required_argument, NULL, OPTION_MAX_PIXELS},                                          \
    {                                                                                                        \
        "lenient", no_argument, NULL, OPTION_LENIENT                                                         \
    }

// For commands that render or trace.
#define PERTURB_LONG_OPTION                                                                                  \
    {                                                                                                        \
        "perturb", required_argument, NULL, OPTION_PERTURB                                                   \
    }

// Options of the commands that measure drivers.
#define DRIVER_LONG_OPTIONS                                                                                  \
    {"work-group", required_argument, NULL, OPTION_WORK_GROUP},                                              \
    {                                                                                                        \
        "build-options", required_argument, NULL, OPTION_BUILD_OPTIONS                                       \
    }

// For commands that render at `certified`.
#define REFERENCE_LONG_OPTION                                                                                \
    {                                                                                                        \
        "reference-device", required_argument, NULL, OPTION_REFERENCE_DEVICE                                 \
    }

// Help for options that several commands share; a command's help ends with HELP_HELP.
#define HELP_DEVICE                                                                                          \
    "      --device D        index, part of the name, place on the PCI bus, cpu or gpu\n"                    \
    "                        (default: GLINT_DEVICE, else a GPU, else a CPU)\n"
#define HELP_DEVICES                                                                                         \
    "      --device LIST     all, or several: each an index, part of the name, place on the PCI bus, cpu\n"  \
    "                        or gpu, with commas between (default: GLINT_DEVICE, else a GPU, else a CPU)\n"
#define HELP_LANES                                                                                           \
    "      --lanes N         rays per work-item: 1, 4, 8 or 16 (default: the device's vector width)\n"
#define HELP_BOUNCES                                                                                         \
    "      --bounces N       reflections and refractions of a ray: at most N, up to 255 (default: 5)\n"
#define HELP_NO_CACHE   "      --no-cache        ignore the kernel cache\n"
#define HELP_LENIENT    "      --lenient         skip unknown elements of .rt files with a warning\n"
#define HELP_MAX_PIXELS "      --max-pixels N    of an image that is read (default: 134217728)\n"
#define HELP_PERTURB                                                                                         \
    "      --perturb SEED[:SCALE]\n"                                                                         \
    "                        inject the rounding error that OpenCL permits, times SCALE (default: 1)\n"
#define HELP_DRIVER                                                                                          \
    "      --work-group WxH  work-items of a group (default: 8x8, 1x1 with several lanes on a CPU, or "      \
    "fewer)\n"                                                                                               \
    "      --build-options OPTIONS\n"                                                                        \
    "                        passed to the driver's compiler after glint's, such as \"-cl-opt-disable\"\n"
#define HELP_REFERENCE                                                                                       \
    "      --reference-device D\n"                                                                           \
    "                        renders in double: references, and the pixels that certified re-renders\n"      \
    "                        (default: the device itself, else one with 64-bit floating point)\n"
#define HELP_JSON "      --json            print JSON\n"
#define HELP_HELP "  -h, --help            print this help\n"

// Help on COMMON_LONG_OPTIONS, after HELP_DEVICE or HELP_DEVICES and a --precision.
#define HELP_PRECISION "      --precision P     single, strict, double or certified (default: single)\n"
#define HELP_COMMON                                                                                          \
    HELP_LANES                                                                                               \
    "      --bvh B           auto, on or off; does not change the image (default: auto)\n" HELP_NO_CACHE     \
        HELP_LENIENT HELP_MAX_PIXELS

enum { BOUNCES_DEFAULT = 5 };

enum { LANES_CHOICE_COUNT = 4 };
extern const char *const lanes_choice_names[LANES_CHOICE_COUNT];
extern const uint32_t lanes_choice_values[LANES_CHOICE_COUNT];

// True, with a message, if writing `path` would overwrite a file that the scene was read from.
bool output_overwrites_scene(const char *path, const Scene *scene, const char *scene_path);

// Result of reading a command line if the command is to run; otherwise it is the exit status.
enum { OPTIONS_READ = -1 };

// Each reads one value; on a mistake prints what `option` expects and returns false.
bool option_count(const char *option, const char *value, uint32_t smallest, uint32_t largest,
                  uint32_t *result);
bool option_size(const char *option, const char *value, uint32_t *width, uint32_t *height); // WxH
bool option_choice(const char *option, const char *value, const char *const *names, size_t count,
                   unsigned *result);
// E or E:METRIC; without a metric the RMSE.
bool option_error_budget(const char *option, const char *value, ErrorBudget *budget);
bool option_max_pixels(const char *value); // and sets the limit
// Reads one value of a list into `item`; on a mistake prints what `option` expects and returns false.
typedef bool (*OptionItem)(const char *option, const char *value, void *item);
// Values separated by commas, at most `most` of them, each into the next `item_size` bytes of `items`.
bool option_list(const char *option, const char *value, OptionItem read, void *items, size_t item_size,
                 size_t most, size_t *count);
// Comma-separated names; the result has one bit per name.
bool option_set(const char *option, const char *value, const char *const *names, size_t count,
                unsigned *result);
// Handles a common option; *valid receives whether its value is valid. False if `option` is not a common one.
bool option_common(CommonOptions *common, int option, const char *value, bool *valid);

// Prints the help text; returns EXIT_DONE.
int option_help(const char *text);
// Prints a usage error that points to --help; returns EXIT_USER.
int option_usage_fault(const char *command, const char *what);

// Whether one argument is left, from getopt's `optind`; else prints what is missing or too much.
bool option_only_scene(const char *command, int argument_count, char **arguments);

// Loads the scene and prints its messages. False if it cannot be read; nothing to free then.
bool scene_open(Scene *scene, const char *path, const CommonOptions *common);
// Prints and frees messages; errors in an .rt file follow the line `Error` that miniRT's testers expect.
void messages_print(MessageList *messages, const char *path);

// Settings for a full image with the common options: one sample, no bounces, the scene not shifted.
RenderSettings settings_whole(const CommonOptions *common, uint32_t width, uint32_t height);

typedef struct {
    DeviceList devices;
    Compute compute;
} OpenDevice;

// Chooses a device. Returns NULL with a message if there is none. The list must be closed either way.
const Device *device_find(DeviceList *devices, const char *selector);
// Chooses a device, opens it and applies --work-group and --build-options. Returns false with a message if no
// device matches or it does not allow the work-group; there is nothing to close then. device_close reports a
// device that fails, now or later.
bool device_open(OpenDevice *open, const CommonOptions *common);
// Opens the device that works in double for the Compute, if the user chose one or its own device has no
// 64-bit floating point, and prints which it is. False if there is none, with a message if the user chose
// one.
bool reference_open(Compute *compute, const DeviceList *devices, const char *selector);
// At the end of a command. Returns the exit status: EXIT_MACHINE, with a message, if the device failed, else
// `status`. Unless failed or interrupted, the context is left to the process's end: PoCL takes 80 ms to free
// its compiler.
int device_close(OpenDevice *open, int status);

// Several devices, for one image.
typedef struct {
    DeviceList devices;
    struct {
        Compute *compute;
        bool is_dropped; // it failed, and the others did its work
    } * items;
    size_t count;
    bool are_all; // chosen by "all": those that do not suit a render can be left out
} OpenDevices;

// Opens every device that the selector lists, or all devices for "all". Returns false with a message if there
// is none; there is nothing to close then.
bool devices_open(OpenDevices *open, const char *selector);
// Applies --work-group and --build-options to the devices. Returns false with a message if one does not allow
// the work-group.
bool devices_apply_options(OpenDevices *open, const CommonOptions *common);
// One of the devices that `selector` lists, or without one of those of the default's type: the number modulo
// their count, for the processes of one machine. False with a message; nothing to close then.
bool devices_open_one(OpenDevices *open, const char *selector, size_t number, MessageList *messages);
// Closes all without a word about failures.
void devices_abandon(OpenDevices *open);
// Warns that the device failed and that the others do its work.
void devices_drop(OpenDevices *open, size_t index);
// Closes a device that no renderer uses; those after it move up.
void devices_remove(OpenDevices *open, size_t index);
// As device_close, for all that were not dropped.
int devices_close(OpenDevices *open, int status);
