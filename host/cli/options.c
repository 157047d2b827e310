#include "host/cli/options.h"

#include "host/cli/interrupts.h"
#include <stdio.h>
#include <string.h>
#include <strings.h>

const char *const lanes_choice_names[LANES_CHOICE_COUNT] = {"1", "4", "8", "16"};
const uint32_t lanes_choice_values[LANES_CHOICE_COUNT] = {1, 4, 8, 16};

static bool perturb_read(const Option *option, const char *value, void *options)
{
    CommonOptions *common = options;
    const char *at;
    uint64_t seed, scale = 1;
    bool is_valid = digits_read(value, &at, &seed) && seed >= 1 && seed <= UINT32_MAX;
    if (is_valid && *at == ':')
        is_valid = digits_read(at + 1, &at, &scale) && scale >= 1 && scale <= PERTURB_SCALE_MAX;
    if (!is_valid || *at != '\0')
        return option_fault(option, value, "a seed from 1 to %u, or SEED:SCALE with a scale from 1 to %d",
                            UINT32_MAX, PERTURB_SCALE_MAX);
    common->settings.perturb_seed = (uint32_t)seed;
    common->settings.perturb_scale = (uint32_t)scale;
    return true;
}

#define FIELD(member) offsetof(CommonOptions, member)

const Option size_option[] = {{"size", "WxH",
                               "width and height in pixels (default: the scene's own, else 1280 wide)",
                               option_size, FIELD(size)}};
const Option device_option[] = {
    {"device", "D",
     "the device: its index, part of its name, its PCI address, UUID, cpu or gpu (default: GLINT_DEVICE, "
     "else a GPU, else a CPU)",
     option_text, FIELD(device)}};
const Option devices_option[] = {
    {"device", "LIST",
     "all, or a comma-separated list of indices, parts of names, PCI addresses, UUIDs, cpu or gpu "
     "(default: GLINT_DEVICE, else a GPU, else a CPU)",
     option_text, FIELD(device)}};
const Option reference_option[] = {
    {"reference-device", "D",
     "the device that renders references and the pixels that certified re-renders (default: "
     "the device itself, else one with fp64)",
     option_text, FIELD(reference_device)}};
const Option precision_option[] = {
    PRECISION_OPTION("single, strict, double or certified (default: single)", PRECISION_COUNT)};
const Option common_options[] = {
    [COMMON_LANES] = {"lanes", "N",
                      "rays per work-item: 1, 4, 8 or 16 (default and CPU maximum: vector width)",
                      option_choice, FIELD(settings.lanes), NAMES(lanes_choice_names),
                      .values = lanes_choice_values},
    [COMMON_BVH] = {"bvh", "B",
                    "whether to use a BVH, which does not change the image: auto, on or off (default: auto)",
                    option_choice, FIELD(settings.bvh), NAMES(bvh_choice_names)},
    [COMMON_NO_CACHE] = {"no-cache", NULL, "ignore the kernel cache", option_flag, FIELD(settings.no_cache)},
    [COMMON_LENIENT] = {"lenient", NULL, "read dialects of .rt files", option_flag, FIELD(scene.lenient)}};
const Option max_pixels_option[] = {{"max-pixels", "N",
                                     "refuse input images with more pixels (default: 134217728)",
                                     option_count, FIELD(scene.max_pixels), NUMBERS(1, UINT32_MAX)}};
const Option ray_options[] = {
    [RAY_BOUNCES] = {"bounces", "N", "reflections and refractions of a ray, up to 255 (default: 5)",
                     option_count, FIELD(settings.bounce_count), NUMBERS(0, BOUNCES_MAX)},
    [RAY_MIN_CONTRIBUTION] = {"min-contribution", "W",
                              "trace no bounced ray whose weight in its pixel is below W (default: 0)",
                              option_number, FIELD(settings.min_contribution), NUMBERS(0, 1)}};
const Option set_options[] = {
    {"set", "PATH=VALUE", "set a value in YAML, such as camera.fov=60; may be repeated", option_texts,
     FIELD(overrides)},
    {"camera", "FILE", "use the camera of this scene", option_named_file, FIELD(scene.camera)}};
const Option perturb_option[] = {{"perturb", "SEED[:SCALE]",
                                  "inject the rounding error that OpenCL permits, times SCALE (default: 1)",
                                  perturb_read, 0}};
const Option driver_options[] = {
    {"work-group", "WxH",
     "width and height of a work-group in work-items (default: 8x8, 1x1 for lanes on a CPU, or fewer)",
     option_work_group, FIELD(driver.work_group)},
    {"build-options", "OPTIONS", "options for the driver's compiler, such as \"-cl-opt-disable\"",
     option_text, FIELD(driver.build_options)}};
const Option keep_kernels_option[] = {{"keep-kernels", "FOLDER",
                                       "write the text and the build log of each kernel that is built",
                                       option_text, FIELD(driver.kernel_folder), .effect = effect_folder}};

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
    OwnedMessageList printed = {0};
    messages_print_once(messages, &printed, path);
}

void messages_print_owned(MessageList *messages)
{
    messages_print(messages, NULL);
}

SceneOptions scene_options_of(const CommonOptions *common)
{
    SceneOptions options = common->scene;
    options.overrides = common->overrides.items;
    options.override_name = "--set";
    options.override_count = common->overrides.count;
    return options;
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
    OwnedMessageList printed = {0};
    return scene_open_once(scene, path, common, &printed);
}

bool output_overwrites_scene(const char *path, const Scene *scene, const char *scene_path)
{
    if (!scene_was_read_from(scene, scene_path, path)) return false;
    stderr_print("the output would overwrite '%s', from which '%s' is read; name another file with -o", path,
                 scene_path);
    return true;
}

RenderSettings settings_whole(const CommonOptions *common, uint32_t width, uint32_t height)
{
    RenderSettings settings = common->settings;
    settings.width = settings.region_width = width;
    settings.height = settings.region_height = height;
    settings.sample_count = 1;
    return settings;
}

RenderSettings settings_of_scene(const CommonOptions *common, const Scene *scene)
{
    uint32_t width = common->size[0], height = common->size[1];
    scene_choose_image_size(scene, &width, &height);
    RenderSettings settings = settings_whole(common, width, height);
    settings.shift_to_eye = true;
    settings.stop = interrupts_stop;
    return settings;
}
