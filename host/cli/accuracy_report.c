#include "host/cli/accuracy_report.h"

#include "host/base/array.h"
#include "host/cli/passport_report.h"
#include "host/cli/report_json.h"
#include <inttypes.h>
#include <math.h>
#include <string.h>

const ResultTable accuracy_table = {
    .command = "accuracy",
    .rows = "scenes.variants",
    .columns = {{"scene", "scene"},
                {"size", "size"},
                {"precision", "precision"},
                {"lanes", "lanes"},
                {"BVH", "bvh"},
                {"samples", "samples"},
                {"frame ms", "frame_ms.median"},
                {"kernel ms", "kernel_ms.median"},
                {"objects at edges", "errors.object.edge"},
                {"objects away", "errors.object.away"},
                {"shadows at edges", "errors.shadow.edge"},
                {"shadows away", "errors.shadow.away"},
                {"paths at edges", "errors.path.edge"},
                {"paths away", "errors.path.away"},
                {"shading RMSE", "errors.shading.rmse"},
                {"t ulp 99.9%", "errors.t.ulps.p99_9"},
                {"normal 99.9%", "errors.normal.p99_9"},
                {"PSNR dB", "errors.image.psnr"},
                {"FLIP mean", "errors.image.flip_mean"},
                {"crossed out", "crossed_out"}},
    .name_count = 6,
    .verdicts = {"crossed_out"},
    .failed = "true",
    .times = "frame_ms.median",
};

static const char is_reference[] =
    "it is the reference that the others are compared with, and has no errors of its own";

void accuracy_saved_prefix(Text *text, const AccuracyReport *report, size_t scene,
                           const AccuracyVariant *variant)
{
    const char *path = report->scenes[scene].path, *slash = strrchr(path, '/');
    const char *name = slash ? slash + 1 : path, *dot = strrchr(name, '.');
    size_t length = dot && dot > name ? (size_t)(dot - name) : strlen(name);
    text_appendf(text, "%s/%zu-%.*s", report->folder, scene, (int)length, name);
    if (variant)
        text_appendf(text, "-%s-%u-%s-%u", variant->row->key.precision, variant->row->key.lanes,
                     variant->row->key.bvh, variant->samples);
    else
        text_appendf(text, "-reference");
}

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
    if (lanes) text_appendf(text, " with %u %s", key->lanes, key->lanes == 1 ? "lane" : "lanes");
    if (bvh) text_appendf(text, " with BVH %s", key->bvh);
    if (samples)
        text_appendf(text, " with %u %s", variant->samples, variant->samples == 1 ? "sample" : "samples");
}

// Returns the reason with this index, counted from 0, for which the variant is crossed out, or NULL after the
// last.
static const char *crossed_words(const AccuracyVariant *variant, size_t index)
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

static double frame_ms(const AccuracyVariant *variant)
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

// Appends a sentence such as "for an error of at most 0.0001: single, 20.6 ms, 3.1e-06; double takes 1.8 to
// 2.1 times as long".
static void pick_sentence(Text *text, const AccuracyScene *scene, size_t pick)
{
    const AccuracyRecommendation *picked = &scene->recommendations[pick];
    text_appendf(text, "for an error of at most %g: ", picked->budget);
    if (picked->variant == SIZE_MAX) {
        text_appendf(text, "none of these");
        return;
    }
    const AccuracyVariant *variant = &scene->variants[picked->variant];
    accuracy_variant_name(text, scene, variant);
    text_appendf(text, ", %.3g ms", frame_ms(variant));
    if (variant->status == ACCURACY_REFERENCE) {
        text_appendf(text, ", the reference itself");
        pick_certainty(text, scene, picked);
        return;
    }
    text_appendf(text, ", %.2g", accuracy_figure(variant, picked->measure).value);
    pick_certainty(text, scene, picked);
    size_t objects = variant->errors.object.edge, shadows = variant->errors.shadow.edge;
    if (objects > 0)
        text_appendf(text, "; %zu %s at silhouettes %s another object", objects,
                     objects == 1 ? "pixel" : "pixels", objects == 1 ? "shows" : "show");
    if (shadows > 0) text_appendf(text, "; %zu wrong at the edges of shadows", shadows);
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
    for (size_t i = 0; (words = crossed_words(variant, i)); i++)
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
    fprintf(stream, " %6.4g", frame_ms(variant));
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
    const Device *device = report->device;
    fprintf(stream, "%s, %s %s\n", device->name, device->platform_name, device->driver);
    passports_remark(device, stream);
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
            Text sentence = {0};
            pick_sentence(&sentence, scene, k);
            fprintf(stream, "    %s\n", text_c(&sentence));
            text_free(&sentence);
        }
    }
}

static void absent_json(Json *json, const char *key, const char *reason)
{
    json_begin_object(json, key);
    unavailable_json(json, reason);
    json_end(json);
}

static void color_json(Json *json, const char *key, const double color[3])
{
    json_begin_array(json, key);
    for (size_t i = 0; i < 3; i++)
        json_number(json, NULL, color[i]);
    json_end(json);
}

