// glint view shows a scene in a window.
#include "host/base/fault.h"
#include "host/cli/commands.h"
#include "host/cli/image_output.h"
#include "host/cli/options.h"
#include "host/cli/progress.h"
#include "host/view/keys.h"
#include "host/view/window.h"
#include <getopt.h>
#include <stdio.h>
#include <string.h>

enum {
    OPTION_SIZE = OPTION_OWN,
    OPTION_SAMPLES,
    OPTION_BOUNCES,
    OPTION_MIN_CONTRIBUTION,
    OPTION_WRITE_CAMERA
};

enum { SAMPLES_DEFAULT = 16 };

static const struct option long_options[] = {
    {"size", required_argument, NULL, OPTION_SIZE},
    {"samples", required_argument, NULL, OPTION_SAMPLES},
    {"bounces", required_argument, NULL, OPTION_BOUNCES},
    {"min-contribution", required_argument, NULL, OPTION_MIN_CONTRIBUTION},
    {"write-camera", no_argument, NULL, OPTION_WRITE_CAMERA},
    COMMON_LONG_OPTIONS,
    SET_LONG_OPTIONS,
    {"help", no_argument, NULL, 'h'},
    {0},
};

static const char help_text[] =
    "usage: glint view SCENE [OPTIONS]\n\n"
    "      --size WxH        of the window (default: the scene's own, else 1280 wide)\n"
    "      --samples N       per pixel, once the camera rests (default: 16)\n" //
    HELP_BOUNCES HELP_MIN_CONTRIBUTION
    "      --write-camera    C and K write the camera into its file, which is YAML\n" //
    HELP_SET HELP_DEVICE HELP_PRECISION HELP_COMMON HELP_HELP;

typedef struct {
    CommonOptions common;
    const char *scene;
    uint32_t width, height; // 0 if not given
    uint32_t sample_count, bounce_count;
    double min_contribution;
    bool writes_camera;
} ViewOptions;

static bool option_take(ViewOptions *options, int option, const char *value)
{
    bool valid = true;
    if (option_common(&options->common, option, value, &valid)) return valid;
    switch (option) {
    case OPTION_SIZE:
        return option_size("size", value, &options->width, &options->height);
    case OPTION_SAMPLES:
        return option_count("samples", value, 1, SAMPLES_MAX, &options->sample_count);
    case OPTION_BOUNCES:
        return option_count("bounces", value, 0, BOUNCES_MAX, &options->bounce_count);
    case OPTION_MIN_CONTRIBUTION:
        return option_fraction("min-contribution", value, &options->min_contribution);
    case OPTION_WRITE_CAMERA:
        return options->writes_camera = true;
    default:
        return false;
    }
}

// Prints the keys and the options.
static int help_print(void)
{
    const char *options = strchr(help_text, '\n') + 2;
    printf("%.*s", (int)(options - help_text), help_text);
#define HELP_KEY(input, effect) printf("  %-12s  %s\n", input, effect);
    VIEW_KEY_LIST(HELP_KEY)
    printf("\n%s", options);
    return EXIT_DONE;
}

static int options_read(ViewOptions *options, int argument_count, char **arguments)
{
    *options = (ViewOptions){.common.precision = PRECISION_SINGLE,
                             .sample_count = SAMPLES_DEFAULT,
                             .bounce_count = BOUNCES_DEFAULT};
    int option;
    while ((option = getopt_long(argument_count, arguments, "h", long_options, NULL)) != -1) {
        if (option == 'h') return help_print();
        if (option == '?' || !option_take(options, option, optarg)) return EXIT_USER;
    }
    if (!option_only_scene("view", argument_count, arguments)) return EXIT_USER;
    options->scene = arguments[optind];
    const char *camera = options->common.camera ? options->common.camera : options->scene;
    if (options->writes_camera && strcmp(camera, "-") == 0) {
        fprintf(stderr, "glint: --write-camera: standard input cannot be written; name a YAML file\n");
        return EXIT_USER;
    }
    if (options->writes_camera && !scene_is_yaml(camera)) {
        fprintf(stderr, "glint: --write-camera: '%s' is not in YAML\n", camera);
        return EXIT_USER;
    }
    return OPTIONS_READ;
}

#if HAS_WINDOW

// Saves the image as glint render writes it.
static bool image_save(void *context, const char *path, const Scene *scene, const RenderSettings *settings,
                       Renderer *renderer, const Film *film, MessageList *messages)
{
    const ViewOptions *view = context;
    const Transfer transfer = scene->color_meaning == COLORS_DISPLAY ? TRANSFER_NONE : TRANSFER_SRGB;
    const ImageOutputOptions options = {.path = path, .transfer = transfer, .bits = 8};
    ImageOutput *output = image_output_open(&options, view->scene, scene, settings, &renderer, 1, NULL);
    double seconds;
    if (image_output_write(output, film, messages)) return image_output_commit(output, messages, &seconds);
    image_output_abandon(output);
    return false;
}

static int scene_view(ViewOptions *options, const Device *device)
{
    WindowOptions window = {
        .frames = {.device = device,
                   .scene_path = options->scene,
                   .scene_options = scene_options_of(&options->common),
                   .settings = settings_whole(&options->common, options->width, options->height),
                   .save = image_save,
                   .save_context = options},
        .size = {options->width, options->height},
        .writes_camera = options->writes_camera,
        .stop = progress_interrupted,
    };
    window.frames.settings.sample_count = options->sample_count;
    window.frames.settings.bounce_count = options->bounce_count;
    window.frames.settings.min_contribution = options->min_contribution;
    window.frames.settings.shift_to_eye = true;
    window.frames.settings.moves = true;
    Progress progress;
    progress_open(&progress, true); // so that signals only set the flag
    switch (window_run(&window)) {
    case WINDOW_CLOSED:
        return EXIT_DONE;
    case WINDOW_STOPPED:
        return EXIT_INTERRUPTED;
    default:
        return EXIT_USER;
    }
}

int command_view(int argument_count, char **arguments)
{
    ViewOptions options;
    int status = options_read(&options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    DeviceList devices;
    const Device *device = device_find(&devices, options.common.device);
    status = device ? scene_view(&options, device) : EXIT_USER;
    device_list_close(&devices);
    return status;
}

#else

int command_view(int argument_count, char **arguments)
{
    ViewOptions options;
    int status = options_read(&options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    fputs(
        "glint: this program was built without a window: `tools/setup --view` installs what it needs (in "
        "Debian: libsdl2-dev, libsdl2-ttf-dev, libfontconfig-dev, fonts-dejavu-core); then run make again\n",
        stderr);
    return EXIT_USER;
}

#endif
