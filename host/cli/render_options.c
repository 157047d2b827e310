#include "host/cli/render_options.h"
#include "host/cli/progress.h"
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum {
    OPTION_SIZE = OPTION_OWN,
    OPTION_SAMPLES,
    OPTION_REGION,
    OPTION_AOV,
    OPTION_MAX_ERROR,
    OPTION_TIMING,
    OPTION_TRANSFER,
    OPTION_BITS,
    OPTION_EXPOSURE,
    OPTION_TONE,
    OPTION_DITHER,
    OPTION_BOUNCES,
    OPTION_MIN_CONTRIBUTION,
    OPTION_ALPHA,
    OPTION_CHECKPOINT,
    OPTION_FRAMES,
    OPTION_SKIP_EXISTING,
    OPTION_CAPTURE,
    OPTION_FORMAT,
    OPTION_QUIET
};

static const struct option long_options[] = {
    {"output", required_argument, NULL, 'o'},
    {"size", required_argument, NULL, OPTION_SIZE},
    {"samples", required_argument, NULL, OPTION_SAMPLES},
    {"region", required_argument, NULL, OPTION_REGION},
    {"aov", required_argument, NULL, OPTION_AOV},
    {"max-error", required_argument, NULL, OPTION_MAX_ERROR},
    {"timing", optional_argument, NULL, OPTION_TIMING},
    {"transfer", required_argument, NULL, OPTION_TRANSFER},
    {"bits", required_argument, NULL, OPTION_BITS},
    {"exposure", required_argument, NULL, OPTION_EXPOSURE},
    {"tone", required_argument, NULL, OPTION_TONE},
    {"dither", no_argument, NULL, OPTION_DITHER},
    {"bounces", required_argument, NULL, OPTION_BOUNCES},
    {"min-contribution", required_argument, NULL, OPTION_MIN_CONTRIBUTION},
    {"alpha", no_argument, NULL, OPTION_ALPHA},
    {"checkpoint", required_argument, NULL, OPTION_CHECKPOINT},
    {"frames", required_argument, NULL, OPTION_FRAMES},
    {"skip-existing", no_argument, NULL, OPTION_SKIP_EXISTING},
    {"capture", required_argument, NULL, OPTION_CAPTURE},
    {"format", required_argument, NULL, OPTION_FORMAT},
    {"quiet", no_argument, NULL, OPTION_QUIET},
    COMMON_LONG_OPTIONS,
    SET_LONG_OPTIONS,
    PERTURB_LONG_OPTION,
    DRIVER_LONG_OPTIONS,
    REFERENCE_LONG_OPTION,
    {"help", no_argument, NULL, 'h'},
    {0},
};

#define HELP_LAYER(NAME, name, type, components, note) "                          " #name ": " note "\n"

static const char help_text[] =
    "usage: glint render SCENE... [OPTIONS] (SCENE -: YAML on standard input)\n\n"
    "  -o, --output FILE     .png, .ppm, .exr or .npy; a folder for several scenes; - with --format "
    "(default:\n"
    "                        the scene's name with .png)\n" HELP_SET
    "      --size WxH        of the image (default: the scene's own, else 1280 wide)\n"
    "      --samples N       per pixel (default: 1, at the center)\n"
    "      --region X,Y,W,H  render these pixels only\n"
    "      --aov LIST        more files, IMAGE.NAME.npy for each NAME of:\n" //
    LAYER_LIST(
        HELP_LAYER) "      --max-error E[:METRIC]\n"
                    "                        choose the fastest precision within this error in linear light; "
                    "METRIC: rmse,\n"
                    "                        max or flip (default: rmse)\n"
                    "      --timing[=STYLE]  report times of stages and launches: text, json or trace\n"
                    "      --transfer T      srgb or none (default: srgb; none for .rt, .cfg, .nff and "
                    ".dat)\n"
                    "      --bits N          8 or 16 per channel of a PNG or PPM (default: 8)\n"
                    "      --exposure STOPS  of a PNG or PPM: twice as bright per stop (default: 0)\n"
                    "      --tone T          curve of a PNG or PPM, none or filmic (default: none, which "
                    "clips at 1)\n"
                    "      --dither          hide the steps of 8 bits in a pattern\n"
                    "      --alpha           transparent background, for PNG and EXR\n"
                    "      --checkpoint FILE\n"
                    "                        keep finished bands in FILE; the same command resumes there\n"
                    "      --frames A[-B]    render these frames, or all; FILEs have %d or %04d for the "
                    "number\n"
                    "                        (default: NAME-%04d.png)\n"
                    "      --skip-existing   leave out images that exist\n"
                    "      --capture FOLDER  write launches to an empty folder, for glint locate\n"
                    "      --format F        format of --output -: png, ppm or npy\n"
                    "      --quiet           no progress\n" //
    HELP_BOUNCES HELP_MIN_CONTRIBUTION HELP_DEVICES HELP_REFERENCE HELP_PRECISION HELP_COMMON HELP_DRIVER
        HELP_PERTURB HELP_HELP;