static void saved_json(Json *json, const AccuracyReport *report, size_t scene, const AccuracyVariant *variant)
{
    if (!report->folder) return;
    Text prefix = {0};
    accuracy_saved_prefix(&prefix, report, scene, variant);
    json_text(json, "saved", text_c(&prefix));
    text_free(&prefix);
}

static void reference_json(Json *json, const AccuracyReport *report, size_t index)
{
    const AccuracyScene *scene = &report->scenes[index];
    json_begin_object(json, "reference");
    json_text(json, "kind", scene->reference.file ? "file" : "render");
    if (scene->reference.file) {
        json_text(json, "file", scene->reference.file);
    } else {
        json_text(json, "device", scene->reference.device ? scene->reference.device : report->device->name);
        json_text(json, "precision", scene->reference.precision);
        json_int64(json, "lanes", scene->reference.lanes);
        json_text(json, "bvh", scene->reference.bvh);
        json_int64(json, "samples", scene->reference.samples);
        hash_json(json, "kernel_hash", scene->reference.kernel_hash);
    }
    json_count(json, "nonfinite", scene->reference.nonfinite);
    json_count(json, "negative", scene->reference.negative);
    saved_json(json, report, index, NULL);
    json_end(json);

    json_begin_object(json, "edges");
    if (scene->reference.file) {
        unavailable_json(json, "the reference has colors only");
    } else {
        json_count(json, "silhouette", scene->edges.silhouette_pixels);
        json_begin_array(json, "shadow");
        for (uint32_t i = 0; i < scene->light_count; i++)
            json_count(json, NULL, scene->edges.shadow_edge_pixels[i]);
        json_end(json);
        json_count(json, "path", scene->edges.path_pixels);
    }
    json_end(json);
}

static void edge_count_json(Json *json, const char *key, EdgeCount count)
{
    json_begin_object(json, key);
    json_count(json, "edge", count.edge);
    json_count(json, "away", count.away);
    json_end(json);
}

static void extremes_json(Json *json, const char *key, ErrorExtremes extremes)
{
    if (key) json_begin_object(json, key);
    json_number(json, "max", extremes.largest);
    json_number(json, "p99_9", extremes.percentile_999);
    if (key) json_end(json);
}

static void kinds_json(Json *json, const AccuracyErrors *errors)
{
    edge_count_json(json, "object", errors->object);
    edge_count_json(json, "shadow", errors->shadow);
    edge_count_json(json, "path", errors->path);
    if (errors->shading_pixels > 0) {
        json_begin_object(json, "shading");
        json_count(json, "pixels", errors->shading_pixels);
        json_number(json, "max", errors->shading.largest);
        json_number(json, "rmse", errors->shading.rmse);
        json_number(json, "p99_9", errors->shading.percentile_999);
        json_number(json, "bias", errors->shading.bias);
        json_end(json);
    } else {
        absent_json(json, "shading", "no pixel shows a surface in the same way");
    }
    if (errors->surface_pixels > 0) {
        json_begin_object(json, "t");
        json_count(json, "pixels", errors->surface_pixels);
        extremes_json(json, "relative", errors->t_relative);
        extremes_json(json, "ulps", errors->t_ulps);
        json_end(json);
        json_begin_object(json, "normal");
        json_count(json, "pixels", errors->surface_pixels);
        extremes_json(json, NULL, errors->normal);
        json_end(json);
    } else {
        absent_json(json, "t", "no pixel shows the same object");
        absent_json(json, "normal", "no pixel shows the same object");
    }
}

static void errors_json(Json *json, const AccuracyErrors *errors)
{
    json_begin_object(json, "errors");
    json_count(json, "nonfinite", errors->nonfinite);
    json_count(json, "negative", errors->negative);
    if (errors->why_colors_only)
        for (unsigned measure = 0; measure < ACCURACY_IMAGE; measure++)
            absent_json(json, accuracy_measure_names[measure], errors->why_colors_only);
    else
        kinds_json(json, errors);
    const ImageMetrics *display = &errors->display;
    json_begin_object(json, "image");
    json_number(json, "rmse", errors->image.rmse);
    json_number(json, "psnr", errors->image.psnr);
    json_number(json, "rel_mse", errors->image.rel_mse);
    json_number(json, "srgb_psnr", display->srgb_psnr);
    json_count(json, "off_by_1", display->off_by_1);
    json_count(json, "off_by_more", display->off_by_more);
    json_number(json, "flip_mean", display->flip_mean);
    json_number(json, "flip_max", display->flip_max);
    json_end(json);
    json_end(json);
}

static void worst_json(Json *json, AccuracyMeasure measure, const AccuracyWorst *worst)
{
    const char *name = accuracy_measure_names[measure];
    if (!worst->found) {
        json_none(json, name);
        return;
    }
    json_begin_object(json, name);
    json_int64(json, "x", worst->x);
    json_int64(json, "y", worst->y);
    if (measure <= ACCURACY_PATH) json_bool(json, "away", worst->away);
    if (measure == ACCURACY_SHADOW) json_int64(json, "light", worst->light);
    json_number(json, "error", worst->error);
    if (measure != ACCURACY_NORMAL) {
        json_number(json, "reference", worst->reference);
        json_number(json, "variant", worst->variant);
    }
    color_json(json, "reference_color", worst->reference_color);
    color_json(json, "variant_color", worst->variant_color);
    json_end(json);
}

