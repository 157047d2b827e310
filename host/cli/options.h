// Reads option values, opens devices and loads scenes for all commands.
#pragma once

#include "host/import/load.h"
#include "host/measure/error_budget.h"
#include "host/opencl/compute.h"
#include "host/render/renderer.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { OVERRIDES_MAX = 64 };

// The options of every command that uses a device.
typedef struct {
    const char *device, *reference_device;
    Precision precision;
    bool has_precision; // whether --precision is given
    uint32_t lanes;     // 0 for the device's default
    BvhChoice bvh;
    bool no_cache, lenient;
    uint32_t perturb_seed, perturb_scale; // 0 if not given
    const char *build_options;            // NULL if not given
    uint32_t work_group[2];               // 0 if not given
    const char *kernel_folder;            // NULL if not given
    const char *capture_folder;           // NULL if not given
    const char *overrides[OVERRIDES_MAX]; // --set, in order
    size_t override_count;
    const char *camera; // the scene of --camera, NULL if not given
    double frame;       // of an animated scene
    Stage *stage;       // records what takes time; may be NULL
} CommonOptions;

// getopt_long values of long options. A command's other options start at OPTION_OWN.
enum {
    OPTION_DEVICE = 256,
    OPTION_PRECISION,
    OPTION_LANES,
    OPTION_BVH,
    OPTION_NO_CACHE,
    OPTION_LENIENT,
    OPTION_SET,
    OPTION_CAMERA,
    OPTION_MAX_PIXELS,
    OPTION_PERTURB,
    OPTION_REFERENCE_DEVICE,
    OPTION_WORK_GROUP,
    OPTION_BUILD_OPTIONS,
    OPTION_KEEP_KERNELS,
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

// The options of commands whose scenes' values can be set.
#define SET_LONG_OPTIONS                                                                                     \
    {"set", required_argument, NULL, OPTION_SET},                                                            \
    {                                                                                                        \
        "camera", required_argument, NULL, OPTION_CAMERA                                                     \
    }

// The option of commands that render or trace.
#define PERTURB_LONG_OPTION                                                                                  \
    {                                                                                                        \
        "perturb", required_argument, NULL, OPTION_PERTURB                                                   \
    }

// The options of commands that measure drivers.
#define DRIVER_LONG_OPTIONS                                                                                  \
    {"work-group", required_argument, NULL, OPTION_WORK_GROUP},                                              \
    {                                                                                                        \
        "build-options", required_argument, NULL, OPTION_BUILD_OPTIONS                                       \
    }

// The option of commands that examine drivers.
#define KEEP_KERNELS_LONG_OPTION                                                                             \
    {                                                                                                        \
        "keep-kernels", required_argument, NULL, OPTION_KEEP_KERNELS                                         \
    }

// The option of commands that render at `certified`.
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
    "      --lanes N         rays per work-item: 1, 4, 8 or 16 (default and CPU maximum: vector width)\n"
#define HELP_BOUNCES "      --bounces N       reflections and refractions of a ray, up to 255 (default: 5)\n"
#define HELP_MIN_CONTRIBUTION                                                                                \
    "      --min-contribution W\n"                                                                           \
    "                        trace no bounced ray whose weight in its pixel is below W (default: 0)\n"
#define HELP_NO_CACHE "      --no-cache        ignore the kernel cache\n"
#define HELP_LENIENT  "      --lenient         read dialects of .rt files\n"
#define HELP_SET                                                                                             \
    "      --set PATH=VALUE  set a value in YAML, such as camera.fov=60; repeatable\n"                       \
    "      --camera FILE     a scene whose camera is used\n"
#define HELP_MAX_PIXELS "      --max-pixels N    of an image that is read (default: 134217728)\n"
#define HELP_PERTURB                                                                                         \
    "      --perturb SEED[:SCALE]\n"                                                                         \
    "                        inject the rounding error that OpenCL permits, times SCALE (default: 1)\n"
#define HELP_DRIVER                                                                                          \
    "      --work-group WxH  work-items of a group (default: 8x8, 1x1 for lanes on a CPU, or "               \
    "fewer)\n"                                                                                               \
    "      --build-options OPTIONS\n"                                                                        \
    "                        passed to the driver's compiler, such as \"-cl-opt-disable\"\n"
#define HELP_KEEP_KERNELS                                                                                    \
    "      --keep-kernels FOLDER\n"                                                                          \
    "                        write the text and the build log of each kernel that is built\n"
#define HELP_REFERENCE                                                                                       \
    "      --reference-device D\n"                                                                           \
    "                        renders references and the pixels that certified re-renders\n"                  \
    "                        (default: the device itself, else one with fp64)\n"
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

// Returns true with a message if writing `path` would overwrite a file that the scene was read from.
bool output_overwrites_scene(const char *path, const Scene *scene, const char *scene_path);

// The result of reading a command line if the command is to run. Any other result is the exit status.
enum { OPTIONS_READ = -1 };

// The functions below read one value. On a mistake they print what `option` expects and return false.
bool option_count(const char *option, const char *value, uint32_t smallest, uint32_t largest,
                  uint32_t *result);
// Reads a number from 0 to 1.
bool option_fraction(const char *option, const char *value, double *fraction);
bool option_size(const char *option, const char *value, uint32_t *width, uint32_t *height); // reads WxH
bool option_choice(const char *option, const char *value, const char *const *names, size_t count,
                   unsigned *result);
// Reads E or E:METRIC. The default metric is the RMSE.
bool option_error_budget(const char *option, const char *value, ErrorBudget *budget);
// Creates the folder unless it exists. Returns false with a message if it cannot be written to.
bool option_folder(const char *option, const char *path);
// Creates the folder unless it exists. Returns false with a message if it cannot be written to or is not
// empty.
bool option_empty_folder(const char *option, const char *path);
// Reads the limit of the pixels of an image that is read, and sets it.
bool option_max_pixels(const char *value);
// Reads one value of a list into `item`; on a mistake prints what `option` expects and returns false.
typedef bool (*OptionItem)(const char *option, const char *value, void *item);
// Reads values separated by commas, at most `most` of them, each into the next `item_size` bytes of `items`.
bool option_list(const char *option, const char *value, OptionItem read, void *items, size_t item_size,
                 size_t most, size_t *count);
// Reads comma-separated names into a set with one bit per name.
bool option_set(const char *option, const char *value, const char *const *names, size_t count,
                unsigned *result);
// Handles a common option and sets *valid if its value is valid. Returns false if `option` is not a common
// one.
bool option_common(CommonOptions *common, int option, const char *value, bool *valid);

// Prints the help text and returns EXIT_DONE.
int option_help(const char *text);
// Prints a usage error that points to --help and returns EXIT_USER.
int option_usage_fault(const char *command, const char *what);

// Returns whether exactly one argument is left, from getopt's `optind` on. Otherwise prints what is missing
// or superfluous.
bool option_only_scene(const char *command, int argument_count, char **arguments);

// Returns the options that scenes are read with. They refer to `common`.
SceneOptions scene_options_of(const CommonOptions *common);
// Loads the scene and prints its messages. Returns false, with nothing to free, if it cannot be read.
bool scene_open(Scene *scene, const char *path, const CommonOptions *common);
// Loads the scene, prints those of its messages that `printed` lacks, and appends them to `printed`. Returns
// false, with nothing to free, if the scene cannot be read.
bool scene_open_once(Scene *scene, const char *path, const CommonOptions *common, MessageList *printed);
// Prints those of the messages that `printed` lacks, and moves them there.
void messages_print_once(MessageList *messages, MessageList *printed, const char *path);
// Prints and frees messages. Errors in an .rt file follow the line `Error` that miniRT's testers expect.
void messages_print(MessageList *messages, const char *path);

// Returns settings for a full image with the common options: one sample, no bounces, the scene not shifted.
RenderSettings settings_whole(const CommonOptions *common, uint32_t width, uint32_t height);

typedef struct {
    DeviceList devices;
    Compute compute;
} OpenDevice;

// Chooses a device. Returns NULL with a message if there is none. The list must be closed either way.
const Device *device_find(DeviceList *devices, const char *selector);
// Returns whether the device allows its work-group, and prints an error if not.
bool work_group_is_allowed(const Device *device);
// Chooses a device, opens it and applies --work-group and --build-options. Returns false with a message if no
// device matches or it does not allow the work-group; there is nothing to close then. device_close reports a
// device that fails, now or later.
bool device_open(OpenDevice *open, const CommonOptions *common);
// Opens the device that works in double for the Compute, if the user chose one or if the Compute's device has
// no 64-bit floating point, and prints its name. Returns false if there is none, with a message if the user
// chose one.
bool reference_open(Compute *compute, const DeviceList *devices, const char *selector);
// Closes the device at the end of a command. Returns EXIT_MACHINE with a message if the device failed, else
// `status`. Unless the command failed or was interrupted, the context is left to the process's end, since
// PoCL takes 80 ms to free its compiler.
int device_close(OpenDevice *open, int status);

// The devices that render one image.
typedef struct {
    DeviceList devices;
    struct {
        Compute *compute;
        bool is_dropped; // it failed, and the other devices did its work
    } * items;
    size_t count;
    bool are_all; // chosen by "all", so that those that do not suit a render can be left out
} OpenDevices;

// Opens every device that the selector lists, or all devices for "all". Returns false with a message if there
// is none; there is nothing to close then.
bool devices_open(OpenDevices *open, const char *selector);
// Applies --work-group and --build-options to the devices. Returns false with a message if one does not allow
// the work-group.
bool devices_apply_options(OpenDevices *open, const CommonOptions *common);
// Opens one of the devices that `selector` lists or, if it is NULL, of the devices of the default's type. It
// is the one at `number` modulo their count, so that the processes of one machine use different devices.
// Returns false with a message, and nothing to close, if there is none.
bool devices_open_one(OpenDevices *open, const char *selector, size_t number, MessageList *messages);
// Closes all devices without reporting failures.
void devices_abandon(OpenDevices *open);
// Warns that the device failed and that the others do its work.
void devices_drop(OpenDevices *open, size_t index);
// Closes a device that no renderer uses. Later devices move up.
void devices_remove(OpenDevices *open, size_t index);
// Closes all devices. Returns EXIT_MACHINE with a message if a device failed that was not dropped, else
// `status`.
int devices_close(OpenDevices *open, int status);