static bool region_read(const char *value, uint32_t region[4])
{
    const char *at = value;
    for (int i = 0; i < 4; i++) {
        char *end;
        errno = 0;
        unsigned long number = strtoul(at, &end, 10);
        bool digit_first = *at >= '0' && *at <= '9';
        if (!digit_first || errno != 0 || number > IMAGE_SIDE_MAX || *end != (i < 3 ? ',' : '\0')) break;
        region[i] = (uint32_t)number;
        at = end + 1;
        if (i == 3 && region[2] > 0 && region[3] > 0) return true;
    }
    fprintf(stderr, "glint: --region: expected X,Y,WIDTH,HEIGHT in pixels from the top left, not \"%s\"\n",
            value);
    return false;
}

// Reads a frame's number and moves behind it.
static bool frame_read(const char **at, uint32_t *frame)
{
    char *end;
    const unsigned long number = strtoul(*at, &end, 10);
    const bool is_valid = **at >= '0' && **at <= '9' && number < FRAMES_MAX;
    *frame = (uint32_t)number;
    *at = end;
    return is_valid;
}

static bool frames_read(const char *value, RenderOptions *options)
{
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
    fprintf(stderr, "glint: --frames: expected all, or A or A-B with 0 <= A <= B < %d, not \"%s\"\n",
            FRAMES_MAX, value);
    return false;
}

FramePlace frame_place_of(const char *pattern)
{
    const char *slash = strrchr(pattern, '/'), *name = slash ? slash + 1 : pattern;
    for (const char *start = name; (start = strchr(start, '%')) != NULL; start++) {
        const bool has_digits = start[1] == '0' && start[2] >= '1' && start[2] <= '9';
        const char *end = start + (has_digits ? 3 : 1);
        if (*end == 'd') return (FramePlace){start, end + 1, has_digits ? start[2] - '0' : 0};
    }
    return (FramePlace){0};
}

static bool exposure_read(const char *value, double *exposure)
{
    enum { STOPS_MAX = 64 };
    char *end;
    *exposure = strtod(value, &end);
    if (end != value && *end == '\0' && fabs(*exposure) <= STOPS_MAX) return true;
    fprintf(stderr, "glint: --exposure: expected a number of stops from -%d to %d, not \"%s\"\n", STOPS_MAX,
            STOPS_MAX, value);
    return false;
}

static bool is_to_stdout(const ImageOutputOptions *output)
{
    return output->path && image_output_is_stdout(output->path);
}

// Rejects options that standard output cannot have, or --format without it. Returns false with a message.
static bool stdout_fits(const RenderOptions *options)
{
    const bool is_stdout = is_to_stdout(&options->output);
    if (is_stdout && !options->has_format)
        option_usage_fault("render", "--output - needs --format png, ppm or npy");
    else if (!is_stdout && options->has_format)
        option_usage_fault("render", "--format is for --output -; the name of a file has its format");
    else if (is_stdout && options->skips_existing)
        option_usage_fault("render", "--skip-existing is for files, but --output is -");
    else if (is_stdout && options->output.aovs)
        option_usage_fault("render", "--aov writes more files than --output - can take");
    else if (is_stdout && timing_uses_stdout(options->timing))
        option_usage_fault("render",
                           "--timing=json and =trace print to standard output, which --output - takes");
    else
        return true;
    return false;
}

