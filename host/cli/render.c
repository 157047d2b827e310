// glint render renders a scene file to an image.
#include "host/cli/render.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/checkpoint_key.h"
#include "host/cli/commands.h"
#include "host/cli/progress.h"
#include "host/cli/render_devices.h"
#include "host/cli/render_options.h"
#include "host/cli/shutter.h"
#include "host/import/load.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct {
    ImageOutput *output; // NULL unless this is the last time
    Shutter *shutter;
    OpenDevices *devices;
    MessageList *messages;
    const RenderSettings *settings;
    bool is_quiet;
} BandContext;

// Prints one estimate of the time and the size of a long render.
static void estimate_print(BandContext *take, double fraction_done)
{
    enum { SECONDS_MIN = 60 };
    if (take->is_quiet || take->shutter->is_estimated) return;
    double left = progress_seconds_left(&take->shutter->progress, fraction_done);
    take->shutter->is_estimated = left >= 0;
    if (left < SECONDS_MIN) return;
    const double bytes = take->output ? image_output_bytes(take->output) : 0;
    fprintf(stderr, "glint: %u x %u pixels: about %s%s%s\n", take->settings->region_width,
            take->settings->region_height, text_duration(left).text, bytes > 0 ? " and at most " : "",
            bytes > 0 ? text_size(bytes).text : "");
}

static bool band_take(void *context, const Film *band, double fraction_done)
{
    BandContext *take = context;
    Shutter *shutter = take->shutter;
    bool is_taken = true;
    if (progress_interrupted()) return false;
    if (shutter->time_count == 1) {
        is_taken = image_output_write(take->output, band, take->messages);
    } else if (take->output) {
        Film mean = shutter_mean(shutter, band);
        is_taken = image_output_write(take->output, &mean, take->messages);
        free(mean.layers[LAYER_COLOR]);
    } else {
        shutter_add(shutter, band);
    }
    fraction_done = shutter_fraction(shutter, fraction_done);
    if (is_taken) estimate_print(take, fraction_done);
    progress_show(&shutter->progress, fraction_done);
    return is_taken;
}

static void device_drop(void *context, size_t index)
{
    OpenDevices *devices = ((BandContext *)context)->devices;
    if (index < devices->count) devices_drop(devices, index); // otherwise a rank, which printed the reason
}

// Opens the checkpoint. Returns true if none is requested, and false with messages if it cannot be opened.
static bool checkpoint_start(Checkpoint **checkpoint, const RenderOptions *options,
                             const RenderSettings *settings, Renderer *const *renderers, size_t count,
                             const Ranks *ranks, MessageList *messages)
{
    *checkpoint = NULL;
    if (!options->checkpoint) return true;
    Text key = {0};
    checkpoint_key(&key, settings, options->output.aovs, renderers, count, ranks);
    const FilmHeader film = renderer_film_header(renderers[0], options->output.aovs);
    *checkpoint = checkpoint_open(options->checkpoint, text_c(&key), &film, messages);
    text_free(&key);
    return *checkpoint != NULL;
}

// Prints what is left of a render that ended early.
static void rest_print(const RenderOptions *options)
{
    if (progress_interrupted() && options->has_format)
        fprintf(stderr, "glint: interrupted: the image on standard output is incomplete\n");
    else if (progress_interrupted())
        fprintf(stderr, "glint: interrupted: no image was written; an earlier %s is as it was\n",
                options->output.path);
    if (options->checkpoint)
        fprintf(stderr, "glint: run the same command again to continue; finished bands are in '%s'\n",
                options->checkpoint);
}