static void measured_json(Json *json, const AccuracyVariant *variant)
{
    json_bool(json, "crossed_out", variant->disqualified != 0);
    json_begin_array(json, "why");
    const char *words;
    for (size_t i = 0; (words = crossed_words(variant, i)); i++)
        json_text(json, NULL, words);
    json_end(json);
    errors_json(json, &variant->errors);
    json_begin_object(json, "worst");
    for (unsigned measure = 0; measure < ACCURACY_FLIP; measure++)
        worst_json(json, (AccuracyMeasure)measure, &variant->errors.worst[measure]);
    json_end(json);
    json_begin_object(json, "pareto");
    for (unsigned measure = 0; measure < ACCURACY_MEASURE_COUNT; measure++)
        if (!accuracy_figure(variant, (AccuracyMeasure)measure).why_not)
            json_bool(json, accuracy_measure_names[measure], variant->pareto >> measure & 1);
    json_end(json);
}

static void variant_json(Json *json, const AccuracyReport *report, size_t scene,
                         const AccuracyVariant *variant)
{
    const BenchKey *key = &variant->row->key;
    json_begin_object(json, NULL);
    json_text(json, "precision", key->precision);
    json_int64(json, "lanes", key->lanes);
    json_text(json, "bvh", key->bvh);
    json_int64(json, "samples", variant->samples);
    json_text(json, "status", accuracy_status_names[variant->status]);
    if (variant->status == ACCURACY_UNAVAILABLE) json_text(json, "reason", variant->row->failure);
    if (variant->status == ACCURACY_REFERENCE) json_text(json, "reason", is_reference);
    if (variant->status != ACCURACY_UNAVAILABLE) {
        hash_json(json, "kernel_hash", variant->row->kernel_hash);
        times_json(json, variant->row);
        rays_json(json, variant->row);
        saved_json(json, report, scene, variant);
    }
    if (variant->status == ACCURACY_MEASURED) measured_json(json, variant);
    json_end(json);
}

static void pick_json(Json *json, const AccuracyScene *scene, size_t index)
{
    const AccuracyRecommendation *pick = &scene->recommendations[index];
    json_begin_object(json, NULL);
    json_number(json, "budget", pick->budget);
    json_text(json, "measure", accuracy_measure_names[pick->measure]);
    if (pick->variant == SIZE_MAX) {
        json_none(json, "variant");
    } else {
        const AccuracyVariant *variant = &scene->variants[pick->variant];
        Figure error = accuracy_figure(variant, pick->measure);
        json_count(json, "variant", pick->variant);
        if (error.why_not)
            json_none(json, "error");
        else
            json_number(json, "error", error.value);
        json_number(json, "frame_ms", frame_ms(variant));
        json_begin_array(json, "others");
        for (size_t i = 0; i < scene->variant_count; i++) {
            const Comparison *time = &pick->times[i];
            if (time->ratio == 0) continue;
            json_begin_object(json, NULL);
            json_count(json, "variant", i);
            json_bool(json, "ties", accuracy_ties(pick, i));
            json_number(json, "ratio", time->ratio);
            json_number(json, "low", time->low);
            json_number(json, "high", time->high);
            json_end(json);
        }
        json_end(json);
    }
    Text sentence = {0};
    pick_sentence(&sentence, scene, index);
    json_text(json, "text", text_c(&sentence));
    text_free(&sentence);
    json_end(json);
}

static void scene_json(Json *json, const AccuracyReport *report, size_t index)
{
    const AccuracyScene *scene = &report->scenes[index];
    json_begin_object(json, NULL);
    json_text(json, "scene", scene->path);
    size_json(json, scene->width, scene->height);
    json_count(json, "pixels", (uint64_t)scene->width * scene->height);
    json_int64(json, "bounces", scene->bounce_count);
    json_int64(json, "lights", scene->light_count);
    reference_json(json, report, index);
    json_begin_array(json, "variants");
    for (size_t i = 0; i < scene->variant_count; i++)
        variant_json(json, report, index, &scene->variants[i]);
    json_end(json);
    json_number(json, "confidence", comparison_confidence);
    json_begin_array(json, "picks");
    for (size_t i = 0; i < scene->recommendation_count; i++)
        pick_json(json, scene, i);
    json_end(json);
    json_end(json);
}

Json *accuracy_json(const AccuracyReport *report)
{
    Json *json = report_json_open(1, report->device);
    perturb_json(json, report->perturb_seed, report->perturb_scale);
    json_begin_array(json, "scenes");
    for (size_t i = 0; i < report->scene_count; i++)
        scene_json(json, report, i);
    json_end(json);
    return json;
}
