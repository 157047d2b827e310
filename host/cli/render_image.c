// One image of glint render: its times, its bands and its files.
#include "host/cli/render_image.h"
#include "host/base/clock.h"
#include "host/base/exit_status.h"
#include "host/cli/checkpoint_key.h"
#include "host/cli/interrupts.h"
#include "host/cli/progress.h"
#include "host/cli/shutter.h"
#include "host/import/load.h"
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    RenderOptions *options;
    Scene *scene; // at the shutter's time
    RenderDevices *open;
    Ranks *ranks; // NULL without MPI
    Shutter shutter;
    HostTimes *times;
    RenderSettings settings;
    ImageOrigin origin;     // once the renderers are open
    Checkpoint *checkpoint; // NULL without --checkpoint
    ImageOutput *output;    // NULL unless this is the shutter's last time
    MessageList messages;
    MessageList *printed; // the warnings of all times
} ImageRender;

// Prints one estimate of the time and the size of a long render.
static void estimate_print(ImageRender *render, double fraction_done)
{
    enum { SECONDS_MIN = 60 };
    if (render->options->quiet || render->shutter.is_estimated) return;
    double left = progress_seconds_left(&render->shutter.progress, fraction_done);
    render->shutter.is_estimated = left >= 0;
    if (left < SECONDS_MIN) return;
    const double bytes = render->output ? image_output_bytes(render->output) : 0;
    stderr_print("%u x %u pixels: about %s%s%s", render->settings.region_width,
                 render->settings.region_height, text_duration(left).text, bytes > 0 ? " and at most " : "",
                 bytes > 0 ? text_size(bytes).text : "");
}

static bool band_receive(void *context, const Film *band)
{
    ImageRender *render = context;
    Shutter *shutter = &render->shutter;
    bool is_written = true;
    if (is_interrupted()) return false;
    if (shutter->time_count == 1) {
        is_written = image_output_write(render->output, band, &render->messages);
    } else if (render->output) {
        Film mean = shutter_mean(shutter, band);
        is_written = image_output_write(render->output, &mean, &render->messages);
        free(mean.layers[LAYER_COLOR]);
    } else {
        shutter_add(shutter, band);
    }
    const double fraction_done =
        shutter_fraction(shutter, (double)(band->first_row + band->height) / render->settings.region_height);
    if (is_written) estimate_print(render, fraction_done);
    progress_show(&shutter->progress, fraction_done);
    return is_written;
}

static void device_drop(void *context, size_t index)
{
    RenderDevices *open = ((ImageRender *)context)->open;
    if (index < open->count) render_devices_drop(open, index); // else a rank, which has printed the reason
}

// Opens the checkpoint. Returns true if none is requested, and false with messages if it cannot be opened.
static bool checkpoint_start(ImageRender *render)
{
    const RenderOptions *options = render->options;
    const unsigned aovs = image_output_aovs(&options->output);
    if (!options->checkpoint) return true;
    OwnedText key = {0};
    checkpoint_key(&key, &render->origin, aovs);
    const FilmHeader film = renderer_film_header(render->origin.renderers[0], aovs);
    render->checkpoint = checkpoint_open(options->checkpoint, text_c(&key), &film, &render->messages);
    return render->checkpoint != NULL;
}

// Prints what an interrupted or failed render has left.
static void leftovers_print(const RenderOptions *options)
{
    OWNED char *kept =
        text_format(": no image was written; an earlier %s is unchanged", options->output.path);
    if (is_interrupted())
        interrupt_report(options->has_format ? ": the image on standard output is incomplete" : kept);
    if (options->checkpoint)
        stderr_print("run the same command again to continue; finished bands are in '%s'",
                     options->checkpoint);
}

// Adds the warnings of a complete image, or of one of its times.
static void warnings_add(ImageRender *render)
{
    const size_t device_count = shutter_is_last(&render->shutter) ? render->origin.renderer_count : 0;
    const uint64_t uncertified = render->times->rerenders.uncertified;
    if (uncertified > 0)
        message_warning(&render->messages, "%" PRIu64 " sample%s uncertified, as at precision double",
                        uncertified, uncertified == 1 ? " is" : "s are");
    for (size_t i = 0; i < device_count; i++) {
        const RenderReport *report = renderer_report(render->origin.renderers[i]);
        if (report->is_out_of_line)
            message_warning(
                &render->messages,
                "the compiler of the device \"%s\" failed on a kernel with inlined functions; the kernel is "
                "built with functions out of line, which is slower",
                report->device->name);
    }
}

