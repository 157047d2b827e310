#include "host/cli/image_notes.h"

#include "host/api/version.h"
#include "host/base/numbers.h"
#include <string.h>

static void note_add(ImageNotes *notes, const char *key, const char *value)
{
    notes->starts[notes->count][0] = notes->text.count;
    text_append(&notes->text, key, strlen(key) + 1);
    notes->starts[notes->count++][1] = notes->text.count;
    text_append(&notes->text, value, strlen(value) + 1);
}

// Returns whether the devices may round differently: the precision is not strict and the devices are not all
// of one make.
static bool is_mixed(const ImageOrigin *origin)
{
    const Device *first = renderer_report(origin->renderers[0])->device;
    Rank own = {0};
    rank_set_device(&own, first);
    bool differs = false;
    for (size_t i = 1; i < origin->renderer_count; i++) {
        const Device *device = renderer_report(origin->renderers[i])->device;
        differs =
            differs || strcmp(device->name, first->name) != 0 || strcmp(device->driver, first->driver) != 0;
    }
    for (size_t i = 0; origin->ranks && i < origin->ranks->remote.count; i++) {
        const Rank *rank = &origin->ranks->items[i];
        differs = differs || strcmp(rank->device, own.device) != 0 || strcmp(rank->driver, own.driver) != 0;
    }
    return differs && origin->settings->precision != PRECISION_STRICT;
}

const char certified_key[] = "Certified";

void counts_describe(Text *text, const RerenderCounts *counts)
{
    text_appendf(text, "%llu sample%s re-rendered in double, %llu uncertified",
                 (unsigned long long)counts->rerendered, text_plural(counts->rerendered),
                 (unsigned long long)counts->uncertified);
}

void image_notes_add_all(ImageNotes *notes, const ImageOrigin *origin, const ImageOutputOptions *options,
                         ImageFormat format, const RerenderCounts *counts)
{
    const RenderSettings *settings = origin->settings;
    const char *slash = strrchr(origin->scene_path, '/');
    Text value = {0};
#define NOTE(key, ...)                                                                                       \
    (text_free(&value), text_appendf(&value, __VA_ARGS__), note_add(notes, key, text_c(&value)))
// Adds the note with the devices' values.
#define NOTE_EACH(key, ...)                                                                                  \
    do {                                                                                                     \
        text_free(&value);                                                                                   \
        for (size_t i = 0; i < origin->renderer_count; i++) {                                                \
            const Renderer *renderer = origin->renderers[i];                                                 \
            const RenderReport *report = renderer_report(renderer);                                          \
            (void)report;                                                                                    \
            text_appendf(&value, "%s", i > 0 ? " + " : "");                                                  \
            text_appendf(&value, __VA_ARGS__);                                                               \
        }                                                                                                    \
        note_add(notes, key, text_c(&value));                                                                \
    } while (0)
    NOTE("Software", "glint %s", glint_version());
    NOTE("Scene", "%s", slash ? slash + 1 : origin->scene_path);
    if (origin->scene->overrides) {
        text_free(&value);
        for (const Source *set = origin->scene->overrides; set; set = set->next)
            text_appendf(&value, "%s%s", set->bytes, set->next ? "\n" : "");
        note_add(notes, "Set", text_c(&value));
    }
    if (origin->scene->is_animated) NOTE("Frame", "%g", origin->scene->frame);
    NOTE_EACH("Device", "%s", report->device->name);
    NOTE_EACH("Driver", "%s, %s", report->device->platform_name, report->device->driver);
    NOTE("Precision", "%s", precision_names[settings->precision]);
    if (options->pilot) {
        const Pilot *pilot = options->pilot;
        NOTE("Budget", "%g %s", pilot->budget.limit, error_metric_names[pilot->budget.metric]);
        text_free(&value);
        pilot_describe(&value, pilot);
        note_add(notes, "Pilot", text_c(&value));
    }
    if (counts) {
        text_free(&value);
        counts_describe(&value, counts);
        note_add(notes, certified_key, text_c(&value));
    }
    NOTE_EACH("Lanes", "%u", report->lanes);
    NOTE("Samples", "%u", settings->sample_count);
    NOTE("Bounces", "%u", settings->bounce_count);
    if (settings->min_contribution > 0) NOTE("MinContribution", "%.17g", settings->min_contribution);
    NOTE("Size", "%ux%u", settings->width, settings->height);
    NOTE("Region", "%u,%u,%u,%u", settings->region_x, settings->region_y, settings->region_width,
         settings->region_height);
    const bool is_display = options->transfer == TRANSFER_SRGB && !image_format_holds_floats(format);
    NOTE("Transfer", "%s", is_display ? "srgb" : "none");
    if (options->exposure != 0) NOTE("Exposure", "%g", options->exposure);
    if (options->tone != TONE_NONE) NOTE("Tone", "%s", tone_names[options->tone]);
    if (options->dither) NOTE("Dither", "ordered");
    if (options->alpha) NOTE("Alpha", "%s", format == IMAGE_EXR ? "premultiplied" : "straight");
    NOTE_EACH("Kernel", "%016llx", (unsigned long long)renderer_kernel_hash(renderer));
    if (origin->ranks) NOTE("Ranks", "%zu", origin->ranks->remote.count + 1);
    if (is_mixed(origin)) NOTE("Comment", "rendered by devices that may round differently");
#undef NOTE
#undef NOTE_EACH
    text_free(&value);
}

void image_notes_list(const ImageNotes *notes, ImageNote list[NOTE_COUNT_MAX + 1])
{
    for (size_t i = 0; i < notes->count; i++)
        list[i] =
            (ImageNote){notes->text.items + notes->starts[i][0], notes->text.items + notes->starts[i][1]};
    list[notes->count] = (ImageNote){0};
}