// Renders one image, or one of the shutter's times. With the last, writes the files and reports how long it
// took.
static int image_render(RenderOptions *options, const Scene *scene, OpenDevices *devices,
                        Renderer *const *renderers, Ranks *ranks, const RenderSettings *settings,
                        Checkpoint *checkpoint, Shutter *shutter, HostTimes *times, MessageList *messages)
{
    const bool is_last = shutter_is_last(shutter);
    if (shutter->time == 0) progress_open(&shutter->progress, options->quiet);
    ImageOutput *output = is_last ? image_output_open(&options->output, options->scene, scene, settings,
                                                      renderers, devices->count, ranks)
                                  : NULL;
    BandContext context = {.output = output,
                           .shutter = shutter,
                           .devices = devices,
                           .messages = messages,
                           .settings = settings,
                           .is_quiet = options->quiet};
    const unsigned aovs = is_last ? options->output.aovs : 0;
    if (ranks) ranks->film = renderer_film_header(renderers[0], aovs);
    const RemoteWorkers remote = {.count = ranks ? ranks->count : 0,
                                  .serve = ranks ? ranks->serve : NULL,
                                  .shares = ranks ? ranks->shares : NULL,
                                  .context = ranks};
    const RenderJob job = {.renderers = renderers,
                           .count = devices->count,
                           .aovs = aovs,
                           .sink = band_take,
                           .dropped = device_drop,
                           .context = &context,
                           .checkpoint = checkpoint,
                           .remote = ranks ? &remote : NULL};
    stage_begin(times->stage, "rendering", NULL, 0);
    double start = clock_seconds();
    bool whole = render_job_run(&job);
    times->render_seconds += clock_seconds() - start;
    if (output) times->repeats = image_output_repeats(output);
    progress_close(&shutter->progress);
    stage_begin(times->stage, "writing", NULL, 0);
    if (whole && output)
        whole = image_output_commit(output, messages, &times->encode_seconds);
    else if (output)
        image_output_abandon(output);
    if (checkpoint) checkpoint_close(checkpoint, whole, messages);
    stage_end(times->stage);
    if (whole && times->repeats.undecided > 0)
        message_warning(messages, "%llu sample%s undecided, as at precision double",
                        (unsigned long long)times->repeats.undecided,
                        times->repeats.undecided == 1 ? " is" : "s are");
    const bool is_complete = whole && is_last;
    for (size_t i = 0; i < devices->count && is_complete; i++)
        if (renderer_report(renderers[i])->is_out_of_line)
            message_warning(
                messages,
                "the compiler of the device \"%s\" failed on a kernel with inlined functions; the kernel is "
                "built with functions out of line, which is slower",
                renderer_report(renderers[i])->device->name);
    bool faulty = message_count(messages, MESSAGE_ERROR) > 0;
    messages_print(messages, NULL);
    int status = whole                    ? EXIT_DONE
                 : faulty                 ? (options->has_format ? EXIT_MACHINE : EXIT_USER)
                 : progress_interrupted() ? EXIT_INTERRUPTED
                                          : EXIT_MACHINE;
    if (!whole) rest_print(options);
    if (ranks && is_last && options->timing == TIMING_TRACE)
        fprintf(stderr, "glint: --timing=trace has the first rank's devices only\n");
    if (is_complete && options->timing != TIMING_NONE)
        timing_print(options->timing, renderers, devices->count, ranks, settings, times);
    return status;
}

// Stores the precision that --max-error chooses in the settings.
static int precision_choose(Pilot *pilot, const RenderOptions *options, RenderSettings *settings,
                            const Scene *scene, Compute *compute)
{
    MessageList messages = {0};
    Progress progress;
    progress_open(&progress, true); // so that signals only set the flag
    const bool chosen = pilot_run(pilot, &options->budget, compute, scene, settings, &messages);
    progress_close(&progress);
    const bool is_unfit = messages.count > 0;
    messages_print(&messages, NULL);
    if (!chosen) return is_unfit ? EXIT_USER : progress_interrupted() ? EXIT_INTERRUPTED : EXIT_MACHINE;
    settings->precision = pilot->chosen;
    if (options->quiet) return EXIT_DONE;
    Text line = {0};
    pilot_describe(&line, pilot);
    fprintf(stderr, "glint: --max-error: %s, %.0f ms\n", text_c(&line), 1e3 * pilot->seconds);
    text_free(&line);
    return EXIT_DONE;
}

