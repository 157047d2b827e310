#include "host/cli/accuracy_report.h"

#include "host/base/array.h"
#include "host/cli/passport_report.h"
#include <math.h>
#include <string.h>

void accuracy_variant_name(Text *text, const AccuracyScene *scene, const AccuracyVariant *variant)
{
    const BenchKey *key = &variant->row->key;
    bool lanes = false, bvh = false, samples = false;
    for (size_t i = 0; i < scene->variant_count; i++) {
        const AccuracyVariant *other = &scene->variants[i];
        // the device's default lanes may differ between precisions
        lanes |=
            strcmp(other->row->key.precision, key->precision) == 0 && other->row->key.lanes != key->lanes;
        bvh |= strcmp(other->row->key.bvh, key->bvh) != 0;
        samples |= other->samples != variant->samples;
    }
    text_appendf(text, "%s", key->precision);
    if (lanes) text_appendf(text, " with %u lane%s", key->lanes, text_plural(key->lanes));
    if (bvh) text_appendf(text, " with BVH %s", key->bvh);
    if (samples) text_appendf(text, " with %u sample%s", variant->samples, text_plural(variant->samples));
}

const char *accuracy_crossed_words(const AccuracyVariant *variant, size_t index)
{
    static const struct {
        unsigned fault;
        const char *words;
    } faults[] = {
        {DISQUALIFIED_NONFINITE, "pixels that are not finite"},
        {DISQUALIFIED_NEGATIVE, "negative pixels"},
        {DISQUALIFIED_OBJECT, "another object away from the silhouettes"},
        {DISQUALIFIED_SHADOW, "wrong shadows away from edges"},
    };
    for (size_t i = 0; i < COUNT_OF(faults); i++)
        if ((variant->disqualified & faults[i].fault) && index-- == 0) return faults[i].words;
    return NULL;
}

double accuracy_frame_ms(const AccuracyVariant *variant)
{
    return 1e3 * series_summarize(&variant->row->times.frame).median;
}

// Appends what is certain about the picked variant's time: which others tie with it, or how much longer the
// next one takes.
static void pick_certainty(Text *text, const AccuracyScene *scene, const AccuracyRecommendation *picked)
{
    OwnedText ties = {0}, unknown = {0};
    size_t next = SIZE_MAX;
    for (size_t i = 0; i < scene->variant_count; i++) {
        const Comparison *time = &picked->times[i];
        if (time->ratio == 0) continue;
        if (next == SIZE_MAX || time->ratio < picked->times[next].ratio) next = i;
        if (!accuracy_ties(picked, i)) continue;
        Text *list = isfinite(time->high) ? &ties : &unknown;
        if (list->count > 0) text_appendf(list, ", ");
        accuracy_variant_name(list, scene, &scene->variants[i]);
        if (isfinite(time->high)) text_appendf(list, " (%.3g to %.3g times as long)", time->low, time->high);
    }
    if (next == SIZE_MAX) text_appendf(text, "; no other is within it");
    if (ties.count > 0) text_appendf(text, "; ties with %s", text_c(&ties));
    if (unknown.count > 0) text_appendf(text, "; too few runs to compare it with %s", text_c(&unknown));
    if (next != SIZE_MAX && ties.count + unknown.count == 0) {
        text_appendf(text, "; ");
        accuracy_variant_name(text, scene, &scene->variants[next]);
        text_appendf(text, " takes %.3g to %.3g times as long", picked->times[next].low,
                     picked->times[next].high);
    }
}

