#include "host/cli/image_notes.h"

#include "host/api/version.h"
#include "host/base/file.h"
#include "host/base/text.h"
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static void __attribute__((format(printf, 3, 4)))
note_add(ImageNotes *notes, const char *key, const char *format, ...)
{
    char *value;
    ARGUMENTS_FORMAT(value, format);
    notes->items[notes->count++] = (ImageNote){key, value};
}

static bool is_of_make(const Rank *rank, const Rank *other)
{
    return strcmp(rank->device, other->device) == 0 && strcmp(rank->driver, other->driver) == 0;
}

// Returns whether the devices may round differently: the precision is not strict and the devices are not all
// of one make.
static bool is_mixed(const ImageOrigin *origin)
{
    Rank first = {0};
    rank_set_devices(&first, renderer_report(origin->renderers[0])->device, NULL);
    bool differs = false;
    for (size_t i = 1; i < origin->renderer_count; i++) {
        Rank local = {0};
        rank_set_devices(&local, renderer_report(origin->renderers[i])->device, NULL);
        differs = differs || !is_of_make(&local, &first);
    }
    for (size_t i = 0; origin->ranks && i < origin->ranks->remote.count; i++)
        differs = differs || !is_of_make(&origin->ranks->items[i], &first);
    return differs && origin->settings->precision != PRECISION_STRICT;
}

const char certified_key[] = "Certified";

char *counts_describe(const RerenderCounts *counts)
{
    return text_format("%" PRIu64 " sample%s re-rendered in double, %" PRIu64 " uncertified",
                       counts->rerendered, text_plural(counts->rerendered), counts->uncertified);
}

static void scene_notes_add(ImageNotes *notes, const ImageOrigin *origin)
{
    const Scene *scene = origin->scene;
    note_add(notes, "Scene", "%s", file_base_name(origin->scene_path));
    OwnedText sets = {0};
    for (const Source *set = scene->overrides; set; set = set->next)
        text_appendf(&sets, "%s%s", set->bytes, set->next ? "\n" : "");
    if (scene->overrides) note_add(notes, "Set", "%s", text_c(&sets));
    const SceneOptions *options = origin->scene_options;
    if (options->camera) note_add(notes, "Camera", "%s", file_base_name(options->camera));
    if (options->lenient) note_add(notes, "Lenient", "yes");
    if (scene->animation.has_keys) note_add(notes, "Frame", "%g", scene->animation.frame);
}

typedef enum { NOTE_DEVICE, NOTE_DRIVER, NOTE_LANES, NOTE_KERNEL } DeviceNote;

// Adds a note with a value of each device.
static void device_note_add(ImageNotes *notes, DeviceNote note, const ImageOrigin *origin)
{
    static const char *const keys[] = {"Device", "Driver", "Lanes", "Kernel"};
    OwnedText text = {0};
    for (size_t i = 0; i < origin->renderer_count; i++) {
        const RenderReport *report = renderer_report(origin->renderers[i]);
        if (i > 0) text_appendf(&text, " + ");
        if (note == NOTE_DEVICE)
            text_appendf(&text, "%s", report->device->name);
        else if (note == NOTE_DRIVER)
            text_appendf(&text, "%s, %s", report->device->platform_name, report->device->driver);
        else if (note == NOTE_LANES)
            text_appendf(&text, "%u", report->lanes);
        else
            text_appendf(&text, "%016" PRIx64, renderer_kernel_hash(origin->renderers[i]));
    }
    note_add(notes, keys[note], "%s", text_c(&text));
}

static void precision_notes_add(ImageNotes *notes, Precision precision, const Pilot *pilot,
                                const RerenderCounts *counts)
{
    note_add(notes, "Precision", "%s", precision_names[precision]);
    if (pilot) {
        note_add(notes, "Budget", "%g %s", pilot->budget.limit, error_metric_names[pilot->budget.metric]);
        OwnedText text = {0};
        pilot_describe(&text, pilot);
        note_add(notes, "Pilot", "%s", text_c(&text));
    }
    if (!counts) return;
    OWNED char *text = counts_describe(counts);
    note_add(notes, certified_key, "%s", text);
}

static void settings_notes_add(ImageNotes *notes, const RenderSettings *settings, const char *build_options)
{
    if (settings->perturb_seed != 0)
        note_add(notes, "Perturb", "%u:%u", settings->perturb_seed, settings->perturb_scale);
    if (build_options) note_add(notes, "BuildOptions", "%s", build_options);
    note_add(notes, "Samples", "%u", settings->sample_count);
    note_add(notes, "Bounces", "%u", settings->bounce_count);
    if (settings->min_contribution > 0)
        note_add(notes, "MinContribution", "%.17g", settings->min_contribution);
    note_add(notes, "Size", "%ux%u", settings->width, settings->height);
    note_add(notes, "Region", "%u,%u,%u,%u", settings->region_x, settings->region_y, settings->region_width,
             settings->region_height);
}

static void format_notes_add(ImageNotes *notes, const ImageOutputOptions *options, ImageFormat format)
{
    const bool is_display = options->transfer == TRANSFER_SRGB && !image_format_holds_floats(format);
    note_add(notes, "Transfer", "%s", is_display ? "srgb" : "none");
    if (options->exposure != 0) note_add(notes, "Exposure", "%g", options->exposure);
    if (options->tone != TONE_NONE) note_add(notes, "Tone", "%s", tone_names[options->tone]);
    if (options->dither) note_add(notes, "Dither", "ordered");
    if (options->alpha) note_add(notes, "Alpha", "%s", format == IMAGE_EXR ? "premultiplied" : "straight");
}

void image_notes_add_all(ImageNotes *notes, const ImageOrigin *origin, const ImageOutputOptions *options,
                         ImageFormat format, const RerenderCounts *counts)
{
    note_add(notes, "Software", "glint %s", glint_version());
    scene_notes_add(notes, origin);
    device_note_add(notes, NOTE_DEVICE, origin);
    device_note_add(notes, NOTE_DRIVER, origin);
    precision_notes_add(notes, origin->settings->precision, options->pilot, counts);
    device_note_add(notes, NOTE_LANES, origin);
    settings_notes_add(notes, origin->settings, renderer_report(origin->renderers[0])->device->build_options);
    format_notes_add(notes, options, format);
    device_note_add(notes, NOTE_KERNEL, origin);
    if (origin->ranks) note_add(notes, "Ranks", "%zu", origin->ranks->remote.count + 1);
    if (is_mixed(origin)) note_add(notes, "Comment", "rendered by devices that may round differently");
}

void image_notes_free(ImageNotes *notes)
{
    for (size_t i = 0; i < notes->count; i++)
        free((char *)notes->items[i].value);
}
