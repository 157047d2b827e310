// The JSON of glint accuracy, and the rows that other formats are made of.
#include "host/cli/accuracy_report.h"
#include "host/cli/report_json.h"

#include "host/base/file.h"
#include <string.h>

const ResultTable accuracy_table = {
    .command = "accuracy",
    .rows = "scenes.variants",
    .names = {"scene", "size", "precision", "lanes", "BVH=bvh", "samples"},
    .values = {"frame ms=frame_ms.median", "kernel ms=kernel_ms.median",
               "objects at edges=errors.object.edge", "objects away=errors.object.away",
               "shadows at edges=errors.shadow.edge", "shadows away=errors.shadow.away",
               "paths at edges=errors.path.edge", "paths away=errors.path.away",
               "shading RMSE=errors.shading.rmse", "t ulp 99.9%=errors.t.ulps.p99_9",
               "normal 99.9%=errors.normal.p99_9", "PSNR dB=errors.image.psnr",
               "FLIP mean=errors.image.flip_mean", "crossed out=crossed_out"},
    .verdicts = {"crossed_out"},
    .failed = "true",
    .times = "frame_ms.median",
};

static const char is_reference[] = "it is the reference that the others are compared with, and has no errors";

Text accuracy_saved_prefix(const AccuracyReport *report, size_t scene, const AccuracyVariant *variant)
{
    Text text = {0};
    const char *name = file_base_name(report->scenes[scene].path), *dot = strrchr(name, '.');
    size_t length = dot && dot > name ? (size_t)(dot - name) : strlen(name);
    text_appendf(&text, "%s/%zu-%.*s", report->folder, scene, (int)length, name);
    if (variant)
        text_appendf(&text, "-%s-%u-%s-%u", variant->row->key.precision, variant->row->key.lanes,
                     variant->row->key.bvh, variant->samples);
    else
        text_appendf(&text, "-reference");
    return text;
}

static void saved_json(Json *json, const AccuracyReport *report, size_t scene, const AccuracyVariant *variant)
{
    if (report->folder) text_json(json, "saved", accuracy_saved_prefix(report, scene, variant));
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
        counts_json(json, "shadow", scene->edges.shadow_edge_pixels, scene->light_count);
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
        missing_json(json, "shading", "no pixel agrees with the reference");
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
        missing_json(json, "t", "no pixel shows the same object");
        missing_json(json, "normal", "no pixel shows the same object");
    }
}

static void errors_json(Json *json, const AccuracyErrors *errors)
{
    json_begin_object(json, "errors");
    json_count(json, "nonfinite", errors->nonfinite);
    json_count(json, "negative", errors->negative);
    if (errors->why_colors_only)
        for (unsigned measure = 0; measure < ACCURACY_IMAGE; measure++)
            missing_json(json, accuracy_measure_names[measure], errors->why_colors_only);
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
    numbers_json(json, "reference_color", worst->reference_color, 3);
    numbers_json(json, "variant_color", worst->variant_color, 3);
    json_end(json);
}

static void measured_json(Json *json, const AccuracyVariant *variant)
{
    json_bool(json, "crossed_out", variant->disqualified != 0);
    json_begin_array(json, "why");
    const char *words;
    for (size_t i = 0; (words = accuracy_crossed_words(variant, i)); i++)
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
        json_number(json, "frame_ms", accuracy_frame_ms(variant));
        json_begin_array(json, "others");
        for (size_t i = 0; i < scene->variant_count; i++) {
            const Comparison *time = &pick->times[i];
            if (time->ratio == 0) continue;
            json_begin_object(json, NULL);
            json_count(json, "variant", i);
            json_bool(json, "ties", accuracy_ties(pick, i));
            ratio_json(json, time);
            json_end(json);
        }
        json_end(json);
    }
    text_json(json, "text", accuracy_pick_sentence(scene, index));
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