// Writes the files of a complete image, or abandons them.
static bool files_write(ImageRender *render, bool is_whole)
{
    HostTimes *times = render->times;
    stage_begin(times->stage, "writing", NULL, 0);
    if (is_whole && render->output)
        is_whole = image_output_commit(render->output, &render->messages, &times->encode_seconds);
    else if (render->output)
        image_output_abandon(render->output);
    if (render->checkpoint) checkpoint_close(render->checkpoint, is_whole, &render->messages);
    render->output = NULL;
    render->checkpoint = NULL;
    stage_end(times->stage);
    return is_whole;
}

// Renders the bands of one image, or of one of the shutter's times. With the last time, opens the output.
static bool bands_render(ImageRender *render)
{
    RenderOptions *options = render->options;
    const ImageOrigin *origin = &render->origin;
    Ranks *ranks = render->ranks;
    HostTimes *times = render->times;
    const bool is_last = shutter_is_last(&render->shutter);
    if (is_last) render->output = image_output_open(&options->output, origin);
    const unsigned aovs = is_last ? image_output_aovs(&options->output) : 0;
    if (ranks) ranks->film = renderer_film_header(origin->renderers[0], aovs);
    const RenderJob job = {.renderers = origin->renderers,
                           .count = origin->renderer_count,
                           .aovs = aovs,
                           .sink = band_receive,
                           .dropped = device_drop,
                           .context = render,
                           .checkpoint = render->checkpoint,
                           .remote = ranks ? &ranks->remote : NULL};
    stage_begin(times->stage, "rendering", NULL, 0);
    const double start = clock_seconds();
    const bool is_whole = render_job_run(&job);
    times->render_seconds += clock_seconds() - start;
    if (is_last) times->rerenders = image_output_rerenders(render->output);
    return is_whole;
}

// Renders one image, or one of the shutter's times. With the last, writes the files and reports how long it
// took.
static int image_render(ImageRender *render)
{
    RenderOptions *options = render->options;
    Shutter *shutter = &render->shutter;
    const bool is_last = shutter_is_last(shutter);
    if (shutter->time == 0) progress_open(&shutter->progress, options->quiet);
    const bool are_rendered = bands_render(render);
    progress_close(&shutter->progress);
    const bool is_whole = files_write(render, are_rendered);
    if (is_whole) warnings_add(render);
    const bool is_faulty = message_count(&render->messages, MESSAGE_ERROR) > 0;
    messages_print_once(&render->messages, render->printed, NULL);
    if (!is_whole) leftovers_print(options);
    if (render->ranks && is_last && options->timing == TIMING_TRACE)
        stderr_print("--timing=trace covers only the first rank's devices");
    if (is_whole && is_last && options->timing != TIMING_NONE)
        timing_print(options->timing, &render->origin, render->times);
    return is_whole           ? EXIT_DONE
           : is_faulty        ? (options->has_format ? EXIT_MACHINE : EXIT_USER)
           : is_interrupted() ? EXIT_INTERRUPTED
                              : EXIT_MACHINE;
}

// Stores the precision that --max-error chooses in the settings.
static int precision_choose(ImageRender *render, Pilot *pilot)
{
    const RenderOptions *options = render->options;
    interrupts_flag();
    const bool chosen = pilot_run(pilot, &options->budget, render->open->items[0].compute, render->scene,
                                  &render->settings, &render->messages);
    const bool is_unfit = render->messages.count > 0;
    messages_print_once(&render->messages, render->printed, NULL);
    if (!chosen) return is_unfit ? EXIT_USER : is_interrupted() ? EXIT_INTERRUPTED : EXIT_MACHINE;
    render->settings.precision = pilot->chosen;
    if (options->quiet) return EXIT_DONE;
    OwnedText line = {0};
    pilot_describe(&line, pilot);
    stderr_print("--max-error chose %s; %.0f ms", text_c(&line), 1e3 * pilot->seconds);
    return EXIT_DONE;
}

// Renders the scene at the shutter's time.
static int time_render(ImageRender *render)
{
    RenderOptions *options = render->options;
    const Scene *scene = render->scene;
    RenderSettings *settings = &render->settings;
    Ranks *ranks = render->ranks;
    Pilot pilot;
    if (!render_settings_make(settings, options, scene)) return EXIT_USER;
    shutter_choose_samples(&render->shutter, settings);
    if (options->budget.limit > 0) {
        const int status = precision_choose(render, &pilot);
        if (status != EXIT_DONE) return status;
        render->times->pilot = options->output.pilot = &pilot;
    }
    if (!options->has_transfer)
        options->output.transfer = scene->color_meaning == COLORS_DISPLAY ? TRANSFER_NONE : TRANSFER_SRGB;
    options->output.prints_names = !options->quiet && !options->has_format;
    options->output.synchronous = options->timing != TIMING_NONE;
    int status = EXIT_USER;
    const unsigned aovs = shutter_is_last(&render->shutter) ? image_output_aovs(&options->output) : 0;
    if (!ranks || ranks->begin(ranks, settings, aovs, options->common.device,
                               options->common.reference_device, &render->messages)) {
        const bool has_started =
            render_devices_start(render->open, scene, settings, ranks, &render->messages);
        render->origin = (ImageOrigin){
            options->scene,        scene, settings, render->open->renderers, render->open->count, ranks,
            &options->common.scene};
        const bool can_start = has_started && checkpoint_start(render);
        if (ranks) ranks->start(can_start);
        if (can_start) status = image_render(render);
    }
    messages_print_once(&render->messages, render->printed, NULL);
    render->times->pilot = options->output.pilot = NULL;
    return status;
}