// Appends the picked variant, its time and its error.
static void pick_append(Text *text, const AccuracyScene *scene, const AccuracyRecommendation *picked)
{
    const AccuracyVariant *variant = &scene->variants[picked->variant];
    accuracy_variant_name(text, scene, variant);
    text_appendf(text, ", %.3g ms", accuracy_frame_ms(variant));
    if (variant->status == ACCURACY_REFERENCE) {
        text_appendf(text, ", the reference itself");
        pick_certainty(text, scene, picked);
        return;
    }
    text_appendf(text, ", %.2g", accuracy_figure(variant, picked->measure).value);
    pick_certainty(text, scene, picked);
    size_t objects = variant->errors.object.edge, shadows = variant->errors.shadow.edge;
    if (objects > 0)
        text_appendf(text, "; %zu pixel%s at silhouettes show%s another object", objects,
                     text_plural(objects), objects == 1 ? "s" : "");
    if (shadows > 0)
        text_appendf(text, "; %zu shadow bit%s wrong at edges", shadows, shadows == 1 ? " is" : "s are");
}

Text accuracy_pick_sentence(const AccuracyScene *scene, size_t pick)
{
    const AccuracyRecommendation *picked = &scene->recommendations[pick];
    Text text = {0};
    text_appendf(&text, "for an error of at most %g: ", picked->budget);
    if (picked->variant == SIZE_MAX)
        text_appendf(&text, "none of these");
    else
        pick_append(&text, scene, picked);
    return text;
}

static void reference_append(Text *notes, const AccuracyScene *scene)
{
    if (scene->reference.file)
        text_appendf(notes, "reference: %s, colors only", scene->reference.file);
    else
        text_appendf(notes, "reference: %s, %u lane%s, %u sample%s; %zu pixel%s at silhouettes",
                     scene->reference.precision, scene->reference.lanes, text_plural(scene->reference.lanes),
                     scene->reference.samples, text_plural(scene->reference.samples),
                     scene->edges.silhouette_pixels, text_plural(scene->edges.silhouette_pixels));
    if (scene->reference.device) text_appendf(notes, "; on %s", scene->reference.device);
    if (scene->reference.nonfinite + scene->reference.negative > 0)
        text_appendf(notes, "; %zu of its pixels are not finite, %zu negative", scene->reference.nonfinite,
                     scene->reference.negative);
    text_appendf(notes, "\n");
}

static void crossed_append(Text *notes, const AccuracyVariant *variant)
{
    if (variant->disqualified == 0) return;
    text_appendf(notes, "    crossed out:");
    const char *words;
    for (size_t i = 0; (words = accuracy_crossed_words(variant, i)); i++)
        text_appendf(notes, "%s %s", i > 0 ? "," : "", words);
    if (variant->disqualified & (DISQUALIFIED_NONFINITE | DISQUALIFIED_NEGATIVE))
        text_appendf(notes, " (%zu not finite, %zu negative)", variant->errors.nonfinite,
                     variant->errors.negative);
    text_appendf(notes, "\n");
}

// Appends a scene's reference and recommendations.
static void scene_append(Text *notes, const AccuracyScene *scene)
{
    reference_append(notes, scene);
    text_appendf(notes, "fastest rows, with intervals of %g%% confidence for all together:\n",
                 100 * comparison_confidence);
    for (size_t i = 0; i < scene->recommendation_count; i++) {
        OwnedText sentence = accuracy_pick_sentence(scene, i);
        text_appendf(notes, "  %s\n", text_c(&sentence));
    }
}

static void accuracy_notes(const void *context, size_t row, Text *notes)
{
    const AccuracyScene *scene = ((const AccuracyReport *)context)->scenes;
    for (; row >= scene->variant_count; scene++)
        row -= scene->variant_count;
    if (scene->variants[row].status == ACCURACY_REFERENCE) text_appendf(notes, "    the reference\n");
    crossed_append(notes, &scene->variants[row]);
    if (row + 1 == scene->variant_count) scene_append(notes, scene);
}

bool accuracy_print(const AccuracyReport *report, const ReportOptions *options)
{
    if (report_has_text(options)) {
        device_heading_print(report->device, stdout);
        if (report->perturb_seed > 0)
            printf("every variant with injected rounding errors: --perturb %u:%u\n", report->perturb_seed,
                   report->perturb_scale);
    }
    return report_output(accuracy_json(report), options, accuracy_notes, report);
}
