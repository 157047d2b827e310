#include "host/cli/image_notes.h"

#include "host/api/version.h"
#include "host/base/file.h"
#include <inttypes.h>
#include <string.h>

// Ends the last note and begins one. The caller appends its value to the text that is returned.
static Text *note_begin(ImageNotes *notes, const char *key)
{
    Text *text = &notes->text;
    if (notes->count > 0) text_append(text, "", 1);
    notes->starts[notes->count][0] = text->count;
    text_append(text, key, strlen(key) + 1);
    notes->starts[notes->count++][1] = text->count;
    return text;
}

// Returns whether the devices may round differently: the precision is not strict and the devices are not all
// of one make.
static bool is_mixed(const ImageOrigin *origin)
{
    const Device *first = renderer_report(origin->renderers[0])->device;
    Rank local = {0};
    rank_set_device(&local, first);
    bool differs = false;
    for (size_t i = 1; i < origin->renderer_count; i++) {
        const Device *device = renderer_report(origin->renderers[i])->device;
        differs =
            differs || strcmp(device->name, first->name) != 0 || strcmp(device->driver, first->driver) != 0;
    }
    for (size_t i = 0; origin->ranks && i < origin->ranks->remote.count; i++) {
        const Rank *rank = &origin->ranks->items[i];
        differs =
            differs || strcmp(rank->device, local.device) != 0 || strcmp(rank->driver, local.driver) != 0;
    }
    return differs && origin->settings->precision != PRECISION_STRICT;
}

const char certified_key[] = "Certified";

void counts_describe(Text *text, const RerenderCounts *counts)
{
    text_appendf(text, "%" PRIu64 " sample%s re-rendered in double, %" PRIu64 " uncertified",
                 counts->rerendered, text_plural(counts->rerendered), counts->uncertified);
}

static void scene_notes_add(ImageNotes *notes, const ImageOrigin *origin)
{
    const Scene *scene = origin->scene;
    text_appendf(note_begin(notes, "Scene"), "%s", file_base_name(origin->scene_path));
    Text *text = scene->overrides ? note_begin(notes, "Set") : NULL;
    for (const Source *set = scene->overrides; set; set = set->next)
        text_appendf(text, "%s%s", set->bytes, set->next ? "\n" : "");
    if (scene->animation.has_keys) text_appendf(note_begin(notes, "Frame"), "%g", scene->animation.frame);
}

typedef enum { NOTE_DEVICE, NOTE_DRIVER, NOTE_LANES, NOTE_KERNEL } DeviceNote;

// Adds a note with a value of each device.
static void device_note_add(ImageNotes *notes, DeviceNote note, const ImageOrigin *origin)
{
    static const char *const keys[] = {"Device", "Driver", "Lanes", "Kernel"};
    Text *text = note_begin(notes, keys[note]);
    for (size_t i = 0; i < origin->renderer_count; i++) {
        const RenderReport *report = renderer_report(origin->renderers[i]);
        if (i > 0) text_appendf(text, " + ");
        if (note == NOTE_DEVICE)
            text_appendf(text, "%s", report->device->name);
        else if (note == NOTE_DRIVER)
            text_appendf(text, "%s, %s", report->device->platform_name, report->device->driver);
        else if (note == NOTE_LANES)
            text_appendf(text, "%u", report->lanes);
        else
            text_appendf(text, "%016" PRIx64, renderer_kernel_hash(origin->renderers[i]));
    }
}

static void precision_notes_add(ImageNotes *notes, Precision precision, const Pilot *pilot,
                                const RerenderCounts *counts)
{
    text_appendf(note_begin(notes, "Precision"), "%s", precision_names[precision]);
    if (pilot) {
        text_appendf(note_begin(notes, "Budget"), "%g %s", pilot->budget.limit,
                     error_metric_names[pilot->budget.metric]);
        pilot_describe(note_begin(notes, "Pilot"), pilot);
    }
    if (counts) counts_describe(note_begin(notes, certified_key), counts);
}

static void settings_notes_add(ImageNotes *notes, const RenderSettings *settings)
{
    text_appendf(note_begin(notes, "Samples"), "%u", settings->sample_count);
    text_appendf(note_begin(notes, "Bounces"), "%u", settings->bounce_count);
    if (settings->min_contribution > 0)
        text_appendf(note_begin(notes, "MinContribution"), "%.17g", settings->min_contribution);
    text_appendf(note_begin(notes, "Size"), "%ux%u", settings->width, settings->height);
    text_appendf(note_begin(notes, "Region"), "%u,%u,%u,%u", settings->region_x, settings->region_y,
                 settings->region_width, settings->region_height);
}

static void format_notes_add(ImageNotes *notes, const ImageOutputOptions *options, ImageFormat format)
{
    const bool is_display = options->transfer == TRANSFER_SRGB && !image_format_holds_floats(format);
    text_appendf(note_begin(notes, "Transfer"), "%s", is_display ? "srgb" : "none");
    if (options->exposure != 0) text_appendf(note_begin(notes, "Exposure"), "%g", options->exposure);
    if (options->tone != TONE_NONE) text_appendf(note_begin(notes, "Tone"), "%s", tone_names[options->tone]);
    if (options->dither) text_appendf(note_begin(notes, "Dither"), "ordered");
    if (options->alpha)
        text_appendf(note_begin(notes, "Alpha"), "%s", format == IMAGE_EXR ? "premultiplied" : "straight");
}

void image_notes_add_all(ImageNotes *notes, const ImageOrigin *origin, const ImageOutputOptions *options,
                         ImageFormat format, const RerenderCounts *counts)
{
    text_appendf(note_begin(notes, "Software"), "glint %s", glint_version());
    scene_notes_add(notes, origin);
    device_note_add(notes, NOTE_DEVICE, origin);
    device_note_add(notes, NOTE_DRIVER, origin);
    precision_notes_add(notes, origin->settings->precision, options->pilot, counts);
    device_note_add(notes, NOTE_LANES, origin);
    settings_notes_add(notes, origin->settings);
    format_notes_add(notes, options, format);
    device_note_add(notes, NOTE_KERNEL, origin);
    if (origin->ranks) text_appendf(note_begin(notes, "Ranks"), "%zu", origin->ranks->remote.count + 1);
    if (is_mixed(origin))
        text_appendf(note_begin(notes, "Comment"), "rendered by devices that may round differently");
}

void image_notes_list(const ImageNotes *notes, ImageNote list[NOTE_COUNT_MAX + 1])
{
    for (size_t i = 0; i < notes->count; i++)
        list[i] =
            (ImageNote){notes->text.items + notes->starts[i][0], notes->text.items + notes->starts[i][1]};
    list[notes->count] = (ImageNote){0};
}
