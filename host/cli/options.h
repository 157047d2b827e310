// What the subcommands' options have in common: reading their values, opening the device, loading the scene.
#pragma once

#include "host/opencl/compute.h"
#include "host/render/renderer.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The options of every subcommand that uses a device.
typedef struct {
    const char *device;
    Precision precision;
    uint32_t lanes; // 0: the device's own
    BvhChoice bvh;
    bool no_cache, lenient;
    uint32_t perturb_seed, perturb_scale; // 0: not given
} CommonOptions;

// Values of getopt_long beyond the letters; each subcommand's own start at OPTION_OWN.
enum {
    OPTION_DEVICE = 256,
    OPTION_PRECISION,
    OPTION_LANES,
    OPTION_BVH,
    OPTION_NO_CACHE,
    OPTION_LENIENT,
    OPTION_PERTURB,
    OPTION_OWN
};

#define COMMON_LONG_OPTIONS                                                                                  \
    {"device", required_argument, NULL, OPTION_DEVICE},                                                      \
        {"precision", required_argument, NULL, OPTION_PRECISION},                                            \
        {"lanes", required_argument, NULL, OPTION_LANES}, {"bvh", required_argument, NULL, OPTION_BVH},      \
        {"no-cache", no_argument, NULL, OPTION_NO_CACHE},                                                    \
    {                                                                                                        \
        "lenient", no_argument, NULL, OPTION_LENIENT                                                         \
    }

// Of the subcommands that draw or trace.
#define PERTURB_LONG_OPTION                                                                                  \
    {                                                                                                        \
        "perturb", required_argument, NULL, OPTION_PERTURB                                                   \
    }

// A line of help for each option that several subcommands have; a subcommand's text ends with HELP_HELP.
#define HELP_DEVICE                                                                                          \
    "      --device D        an index, a part of the name, cpu or gpu (default: GLINT_DEVICE, else a GPU, "  \
    "else a CPU)\n"
#define HELP_LANES                                                                                           \
    "      --lanes N         rays a work-item carries at once: 1, 4, 8 or 16 (default: the device's own)\n"
#define HELP_BOUNCES  "      --bounces N       reflections and refractions of a ray, at most (default: 5)\n"
#define HELP_NO_CACHE "      --no-cache        build the kernels anew and keep nothing\n"
#define HELP_LENIENT  "      --lenient         skip what .rt files hold beyond the format, with a warning\n"
#define HELP_PERTURB                                                                                         \
    "      --perturb SEED[:SCALE]\n"                                                                         \
    "                        err in divisions, roots and powers as other devices may, SCALE times as much "  \
    "(default: 1)\n"
#define HELP_JSON "      --json            for programs\n"
#define HELP_HELP "  -h, --help            this text\n"

// Of COMMON_LONG_OPTIONS.
#define HELP_COMMON                                                                                          \
    HELP_DEVICE                                                                                              \
    "      --precision P     fast, single, strict or double (default: single)\n" HELP_LANES                  \
    "      --bvh B           auto, on or off: rays through a hierarchy; the picture is the same "            \
    "(default: auto)\n" HELP_NO_CACHE HELP_LENIENT

enum { PICTURE_SIDE_LARGEST = 1 << 20, SAMPLES_LARGEST = 1 << 20, BOUNCES_LARGEST = 16, BOUNCES_DEFAULT = 5 };

enum { LANES_CHOICE_COUNT = 4 };
extern const char *const lanes_choice_names[LANES_CHOICE_COUNT];
extern const uint32_t lanes_choice_values[LANES_CHOICE_COUNT];

// Whether writing `path` would overwrite what the scene was read from; says so then.
bool output_spares_scene(const char *path, const Scene *scene, const char *scene_path);

// What reading a command line gives where the subcommand is to go on; else it gives the exit status.
enum { OPTIONS_READ = -1 };

// Each reads one value; on a fault it prints what is wrong with `option` and returns false.
bool option_count(const char *option, const char *value, uint32_t smallest, uint32_t largest,
                  uint32_t *result);
bool option_size(const char *option, const char *value, uint32_t *width, uint32_t *height); // WxH
bool option_choice(const char *option, const char *value, const char *const *names, size_t count,
                   unsigned *result);
// Comma-separated names; the result has a bit for each.
bool option_set(const char *option, const char *value, const char *const *names, size_t count,
                unsigned *result);
// Takes a common option; *valid says whether its value was one. False if `option` is none of the common
// ones.
bool option_common(CommonOptions *common, int option, const char *value, bool *valid);

// Prints what --help asks for; returns EXIT_DONE.
int option_help(const char *text);
// Says that the command line of a subcommand is wrong in general, pointing to its help; returns EXIT_USER.
int option_usage_fault(const char *command, const char *what);

// Loads the scene and prints its messages. False: it cannot be read; nothing to free.
bool scene_open(Scene *scene, const char *path, const CommonOptions *common);
// Prints and frees messages; a fault in an .rt file is headed by the line that miniRT's testers look for.
void messages_tell(MessageList *messages, const char *path);

// A whole picture as the common options have it: one sample, no bounces, the scene as it is.
RenderSettings settings_whole(const CommonOptions *common, uint32_t width, uint32_t height);

// A picture's size where the user gave none (width 0): the scene's own, else 1280 wide at the frame's shape
// or 16:9.
void picture_size_choose(const Scene *scene, uint32_t *width, uint32_t *height);

typedef struct {
    DeviceList devices;
    Compute compute;
} OpenDevice;

// Chooses and opens a device. False: there is none, which was printed; nothing to close.
bool device_open(OpenDevice *open, const char *wish);
// At a command's end. The context ends with the process: PoCL takes 80 ms to free what its compiler has read.
void device_close(OpenDevice *open);
