// The options that commands share, and the scenes, settings and messages derived from them.
#pragma once

#include "host/cli/format.h"
#include "host/import/load.h"
#include "host/render/renderer.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The options for drivers, as Device has them.
typedef struct {
    const char *build_options;                  // NULL if not given
    uint32_t work_group[2];                     // 0 if not given
    const char *kernel_folder, *capture_folder; // NULL if not given
} DriverOptions;

// The options that several commands share, of which each command offers some. They are the first member of
// the struct of every command that offers any.
typedef struct {
    const char *device, *reference_device; // NULL if not given
    DriverOptions driver;
    SceneOptions scene;      // without its overrides
    OptionTexts overrides;   // --set, in order
    RenderSettings settings; // without the image's size and samples
    bool has_precision;      // whether --precision was given
    unsigned precisions;     // a set for commands that measure several
    uint32_t size[2];        // of the image, 0 if not given
    ReportOptions report;
} CommonOptions;

// One table for each set of options that several commands share.
extern const Option size_option[1], device_option[1], devices_option[1], reference_option[1];
extern const Option precision_option[1];
enum { COMMON_LANES, COMMON_BVH, COMMON_NO_CACHE, COMMON_LENIENT, COMMON_COUNT };
extern const Option common_options[COMMON_COUNT];
enum { RAY_BOUNCES, RAY_MIN_CONTRIBUTION, RAY_COUNT };
extern const Option ray_options[RAY_COUNT];
extern const Option set_options[2];         // of scenes whose values can be set
extern const Option perturb_option[1];      // of commands that render or trace
extern const Option driver_options[2];      // of commands that measure drivers
extern const Option keep_kernels_option[1]; // of commands that examine drivers
extern const Option max_pixels_option[1];   // of commands that read images

// The groups of every command that reads a scene and opens one device.
#define SCENE_OPTIONS                                                                                        \
    OPTIONS(set_options), OPTIONS(device_option), OPTIONS(common_options), OPTIONS(max_pixels_option)

// The option of the first `count` precisions, one of which is chosen.
#define PRECISION_OPTION(help_text, count)                                                                   \
    {                                                                                                        \
        "precision", "P", help_text, option_choice, offsetof(CommonOptions, settings.precision),             \
            .given = offsetof(CommonOptions, has_precision), .names = precision_names, .name_count = count   \
    }
// The option of a set of precisions, with the default that its help names.
#define PRECISIONS_OPTION(default_names)                                                                     \
    {                                                                                                        \
        "precision", "LIST", "any of single, strict, double, certified (default: " default_names ")",        \
            option_set, offsetof(CommonOptions, precisions), NAMES(precision_names)                          \
    }

enum { BOUNCES_DEFAULT = 5 };

enum { LANES_CHOICE_COUNT = 4 };
extern const char *const lanes_choice_names[LANES_CHOICE_COUNT];
extern const uint32_t lanes_choice_values[LANES_CHOICE_COUNT];

// Returns true with a message if writing `path` would overwrite a file that the scene was read from.
bool output_overwrites_scene(const char *path, const Scene *scene, const char *scene_path);

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
// Declares a list of messages that are printed and freed where its scope ends. It must be initialized.
#define PrintedMessages __attribute__((cleanup(messages_print_owned))) MessageList
void messages_print_owned(MessageList *messages);

// Returns settings for a full image with the common options and one sample. The scene is not shifted to the
// eye.
RenderSettings settings_whole(const CommonOptions *common, uint32_t width, uint32_t height);
// Returns settings for a full image of the scene with one sample. The scene chooses a size that the options
// leave open, and is shifted to the eye. The render stops when the user interrupts.
RenderSettings settings_of_scene(const CommonOptions *common, const Scene *scene);
