#include "host/cli/accuracy_report.h"

#include "host/base/array.h"
#include "host/cli/passport_report.h"
#include <inttypes.h>
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
    Text ties = {0}, unknown = {0};
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
    text_free(&ties);
    text_free(&unknown);
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

static const char table_head[] =
    "                              frame   wrong object   wrong shadow     wrong path          shading"
    "             t     normal    image   8-bit values         FLIP\n"
    "  precision lanes bvh  samp.     ms   edge    away   edge    away   edge    away     RMSE      max"
    "   99.9% ulp   99.9%       dB  off 1   more     mean    max\n";

static void count_print(EdgeCount count, FILE *stream)
{
    fprintf(stream, " %6zu %7zu", count.edge, count.away);
}

static void errors_print(const AccuracyErrors *errors, FILE *stream)
{
    if (errors->why_colors_only) {
        fprintf(stream, " %6s %7s %6s %7s %6s %7s  %7s  %7s  %10s %8s", "-", "-", "-", "-", "-", "-", "-",
                "-", "-", "-");
    } else {
        count_print(errors->object, stream);
        count_print(errors->shadow, stream);
        count_print(errors->path, stream);
        fprintf(stream, "  %7.1e  %7.1e  %10.3g %8.1e", errors->shading.rmse, errors->shading.largest,
                errors->t_ulps.percentile_999, errors->normal.percentile_999);
    }
    fprintf(stream, " %8.1f %6zu %6zu  %7.1e %6.3f\n", errors->image.psnr, errors->display.off_by_1,
            errors->display.off_by_more, errors->display.flip_mean, errors->display.flip_max);
}

static void crossed_print(const AccuracyVariant *variant, FILE *stream)
{
    if (variant->disqualified == 0) return;
    fputs("            crossed out:", stream);
    const char *words;
    for (size_t i = 0; (words = accuracy_crossed_words(variant, i)); i++)
        fprintf(stream, "%s %s", i > 0 ? "," : "", words);
    if (variant->disqualified & (DISQUALIFIED_NONFINITE | DISQUALIFIED_NEGATIVE))
        fprintf(stream, " (%zu not finite, %zu negative)", variant->errors.nonfinite,
                variant->errors.negative);
    fputc('\n', stream);
}

static void variant_print(const AccuracyVariant *variant, FILE *stream)
{
    const BenchKey *key = &variant->row->key;
    fprintf(stream, "%c %-9s %5u %-4s %5u", variant->disqualified ? 'x' : ' ', key->precision, key->lanes,
            key->bvh, variant->samples);
    if (variant->status == ACCURACY_UNAVAILABLE) {
        fprintf(stream, "  unavailable: %s\n", variant->row->failure);
        return;
    }
    fprintf(stream, " %6.4g", accuracy_frame_ms(variant));
    if (variant->status == ACCURACY_REFERENCE)
        fputs("  the reference\n", stream);
    else
        errors_print(&variant->errors, stream);
    crossed_print(variant, stream);
}

static void reference_print(const AccuracyScene *scene, FILE *stream)
{
    if (scene->reference.file)
        fprintf(stream, "  reference: %s, colors only", scene->reference.file);
    else
        fprintf(stream, "  reference: %s, %u lane%s, %u sample%s; %zu pixel%s at silhouettes",
                scene->reference.precision, scene->reference.lanes, text_plural(scene->reference.lanes),
                scene->reference.samples, text_plural(scene->reference.samples),
                scene->edges.silhouette_pixels, text_plural(scene->edges.silhouette_pixels));
    if (scene->reference.device) fprintf(stream, "; on %s", scene->reference.device);
    if (scene->reference.nonfinite + scene->reference.negative > 0)
        fprintf(stream, "; %zu of its pixels are not finite, %zu negative", scene->reference.nonfinite,
                scene->reference.negative);
    fputc('\n', stream);
}

static void kernels_print(const AccuracyScene *scene, FILE *stream)
{
    fputs("  kernels:", stream);
    for (size_t i = 0, printed = 0; i < scene->variant_count; i++) {
        const AccuracyVariant *variant = &scene->variants[i];
        if (variant->status == ACCURACY_UNAVAILABLE) continue;
        Text name = {0};
        accuracy_variant_name(&name, scene, variant);
        fprintf(stream, "%s %s %016" PRIx64, printed++ > 0 ? "," : "", text_c(&name),
                variant->row->kernel_hash);
        text_free(&name);
    }
    fputc('\n', stream);
}

void accuracy_print_text(const AccuracyReport *report, FILE *stream)
{
    device_heading_print(report->device, stream);
    if (report->perturb_seed > 0)
        fprintf(stream, "every variant with injected rounding errors: --perturb %u:%u\n",
                report->perturb_seed, report->perturb_scale);
    for (size_t i = 0; i < report->scene_count; i++) {
        const AccuracyScene *scene = &report->scenes[i];
        fprintf(stream, "\n%s, %ux%u\n", scene->path, scene->width, scene->height);
        reference_print(scene, stream);
        fputs(table_head, stream);
        for (size_t k = 0; k < scene->variant_count; k++)
            variant_print(&scene->variants[k], stream);
        kernels_print(scene, stream);
        fprintf(stream, "  fastest rows, with intervals of %g%% confidence for all together:\n",
                100 * comparison_confidence);
        for (size_t k = 0; k < scene->recommendation_count; k++) {
            Text sentence = accuracy_pick_sentence(scene, k);
            fprintf(stream, "    %s\n", text_c(&sentence));
            text_free(&sentence);
        }
    }
}