// Rejects options of display values that the image does not have. Returns false with a message.
static bool display_fits(const ImageOutputOptions *output)
{
    const bool is_changed = output->exposure != 0 || output->tone != TONE_NONE || output->dither;
    const ImageFormat format =
        is_to_stdout(output) || !output->path ? output->stdout_format : image_format_of(output->path);
    if (is_changed && image_output_holds_floats(format))
        option_usage_fault(
            "render", "--exposure, --tone and --dither are for PNG and PPM; EXR and NPY hold linear values");
    else if (output->alpha && format != IMAGE_PNG && format != IMAGE_EXR)
        option_usage_fault("render",
                           "--alpha is for PNG and EXR; other formats need --aov coverage,backdrop");
    else if (output->dither && output->bits != 8)
        option_usage_fault("render", "--dither is for 8 bits; it cannot be combined with --bits 16");
    else
        return true;
    return false;
}

static bool option_take(RenderOptions *options, int option, const char *value)
{
    static const char *const transfers[] = {"srgb", "none"};
    unsigned choice;
    bool valid = true;
    if (option_common(&options->common, option, value, &valid)) return valid;
    switch (option) {
    case 'o':
        options->output.path = value;
        return true;
    case OPTION_SIZE:
        return option_size("size", value, &options->width, &options->height);
    case OPTION_SAMPLES:
        return option_count("samples", value, 1, SAMPLES_MAX, &options->sample_count);
    case OPTION_REGION:
        options->has_region = true;
        return region_read(value, options->region);
    case OPTION_AOV:
        return option_set("aov", value, layer_names, LAYER_COUNT, &options->output.aovs);
    case OPTION_MAX_ERROR:
        return option_error_budget("max-error", value, &options->budget);
    case OPTION_TIMING:
        return timing_style_read(value, &options->timing);
    case OPTION_TRANSFER:
        if (!option_choice("transfer", value, transfers, 2, &choice)) return false;
        options->output.transfer = choice == 0 ? TRANSFER_SRGB : TRANSFER_NONE;
        options->has_transfer = true;
        return true;
    case OPTION_BITS:
        if (!option_choice("bits", value, (const char *const[]){"8", "16"}, 2, &choice)) return false;
        options->output.bits = choice == 0 ? 8 : 16;
        return true;
    case OPTION_EXPOSURE:
        return exposure_read(value, &options->output.exposure);
    case OPTION_TONE:
        if (!option_choice("tone", value, tone_names, TONE_COUNT, &choice)) return false;
        options->output.tone = (Tone)choice;
        return true;
    case OPTION_DITHER:
        options->output.dither = true;
        return true;
    case OPTION_ALPHA:
        options->output.alpha = true;
        return true;
    case OPTION_BOUNCES:
        return option_count("bounces", value, 0, BOUNCES_MAX, &options->bounce_count);
    case OPTION_MIN_CONTRIBUTION:
        return option_fraction("min-contribution", value, &options->min_contribution);
    case OPTION_CHECKPOINT:
        options->checkpoint = value;
        return true;
    case OPTION_FRAMES:
        return frames_read(value, options);
    case OPTION_FORMAT:
        if (!option_choice("format", value, (const char *const[]){"png", "ppm", "npy"}, 3, &choice))
            return false;
        options->output.stdout_format = (const ImageFormat[]){IMAGE_PNG, IMAGE_PPM, IMAGE_NPY}[choice];
        options->has_format = true;
        return true;
    case OPTION_SKIP_EXISTING:
        options->skips_existing = true;
        return true;
    case OPTION_CAPTURE:
        options->common.capture_folder = value;
        return option_empty_folder("capture", value);
    case OPTION_QUIET:
        options->quiet = true;
        return true;
    default:
        return false;
    }
}