static int scene_render(RenderOptions *options, const Scene *scene, RenderDevices *open, Ranks *ranks,
                        Shutter *shutter, HostTimes *times)
{
    OpenDevices *devices = &open->devices;
    RenderSettings settings;
    Pilot pilot;
    if (!render_settings_make(&settings, options, scene)) return EXIT_USER;
    shutter_choose_samples(shutter, &settings);
    if (options->budget.limit > 0) {
        const int status = precision_choose(&pilot, options, &settings, scene, devices->items[0].compute);
        if (status != EXIT_DONE) return status;
        times->pilot = options->output.pilot = &pilot;
    }
    if (!options->has_transfer)
        options->output.transfer = scene->color_meaning == COLORS_DISPLAY ? TRANSFER_NONE : TRANSFER_SRGB;
    options->output.prints_names = !options->quiet && !options->has_format;
    options->output.synchronous = options->timing != TIMING_NONE;
    MessageList messages = {0};
    Checkpoint *checkpoint = NULL;
    int status = EXIT_USER;
    const unsigned aovs = shutter_is_last(shutter) ? options->output.aovs : 0;
    if (!ranks || ranks->begin(ranks, &settings, aovs, options->common.device, &messages)) {
        const bool has_started = render_devices_start(open, scene, &settings, ranks, &messages);
        if (has_started && shutter->time > 0) message_list_free(&messages); // the first time's warnings
        const bool can_start =
            has_started && checkpoint_start(&checkpoint, options, &settings, open->renderers, devices->count,
                                            ranks, &messages);
        if (ranks) ranks->start(can_start);
        if (can_start)
            status = image_render(options, scene, devices, open->renderers, ranks, &settings, checkpoint,
                                  shutter, times, &messages);
    }
    messages_print(&messages, NULL);
    times->pilot = options->output.pilot = NULL;
    return status;
}

// Rejects options that need one time. Returns false with a message.
static bool shutter_fits(const Shutter *shutter, const RenderOptions *options)
{
    const char *const obstacle = shutter->time_count == 1           ? NULL
                                 : options->checkpoint              ? "--checkpoint keeps bands of one time"
                                 : options->budget.limit > 0        ? "--max-error measures one time"
                                 : strcmp(options->scene, "-") == 0 ? "standard input is read once"
                                                                    : NULL;
    if (obstacle)
        fprintf(stderr, "glint: '%s': %s, but 'shutter' needs several; --set shutter=0 closes it\n",
                options->scene, obstacle);
    if (shutter->is_open && options->sample_count == 1)
        fprintf(
            stderr,
            "glint: warning: '%s': 'shutter' has an effect from --samples 2 on: each sample shows one time\n",
            options->scene);
    return !obstacle;
}

// Replaces the scene by that of the shutter's time. Warnings were printed when the frame's scene was read.
static bool scene_advance(Scene *scene, RenderOptions *options, const Shutter *shutter, HostTimes *times)
{
    MessageList messages = {0};
    const double start = clock_seconds();
    scene_free(scene);
    options->common.frame = shutter_frame(shutter);
    const SceneOptions scene_options = scene_options_of(&options->common);
    const bool is_read = scene_load(scene, options->scene, &scene_options, &messages);
    if (is_read)
        message_list_free(&messages);
    else
        messages_print(&messages, options->scene);
    scene->frame = shutter->frame;
    times->parse_seconds += clock_seconds() - start;
    return is_read;
}

// Renders a scene at each of the shutter's times.
static int shutter_render(RenderOptions *options, Scene *scene, RenderDevices *open, Ranks *ranks,
                          HostTimes *times)
{
    Shutter shutter = shutter_open(scene, options->sample_count);
    int status = shutter_fits(&shutter, options) ? EXIT_DONE : EXIT_USER;
    while (status == EXIT_DONE && shutter.time < shutter.time_count) {
        if (shutter.time > 0) {
            progress_end_at_once(); // nothing checks the flag while a scene is read
            if (progress_interrupted()) {
                status = EXIT_INTERRUPTED;
                break;
            }
            render_devices_rest(open);
        }
        const bool is_moved = shutter.time_count == 1 || scene_advance(scene, options, &shutter, times);
        status = is_moved ? scene_render(options, scene, open, ranks, &shutter, times) : EXIT_USER;
        shutter.time++;
    }
    shutter_close(&shutter);
    return status;
}

