// glint view shows a scene in a window.
#include "host/base/exit_status.h"
#include "host/cli/commands.h"
#include "host/cli/image_output.h"
#include "host/cli/interrupts.h"
#include "host/cli/open_device.h"
#include "host/view/keys.h"
#include "host/view/window.h"
#include <stdio.h>
#include <string.h>

enum { SAMPLES_DEFAULT = 16 };

typedef struct {
    CommonOptions common;
    const char *scene;
    uint32_t sample_count;
    bool writes_camera;
} ViewOptions;

static bool camera_file_check(const Option *option, void *view_options)
{
    const ViewOptions *options = view_options;
    const char *camera = options->common.scene.camera ? options->common.scene.camera : options->scene;
    const bool is_stdin = strcmp(camera, "-") == 0;
    if (is_stdin)
        stderr_print("--%s: standard input cannot be written; name a YAML file", option->name);
    else if (!scene_is_yaml(camera))
        stderr_print("--%s: '%s' is not in YAML", option->name, camera);
    return !is_stdin && scene_is_yaml(camera);
}

static const Option command_options[] = {
    {"size", "WxH", "width and height of the window in pixels (default: the scene's own, else 1280 wide)",
     option_size, offsetof(ViewOptions, common.size)},
    {"samples", "N", "samples per pixel once the camera rests (default: 16)", option_count,
     offsetof(ViewOptions, sample_count), NUMBERS(1, SAMPLES_MAX)},
    {"write-camera", NULL, "C and K write the camera into its file, which is YAML", option_flag,
     offsetof(ViewOptions, writes_camera), .effect = camera_file_check}};

static void keys_print(void)
{
#define HELP_KEY(input, effect) printf("  %-12s  %s\n", input, effect);
    VIEW_KEY_LIST(HELP_KEY)
    putchar('\n');
}

static const CommandLine command_line = {
    .command = "view",
    .usage = "usage: glint view SCENE [OPTIONS]\n",
    .usage_print = keys_print,
    .groups = {OPTIONS(command_options), OPTIONS(ray_options), OPTIONS(precision_option), SCENE_OPTIONS},
    OPERANDS(SCENE, ViewOptions, scene)};

#if HAS_WINDOW

// Saves the image as glint render writes it.
static bool image_save(void *context, const char *path, const CompleteImage *image, MessageList *messages)
{
    const ViewOptions *view = context;
    const Transfer transfer = image->scene->color_meaning == COLORS_DISPLAY ? TRANSFER_NONE : TRANSFER_SRGB;
    const ImageOutputOptions options = {.path = path, .transfer = transfer, .bits = 8};
    const ImageOrigin origin = {view->scene, image->scene, image->settings,    &image->renderer,
                                1,           NULL,         &view->common.scene};
    ImageOutput *output = image_output_open(&options, &origin);
    double seconds;
    if (image_output_write(output, image->film, messages))
        return image_output_commit(output, messages, &seconds);
    image_output_abandon(output);
    return false;
}

static int window_show(ViewOptions *options, const Device *device)
{
    WindowOptions window = {
        .frames = {.device = device,
                   .scene_path = options->scene,
                   .scene_options = scene_options_of(&options->common),
                   .writes_camera = options->writes_camera,
                   .settings =
                       settings_whole(&options->common, options->common.size[0], options->common.size[1]),
                   .save = image_save,
                   .save_context = options},
        .size = {options->common.size[0], options->common.size[1]},
        .stop = interrupts_stop,
    };
    window.frames.settings.sample_count = options->sample_count;
    window.frames.settings.shift_to_eye = true;
    window.frames.settings.moves = true;
    interrupts_flag();
    switch (window_run(&window)) {
    case WINDOW_CLOSED:
        return EXIT_DONE;
    case WINDOW_STOPPED:
        return EXIT_INTERRUPTED;
    default:
        return EXIT_USER;
    }
}

static int scene_view(ViewOptions *options)
{
    DeviceList devices;
    const Device *device = device_find(&devices, options->common.device);
    const int status = device ? window_show(options, device) : EXIT_USER;
    device_list_close(&devices);
    return status;
}

#else

static int scene_view(ViewOptions *options)
{
    (void)options;
    fputs(
        "glint: this program was built without a window: `tools/setup --view` installs what it needs (in "
        "Debian: libsdl2-dev, libsdl2-ttf-dev, libfontconfig-dev, fonts-dejavu-core); then run make again\n",
        stderr);
    return EXIT_USER;
}

#endif

int command_view(int argument_count, char **arguments)
{
    ViewOptions options = {.common.settings.precision = PRECISION_SINGLE,
                           .common.settings.bounce_count = BOUNCES_DEFAULT,
                           .sample_count = SAMPLES_DEFAULT};
    const int status = command_line_read(&command_line, &options, argument_count, arguments);
    return status == OPTIONS_READ ? scene_view(&options) : status;
}
