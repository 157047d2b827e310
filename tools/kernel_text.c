// Prints the text of the kernel that renders a scene with one ray per work-item: what a GPU would be given,
// but that HAS_FMA and REPAIRS_DIVIDE are the default device's.
#include "host/base/fault.h"
#include "host/import/load.h"
#include "host/render/renderer.h"
#include "host/scene/scene.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static Precision precision_of(const char *name)
{
    for (Precision precision = 0; precision < PRECISION_COUNT; precision++)
        if (strcmp(precision_names[precision], name) == 0) return precision;
    fault("no precision %s", name);
}

int main(int argument_count, char **arguments)
{
    if (argument_count != 3) {
        fputs("usage: kernel_text SCENE PRECISION\n", stderr);
        return EXIT_FAILURE;
    }
    Scene scene = {0};
    DeviceList devices;
    Compute compute;
    MessageList messages = {0};
    device_list_open(&devices);
    const Device *device = device_choose(&devices, device_selector(NULL), &messages);
    Renderer *renderer = NULL;
    if (device && scene_load(&scene, arguments[1], &(SceneOptions){0}, &messages)) {
        compute_open(&compute, device);
        const RenderSettings settings = {.width = 1920,
                                         .height = 1080,
                                         .region_width = 1920,
                                         .region_height = 1080,
                                         .sample_count = 1,
                                         .bounce_count = 5,
                                         .lanes = 1,
                                         .precision = precision_of(arguments[2]),
                                         .shift_to_eye = true};
        renderer = renderer_open(&compute, &scene, &settings, &messages);
    }
    message_list_print(&messages, stderr);
    message_list_free(&messages);
    if (!renderer) return EXIT_FAILURE;
    char *text = renderer_kernel_text(renderer);
    fputs(text, stdout);
    free(text);
    renderer_close(renderer);
    scene_free(&scene);
    compute_close(&compute);
    device_list_close(&devices);
    return EXIT_SUCCESS;
}