// Renders one of the scenes into a file.
static int file_render(RenderOptions options, const char *path, RenderDevices *open, Ranks *ranks)
{
    Scene scene = {0};
    options.output.path = path;
    double start = clock_seconds();
    int status = EXIT_USER;
    if (ranks && (options.common.work_group[0] > 0 || options.common.build_options))
        return option_usage_fault("render",
                                  "--work-group and --build-options need glint render, a single process");
    if (options.timing == TIMING_TRACE) options.common.stage = stage_open(true);
    if (image_output_path_known(path) && scene_open(&scene, options.scene, &options.common) &&
        !image_output_overwrites_scene(&options.output, &scene, options.scene)) {
        HostTimes times = {.scene = options.scene,
                           .frame = options.frame_count > 0 ? options.common.frame : NAN,
                           .is_several = options.has_several,
                           .parse_seconds = clock_seconds() - start,
                           .stage = options.common.stage};
        if (options.frame_count > 0 && !scene.is_animated && !open->has_warned_of_frames)
            fprintf(stderr, "glint: warning: '%s' has no keys: all frames are alike\n", options.scene);
        open->has_warned_of_frames = true;
        open->reference_selector = options.common.reference_device;
        stage_begin(times.stage, "opening the devices", NULL, 0);
        if (render_devices_open(open, &options.common))
            status = shutter_render(&options, &scene, open, ranks, &times);
    }
    scene_free(&scene);
    stage_close(options.common.stage);
    return status;
}

// Returns the pattern with the frame's number in its place, if it has one. The caller frees it.
static char *frame_name_make(const char *pattern, uint32_t frame)
{
    const FramePlace place = frame_place_of(pattern);
    if (!place.start) return memory_copy_text(pattern);
    return text_format("%.*s%0*u%s", (int)(place.start - pattern), pattern, place.digits, frame, place.end);
}

// Returns the path of a frame's image. The caller frees it.
static char *frame_path_make(const RenderOptions *options, uint32_t frame)
{
    const char *output = options->output.path;
    if (options->has_format) return memory_copy_text(output);
    if (output && (frame_place_of(output).start || !output_is_folder(output)))
        return frame_name_make(output, frame);
    char *name = image_output_default_path(options->scenes[0]);
    char *path = text_format("%s%s%.*s-%04u.png", output ? output : "", output ? "/" : "",
                             (int)(strlen(name) - strlen(".png")), name, frame);
    free(name);
    return path;
}

// Returns the path of a scene's image. The caller frees it.
static char *path_make(const RenderOptions *options, const char *scene)
{
    const char *output = options->output.path;
    if (output && (options->scene_count == 1 || options->has_format)) return memory_copy_text(output);
    char *name = image_output_default_path(scene);
    if (!output) return name;
    char *path = text_format("%s/%s", output, name);
    free(name);
    return path;
}

// False with a message.
static bool paths_differ(char *const *paths, const RenderOptions *options)
{
    if (options->has_format) return true; // all go to standard output
    for (size_t i = 0; i < options->scene_count; i++)
        for (size_t k = 0; k < i; k++) {
            if (strcmp(paths[i], paths[k]) != 0) continue;
            fprintf(stderr, "glint render: the images of '%s' and '%s' would both be '%s'\n",
                    options->scenes[k], options->scenes[i], paths[i]);
            return false;
        }
    return true;
}

struct RenderCommand {
    RenderOptions options;
    size_t count; // images: scenes, or frames of one
    char **paths; // one of each
    RenderDevices open;
    int status;
};

RenderCommand *render_command_open(int argument_count, char **arguments, int *status)
{
    RenderOptions options;
    *status = render_options_read(&options, argument_count, arguments);
    if (*status != OPTIONS_READ) return NULL;
    RenderCommand *command = memory_allocate_zeroed(1, sizeof *command);
    command->options = options;
    command->count = options.frame_count > 0 ? options.frame_count : options.scene_count;
    command->paths = memory_allocate(command->count, sizeof *command->paths);
    for (size_t i = 0; i < command->count; i++)
        command->paths[i] = options.frame_count > 0
                                ? frame_path_make(&options, options.first_frame + (uint32_t)i)
                                : path_make(&options, options.scenes[i]);
    if (paths_differ(command->paths, &options)) return command;
    render_command_close(command);
    *status = EXIT_USER;
    return NULL;
}

// Mistakes in a scene are reported when it is rendered.
static bool scene_is_overwritten(RenderOptions options, const char *path, char *const *images)
{
    Scene scene = {0};
    MessageList ignored = {0};
    bool is_overwritten = false;
    const SceneOptions scene_options = scene_options_of(&options.common);
    if (scene_load(&scene, path, &scene_options, &ignored))
        for (size_t i = 0; i < options.scene_count && !is_overwritten; i++) {
            options.output.path = images[i];
            is_overwritten = image_output_overwrites_scene(&options.output, &scene, path);
        }
    message_list_free(&ignored);
    scene_free(&scene);
    return is_overwritten;
}

