#include "host/cli/render_options.h"

#include "host/base/exit_status.h"
#include "host/base/file.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define FIELD(member) offsetof(RenderOptions, member)

static bool region_read(const Option *option, const char *value, void *options)
{
    uint32_t *region = option_field(option, options);
    const char *at = value;
    for (int i = 0; i < 4; i++) {
        uint64_t number;
        if (!digits_read(at, &at, &number) || number > IMAGE_SIDE_MAX || *at != (i < 3 ? ',' : '\0')) break;
        region[i] = (uint32_t)number;
        at++;
        if (i == 3 && region[2] > 0 && region[3] > 0) return true;
    }
    return option_fault(option, value, "X,Y,WIDTH,HEIGHT in pixels from the top left");
}

// Reads a frame's number and advances past it.
static bool frame_read(const char **at, uint32_t *frame)
{
    uint64_t number;
    const bool is_valid = digits_read(*at, at, &number) && number < FRAMES_MAX;
    *frame = (uint32_t)number;
    return is_valid;
}

static bool frames_read(const Option *option, const char *value, void *render_options)
{
    RenderOptions *options = render_options;
    options->has_all_frames = strcmp(value, "all") == 0;
    options->first_frame = 0;
    options->frame_count = 1; // until the scene is read
    if (options->has_all_frames) return true;
    const char *at = value;
    bool is_valid = frame_read(&at, &options->first_frame);
    uint32_t last = options->first_frame;
    if (is_valid && *at == '-') {
        at++;
        is_valid = frame_read(&at, &last);
    }
    options->frame_count = last - options->first_frame + 1;
    if (is_valid && *at == '\0' && last >= options->first_frame) return true;
    return option_fault(option, value, "all, or A or A-B with 0 <= A <= B < %d", FRAMES_MAX);
}

FramePlace frame_place_of(const char *pattern)
{
    for (const char *start = file_base_name(pattern); (start = strchr(start, '%')) != NULL; start++) {
        const bool has_digits = start[1] == '0' && start[2] >= '1' && start[2] <= '9';
        const char *end = start + (has_digits ? 3 : 1);
        if (*end == 'd') return (FramePlace){start, end + 1, has_digits ? start[2] - '0' : 0};
    }
    return (FramePlace){0};
}

static bool budget_read(const Option *option, const char *value, void *options)
{
    char *end;
    ErrorBudget *budget = &((RenderOptions *)options)->budget;
    *budget = (ErrorBudget){.limit = strtod(value, &end), .metric = ERROR_RMSE};
    if (end == value || !(budget->limit > 0 && isfinite(budget->limit)) || (*end != ':' && *end != '\0'))
        return option_fault(option, value, "a number above 0, perhaps with a metric, such as 0.01:flip");
    static const Option metric = {"max-error", .offset = FIELD(budget.metric), NAMES(error_metric_names)};
    return *end == '\0' || option_choice(&metric, end + 1, options);
}

static bool is_to_stdout(const ImageOutputOptions *output)
{
    return output->path && image_output_is_stdout(output->path);
}

static const char *stdout_check(const RenderOptions *options)
{
    const bool is_stdout = is_to_stdout(&options->output);
    if (!is_stdout)
        return options->has_format ? "--format is for --output -; a file's name determines its format" : NULL;
    if (!options->has_format) return "--output - needs --format png, ppm or npy";
    if (options->skips_existing) return "--skip-existing is for files, but --output is -";
    if (options->output.aovs) return "--aov writes several files, which --output - cannot hold";
    if (timing_uses_stdout(options->timing))
        return "--timing=json and =trace print to standard output, where --output - writes the image";
    return NULL;
}

static ImageFormat output_format(const RenderOptions *options)
{
    const char *path = options->output.path;
    const bool may_be_folder = options->scenes.count > 1 || options->frame_count > 0;
    if (is_to_stdout(&options->output)) return options->output.stdout_format;
    return path && !(may_be_folder && output_is_folder(path)) ? image_format_of(path) : IMAGE_PNG;
}

// Checks the options that depend on the image's format.
static const char *display_check(const RenderOptions *options)
{
    const ImageOutputOptions *output = &options->output;
    const bool is_changed = output->exposure != 0 || output->tone != TONE_NONE || output->dither;
    const ImageFormat format = output_format(options);
    if (is_changed && image_format_holds_floats(format))
        return "--exposure, --tone and --dither are for PNG and PPM; EXR and NPY hold linear values";
    if (output->bits != 8 && image_format_holds_floats(format))
        return "--bits is for PNG and PPM; EXR and NPY hold floats";
    if (output->alpha && format != IMAGE_PNG && format != IMAGE_EXR)
        return "--alpha is for PNG and EXR; other formats need --aov coverage,backdrop";
    if (output->dither && output->bits != 8) return "--dither cannot be combined with --bits 16";
    return NULL;
}