// Returns false with a message if an option does not work with the shutter's several times.
static bool shutter_fits(const Shutter *shutter, const RenderOptions *options)
{
    const bool has_aov = image_output_aovs(&options->output) & AOVS_OF_SAMPLES;
    const char *const obstacle = shutter->time_count == 1           ? NULL
                                 : options->checkpoint              ? "--checkpoint"
                                 : options->budget.limit > 0        ? "--max-error"
                                 : has_aov                          ? "--alpha or --aov coverage,backdrop"
                                 : strcmp(options->scene, "-") == 0 ? "standard input"
                                                                    : NULL;
    if (obstacle)
        stderr_print(
            "'%s': %s cannot be combined with an open shutter, which renders the scene several times; "
            "--set shutter=0 closes it",
            options->scene, obstacle);
    if (shutter->is_open && options->sample_count == 1)
        stderr_print("warning: '%s': 'shutter' has no effect at --samples 1: each sample shows one time",
                     options->scene);
    return !obstacle;
}

// Replaces the scene with that of the shutter's time.
static bool scene_advance(ImageRender *render)
{
    const double start = clock_seconds();
    scene_free(render->scene);
    render->options->common.scene.frame = shutter_frame(&render->shutter);
    const bool is_read =
        scene_open_once(render->scene, render->options->scene, &render->options->common, render->printed);
    render->scene->animation.frame = render->shutter.frame;
    render->times->parse_seconds += clock_seconds() - start;
    return is_read;
}

// Renders a scene at each of the shutter's times.
static int shutter_render(ImageRender *render)
{
    Shutter *shutter = &render->shutter;
    *shutter = shutter_open(render->scene, render->options->sample_count);
    int status = shutter_fits(shutter, render->options) ? EXIT_DONE : EXIT_USER;
    while (status == EXIT_DONE && shutter->time < shutter->time_count) {
        if (shutter->time > 0) {
            interrupts_end_at_once(); // nothing checks the flag while a scene is read
            if (is_interrupted()) {
                status = EXIT_INTERRUPTED;
                break;
            }
            render_devices_release(render->open);
        }
        const bool is_moved = shutter->time_count == 1 || scene_advance(render);
        status = is_moved ? time_render(render) : EXIT_USER;
        shutter->time++;
    }
    shutter_close(shutter);
    return status;
}

// Opens the devices and renders the scene.
static int scene_render(ImageRender *render)
{
    const RenderOptions *options = render->options;
    RenderDevices *open = render->open;
    if (options->frame_count > 0 && !render->scene->animation.has_keys && !open->has_warned_of_frames)
        stderr_print("warning: '%s' has no keys: all frames are alike", options->scene);
    open->has_warned_of_frames = true;
    stage_begin(render->times->stage, "opening the devices", NULL, 0);
    if (!render_devices_open(open, &options->common)) return EXIT_USER;
    if (options->common.driver.capture_folder && open->count > 1) {
        option_usage_fault("render", "--capture needs a single device");
        return EXIT_USER;
    }
    return shutter_render(render);
}

int image_file_render(RenderOptions options, const char *path, RenderDevices *open, Ranks *ranks)
{
    OwnedScene scene = {0};
    const CommonOptions *common = &options.common;
    const double start = clock_seconds();
    int status = EXIT_USER;
    options.output.path = path;
    Stage *stage = options.timing == TIMING_TRACE ? stage_open(true) : NULL;
    options.common.scene.stage = options.common.settings.stage = stage;
    OwnedMessageList printed = {0};
    if (scene_open_once(&scene, options.scene, common, &printed) &&
        !image_output_overwrites_scene(&options.output, &scene, options.scene)) {
        HostTimes times = {.frame = options.frame_count > 0 ? common->scene.frame : NAN,
                           .is_several = options.has_several,
                           .parse_seconds = clock_seconds() - start,
                           .stage = stage};
        ImageRender render = {.options = &options,
                              .scene = &scene,
                              .open = open,
                              .ranks = ranks,
                              .times = &times,
                              .printed = &printed};
        status = scene_render(&render);
    }
    stage_close(stage);
    return status;
}