bool render_command_spares_scenes(RenderCommand *command)
{
    const RenderOptions *options = &command->options;
    bool image_exists = false;
    for (size_t i = 0; i < options->scene_count && options->scene_count > 1 && !options->skips_existing; i++)
        image_exists = image_exists || access(command->paths[i], F_OK) == 0;
    for (size_t i = 0; i < options->scene_count && image_exists; i++) {
        const bool can_read_twice = strcmp(options->scenes[i], "-") != 0;
        if (!can_read_twice || !scene_is_overwritten(*options, options->scenes[i], command->paths)) continue;
        render_command_note(command, EXIT_USER);
        return false;
    }
    return true;
}

void render_command_choose_device(RenderCommand *command, size_t number)
{
    command->open.is_single = true;
    command->open.number = number;
}

size_t render_command_count(const RenderCommand *command)
{
    return command->count;
}

const char *render_command_scene(const RenderCommand *command, size_t index)
{
    return command->options.scenes[command->options.frame_count > 0 ? 0 : index];
}

const char *render_command_path(const RenderCommand *command, size_t index)
{
    return command->paths[index];
}

bool render_command_reports_to_stdout(const RenderCommand *command)
{
    return timing_uses_stdout(command->options.timing);
}

bool render_command_open_devices(RenderCommand *command)
{
    command->open.reference_selector = command->options.common.reference_device;
    return render_devices_open(&command->open, &command->options.common);
}

// Returns whether all files of an image exist, and prints the image's name if so.
static bool image_exists(const RenderOptions *options, const char *path)
{
    ImageOutputOptions output = options->output;
    output.path = path;
    if (!image_output_exists(&output)) return false;
    if (!options->quiet) fprintf(stderr, "glint: kept %s\n", path);
    return true;
}

int render_command_run(RenderCommand *command, size_t index, Ranks *ranks)
{
    RenderDevices *open = &command->open;
    RenderOptions *options = &command->options;
    options->scene = render_command_scene(command, index);
    if (options->frame_count > 0) options->common.frame = options->first_frame + (double)index;
    if (options->skips_existing && image_exists(options, command->paths[index])) return EXIT_DONE;
    render_devices_rest(open);
    progress_end_at_once(); // nothing checks the flag while a scene is read
    if (progress_interrupted()) return EXIT_INTERRUPTED;
    RenderOptions of_image = *options;
    char *checkpoint = options->checkpoint && options->frame_count > 0
                           ? frame_name_make(options->checkpoint, options->first_frame + (uint32_t)index)
                           : NULL;
    if (checkpoint) of_image.checkpoint = checkpoint;
    const int status = file_render(of_image, command->paths[index], open, ranks);
    free(checkpoint);
    return render_devices_work(open) ? status : EXIT_MACHINE;
}

bool render_command_is_unfit(const RenderCommand *command)
{
    return command->open.is_unfit;
}

void render_command_note(RenderCommand *command, int status)
{
    if (status != EXIT_DONE) command->status = status;
}

// Returns whether another scene can be rendered. A mistake in one scene does not affect others.
static bool continues_after(int status)
{
    return status == EXIT_DONE || status == EXIT_USER;
}

void render_command_run_from(RenderCommand *command, size_t first, Ranks *ranks)
{
    bool continues = continues_after(command->status);
    for (size_t i = first; i < command->count && continues; i++) {
        const int status = render_command_run(command, i, ranks);
        render_command_note(command, status);
        continues = continues_after(status);
    }
    if (command->status == EXIT_DONE) fault_output_is_complete(EXIT_DONE);
}

void render_command_drop_devices(RenderCommand *command)
{
    OpenDevices *devices = &command->open.devices;
    for (size_t i = 0; i < devices->count; i++)
        if (!compute_ok(devices->items[i].compute)) devices_drop(devices, i);
}

int render_command_close(RenderCommand *command)
{
    const int status = render_devices_close(&command->open, command->status);
    for (size_t i = 0; i < command->count; i++)
        free(command->paths[i]);
    free(command->paths);
    free(command);
    return status;
}

int command_render(int argument_count, char **arguments)
{
    int status;
    RenderCommand *command = render_command_open(argument_count, arguments, &status);
    if (!command) return status;
    if (render_command_spares_scenes(command)) render_command_run_from(command, 0, NULL);
    return render_command_close(command);
}