bool output_is_folder(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

// Checks the options of several images.
static const char *several_check(const RenderOptions *options)
{
    const char *const path = is_to_stdout(&options->output) ? NULL : options->output.path;
    const bool has_scenes = options->scenes.count > 1;
    const FramePlace place = path ? frame_place_of(path) : (FramePlace){0};
    if (options->frame_count > 0 && has_scenes) return "--frames takes one scene, but several are given";
    if (options->checkpoint && has_scenes) return "--checkpoint takes one scene, but several are given";
    if (options->checkpoint && !options->skips_existing)
        return "--checkpoint of several frames needs --skip-existing, which keeps finished ones";
    if (options->checkpoint && !frame_place_of(options->checkpoint).start)
        return "--checkpoint of several frames must have a place for the number, such as bands-%04d";
    if (options->timing == TIMING_TRACE) return "--timing=trace takes one image, but several are given";
    if (has_scenes)
        return path && !output_is_folder(path) ? "--output of several scenes must be a folder" : NULL;
    if (strcmp(options->scenes.items[0], "-") == 0)
        return "--frames reads its scene for each frame, but standard input only once";
    if (path && !place.start && !output_is_folder(path))
        return "--output of several frames must be a folder, or have a place for the number, such as "
               "image-%04d.png";
    if (place.start && frame_place_of(place.end).start)
        return "--output has more than one place for the frame's number";
    return NULL;
}

// Sets the number of frames to that of the scene. Returns false with a message if it has none.
static bool frames_count(RenderOptions *options)
{
    OwnedScene scene = {0};
    MessageList messages = {0};
    const char *path = options->scenes.items[0];
    const SceneOptions scene_options = scene_options_of(&options->common);
    const bool is_read = scene_load(&scene, path, &scene_options, &messages);
    if (is_read) {
        message_list_free(&messages); // the warnings, which the first frame's scene repeats
        options->frame_count = scene.animation.frame_count;
        if (scene.animation.frame_count == 0)
            message_error(&messages,
                          "--frames all needs 'frames' in '%s'; or give a range, such as --frames 0-47",
                          path);
    }
    messages_print(&messages, path);
    return is_read && options->frame_count > 0;
}

#define HELP_LAYER(NAME, name, type, components, note) "\n" #name ": " note

static const char *const transfer_names[] = {"srgb", "none"}, *const bits_names[] = {"8", "16"},
                         *const format_names[] = {"png", "ppm", "npy"},
                         *const timing_names[] = {"text", "json", "trace"};
static const unsigned bits_values[] = {8, 16}, format_values[] = {IMAGE_PNG, IMAGE_PPM, IMAGE_NPY},
                      timing_styles[] = {TIMING_TEXT, TIMING_JSON, TIMING_TRACE};

static const Option command_options[] = {
    {"output", "FILE",
     ".png, .ppm, .exr or .npy; a folder for several scenes; - with --format (default: the scene's name with "
     ".png)",
     option_text, FIELD(output.path), .letter = 'o'},
    {"samples", "N", "samples per pixel (default: 1, at the center)", option_count, FIELD(sample_count),
     NUMBERS(1, SAMPLES_MAX)},
    {"region", "X,Y,W,H", "render these pixels only", region_read, FIELD(region), .given = FIELD(has_region)},
    {"aov", "LIST", "also write IMAGE.NAME.npy for each NAME in the list:" LAYER_LIST(HELP_LAYER), option_set,
     FIELD(output.aovs), NAMES(layer_names)},
    {"max-error", "E[:METRIC]",
     "choose the fastest precision within this error in linear light; METRIC: rmse, max or flip (default: "
     "rmse)",
     budget_read, FIELD(budget)},
    {"timing", "[=STYLE]", "report times of stages and launches: text, json or trace", option_choice,
     FIELD(timing), NAMES(timing_names), .values = timing_styles},
    {"transfer", "T", "transfer curve, srgb or none (default: srgb; none for .rt, .cfg, .nff and .dat)",
     option_choice, FIELD(output.transfer), NAMES(transfer_names), .given = FIELD(has_transfer)},
    {"bits", "N", "8 or 16 per channel of a PNG or PPM (default: 8)", option_choice, FIELD(output.bits),
     NAMES(bits_names), .values = bits_values},
    {"exposure", "STOPS", "make a PNG or PPM twice as bright per stop (default: 0)", option_number,
     FIELD(output.exposure), NUMBERS(-64, 64)},
    {"tone", "T", "tone curve of a PNG or PPM: none or filmic (default: none, which clips at 1)",
     option_choice, FIELD(output.tone), NAMES(tone_names)},
    {"dither", NULL, "dither 8-bit images to hide banding", option_flag, FIELD(output.dither)},
    {"alpha", NULL, "transparent background, for PNG and EXR", option_flag, FIELD(output.alpha)},
    {"checkpoint", "FILE", "keep finished bands in FILE; the same command resumes there", option_text,
     FIELD(checkpoint)},
    {"frames", "A[-B]",
     "render these frames, or all; FILEs have %d or %04d for the number (default: NAME-%04d.png)",
     frames_read, 0},
    {"skip-existing", NULL, "skip images whose files exist", option_flag, FIELD(skips_existing)},
    {"capture", "FOLDER", "write launches to an empty folder, for glint locate", option_text,
     FIELD(common.driver.capture_folder), .effect = effect_empty_folder},
    {"format", "F", "format of --output -: png, ppm or npy", option_choice, FIELD(output.stdout_format),
     NAMES(format_names), .values = format_values, .given = FIELD(has_format)},
    {"quiet", NULL, "print no progress", option_flag, FIELD(quiet)}};

static const char *options_check(void *render_options)
{
    RenderOptions *options = render_options;
    if (options->budget.limit > 0 && options->common.has_precision)
        return "--max-error chooses the precision; it cannot be combined with --precision";
    if (options->budget.limit > 0 && options->checkpoint)
        return "--max-error may choose another precision when a checkpoint is resumed; pass the "
               "precision that it chose to --precision instead";
    if (options->checkpoint && options->skips_existing && options->output.path &&
        strcmp(options->checkpoint, options->output.path) == 0)
        return "--skip-existing would keep a --checkpoint of the image's name";
    options->has_several = options->scenes.count > 1 || options->frame_count > 1 || options->has_all_frames;
    const char *what = stdout_check(options);
    if (!what) what = display_check(options);
    if (!what && options->has_several) what = several_check(options);
    if (!what && output_format(options) == IMAGE_UNKNOWN)
        what = "the name of --output must end in .png, .ppm, .exr or .npy";
    if (what || options->has_several) return what;
    if (options->skips_existing && timing_uses_stdout(options->timing))
        return "--skip-existing may leave --timing=json or =trace nothing to report";
    return NULL;
}

static const CommandLine command_line = {
    .command = "render",
    .usage = "usage: glint render SCENE... [OPTIONS] (SCENE -: YAML on standard input)\n",
    .groups = {OPTIONS(command_options), OPTIONS(size_option), OPTIONS(ray_options), OPTIONS(set_options),
               OPTIONS(devices_option), OPTIONS(reference_option), OPTIONS(precision_option),
               OPTIONS(common_options), OPTIONS(max_pixels_option), OPTIONS(driver_options),
               OPTIONS(perturb_option)},
    OPERANDS(SCENES, RenderOptions, scenes),
    .check = options_check};

int render_options_read(RenderOptions *options, int argument_count, char **arguments)
{
    *options = (RenderOptions){.common.settings.precision = PRECISION_SINGLE,
                               .common.settings.bounce_count = BOUNCES_DEFAULT,
                               .sample_count = 1,
                               .output.bits = 8};
    const int status = command_line_read(&command_line, options, argument_count, arguments);
    if (status == OPTIONS_READ && options->has_all_frames && !frames_count(options)) return EXIT_USER;
    return status;
}

bool render_settings_make(RenderSettings *settings, RenderOptions *options, const Scene *scene)
{
    *settings = settings_of_scene(&options->common, scene);
    settings->sample_count = options->sample_count;
    settings->hashes_scene = options->checkpoint != NULL;
    options->common.size[0] = settings->width;
    options->common.size[1] = settings->height;
    if (!options->has_region) return true;
    const uint32_t *region = options->region;
    if (region[0] + region[2] > settings->width || region[1] + region[3] > settings->height)
        return stderr_print("--region: %u,%u,%u,%u does not lie within the image of %ux%u pixels", region[0],
                            region[1], region[2], region[3], settings->width, settings->height);
    settings->region_x = region[0];
    settings->region_y = region[1];
    settings->region_width = region[2];
    settings->region_height = region[3];
    return true;
}