bool output_is_folder(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

// Rejects options that suit one image alone. Returns false with a message.
static bool several_fit(const RenderOptions *options)
{
    const char *const path = is_to_stdout(&options->output) ? NULL : options->output.path;
    const bool has_scenes = options->scene_count > 1;
    const FramePlace place = path ? frame_place_of(path) : (FramePlace){0};
    if (options->frame_count > 0 && has_scenes)
        option_usage_fault("render", "--frames takes one scene, but several are given");
    else if (options->checkpoint && has_scenes)
        option_usage_fault("render", "--checkpoint takes one scene, but several are given");
    else if (options->checkpoint && !options->skips_existing)
        option_usage_fault("render",
                           "--checkpoint of several frames needs --skip-existing, which keeps finished ones");
    else if (options->checkpoint && !frame_place_of(options->checkpoint).start)
        option_usage_fault(
            "render", "--checkpoint of several frames must have a place for the number, such as bands-%04d");
    else if (options->timing == TIMING_TRACE)
        option_usage_fault("render", "--timing=trace takes one image, but several are given");
    else if (has_scenes && path && !output_is_folder(path))
        option_usage_fault("render", "--output of several scenes must be a folder");
    else if (!has_scenes && strcmp(options->scenes[0], "-") == 0)
        option_usage_fault("render", "--frames reads its scene for each frame, but standard input only once");
    else if (!has_scenes && path && !place.start && !output_is_folder(path))
        option_usage_fault("render", "--output of several frames must be a folder, or have a place for the "
                                     "number, such as image-%04d.png");
    else if (!has_scenes && place.start && frame_place_of(place.end).start)
        option_usage_fault("render", "--output has more than one place for the frame's number");
    else
        return true;
    return false;
}

// Sets the number of frames to that of the scene. Returns false with a message if it has none.
static bool frames_count(RenderOptions *options)
{
    Scene scene;
    MessageList messages = {0};
    const char *path = options->scenes[0];
    const SceneOptions scene_options = scene_options_of(&options->common);
    const bool is_read = scene_load(&scene, path, &scene_options, &messages);
    if (is_read) {
        message_list_free(&messages); // the warnings, which the first frame's scene repeats
        options->frame_count = scene.frame_count;
        if (scene.frame_count == 0)
            message_error(&messages, "--frames all: '%s' has no 'frames'; name them, such as 0-47", path);
        scene_free(&scene);
    }
    messages_print(&messages, path);
    return is_read && options->frame_count > 0;
}

int render_options_read(RenderOptions *options, int argument_count, char **arguments)
{
    *options = (RenderOptions){.common.precision = PRECISION_SINGLE,
                               .sample_count = 1,
                               .bounce_count = BOUNCES_DEFAULT,
                               .output.bits = 8};
    int option;
    while ((option = getopt_long(argument_count, arguments, "o:h", long_options, NULL)) != -1) {
        if (option == 'h') return option_help(help_text);
        if (option == '?' || !option_take(options, option, optarg)) return EXIT_USER;
    }
    if (optind == argument_count) return option_usage_fault("render", "no scene given");
    if (options->budget.limit > 0 && options->common.has_precision)
        return option_usage_fault(
            "render", "--max-error chooses the precision; it cannot be combined with --precision");
    if (options->budget.limit > 0 && options->checkpoint)
        return option_usage_fault("render",
                                  "--max-error may choose another precision when a checkpoint is resumed; "
                                  "name its choice with --precision");
    if (options->checkpoint && options->skips_existing && options->output.path &&
        strcmp(options->checkpoint, options->output.path) == 0)
        return option_usage_fault("render", "--skip-existing would keep a --checkpoint of the image's name");
    if (!stdout_fits(options) || !display_fits(&options->output)) return EXIT_USER;
    options->scenes = arguments + optind;
    options->scene_count = (size_t)(argument_count - optind);
    options->has_several = options->scene_count > 1 || options->frame_count > 1 || options->has_all_frames;
    if (options->has_several && !several_fit(options)) return EXIT_USER;
    if (!options->has_several && options->skips_existing && timing_uses_stdout(options->timing))
        return option_usage_fault("render",
                                  "--skip-existing may leave --timing=json or =trace nothing to report");
    return !options->has_all_frames || frames_count(options) ? OPTIONS_READ : EXIT_USER;
}

bool render_settings_make(RenderSettings *settings, RenderOptions *options, const Scene *scene)
{
    scene_choose_image_size(scene, &options->width, &options->height);
    if (!options->has_region) {
        options->region[2] = options->width;
        options->region[3] = options->height;
    }
    const uint32_t *region = options->region;
    if (region[0] + region[2] > options->width || region[1] + region[3] > options->height) {
        fprintf(stderr, "glint: --region: %u,%u,%u,%u does not lie within the image of %ux%u pixels\n",
                region[0], region[1], region[2], region[3], options->width, options->height);
        return false;
    }
    *settings = settings_whole(&options->common, options->width, options->height);
    settings->region_x = region[0];
    settings->region_y = region[1];
    settings->region_width = region[2];
    settings->region_height = region[3];
    settings->sample_count = options->sample_count;
    settings->bounce_count = options->bounce_count;
    settings->min_contribution = options->min_contribution;
    settings->shift_to_eye = true;
    settings->stop = progress_stops;
    settings->hashes_scene = options->checkpoint != NULL;
    return true;
}
