// Prints the text of the kernel that renders a scene with one ray per work-item, as on a GPU, except that
// HAS_FMA and REPAIRS_DIVIDE are those of the default device.
#include "host/cli/open_device.h"
#include <stdio.h>
#include <stdlib.h>

static char *kernel_text(OpenDevice *open, const Scene *scene, const CommonOptions *options)
{
    RenderSettings settings = settings_whole(options, 1920, 1080);
    settings.bounce_count = BOUNCES_DEFAULT;
    settings.shift_to_eye = true;
    MessageList messages = {0};
    Renderer *renderer = renderer_open(&open->compute, scene, &settings, &messages);
    messages_print(&messages, NULL);
    char *text = renderer ? renderer_kernel_text(renderer) : NULL;
    renderer_close(renderer);
    return text;
}

int main(int argument_count, char **arguments)
{
    if (argument_count != 3) {
        fputs("usage: kernel_text SCENE PRECISION\n", stderr);
        return EXIT_FAILURE;
    }
    CommonOptions options = {.settings.lanes = 1};
    Scene scene;
    OpenDevice open;
    if (!precision_option->read(precision_option, arguments[2], &options) ||
        !scene_open(&scene, arguments[1], &options))
        return EXIT_FAILURE;
    int status = EXIT_FAILURE;
    if (device_open(&open, &(CommonOptions){0})) {
        char *text = kernel_text(&open, &scene, &options);
        if (text) fputs(text, stdout);
        status = device_close(&open, text ? EXIT_SUCCESS : EXIT_FAILURE);
        free(text);
    }
    scene_free(&scene);
    return status;
}
