// The JSON of glint accuracy, and the rows that other formats are made of.
#include "host/cli/accuracy_report.h"
#include "host/cli/report_json.h"

#include "host/base/file.h"
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

const ResultTable accuracy_table = {
    .command = "accuracy",
    .rows = "scenes.variants",
    .names = {"scene", "size", "precision", "lanes", "BVH=bvh", "samples"},
    .values = {"frame ms=frame_ms.median", "wrong objects at edges=errors.object.edge",
               "wrong objects away=errors.object.away", "wrong shadows at edges=errors.shadow.edge",
               "wrong shadows away=errors.shadow.away", "wrong paths at edges=errors.path.edge",
               "wrong paths away=errors.path.away", "shading RMSE=errors.shading.rmse",
               "shading max=errors.shading.max", "t ulp 99.9%=errors.t.ulps.p99_9",
               "normal 99.9%=errors.normal.p99_9", "image RMSE=errors.image.rmse",
               "PSNR dB=errors.image.psnr", "8-bit off by 1=errors.image.off_by_1",
               "8-bit off by more=errors.image.off_by_more", "FLIP mean=errors.image.flip_mean",
               "FLIP max=errors.image.flip_max"},
    .extras = {"kernel ms=kernel_ms.median", "crossed out=crossed_out", "kernel=kernel_hash", "reason"},
    .verdicts = {"crossed_out"},
    .failed = "true",
    .times = "frame_ms.median",
};

static const char is_reference[] = "it is the reference that the others are compared with, and has no errors";

Text accuracy_saved_prefix(const AccuracyReport *report, size_t scene, const AccuracyVariant *variant)
{
    Text text = {0};
    OWNED char *stem = file_stem(report->scenes[scene].path);
    text_appendf(&text, "%s/%zu-%s", report->folder, scene, stem);
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
    const char *file = scene->reference.file;
    json_begin_object(json, "reference");
    json_text(json, "kind", file ? "file" : "render");
    if (file)
        json_text(json, "file", file);
    else
        json_addf(json, "device %s precision %s lanes %u bvh %s samples %u kernel_hash %016" PRIx64,
                  scene->reference.device ? scene->reference.device : report->device->name,
                  scene->reference.precision, scene->reference.lanes, scene->reference.bvh,
                  scene->reference.samples, scene->reference.kernel_hash);
    json_addf(json, "nonfinite %zu negative %zu", scene->reference.nonfinite, scene->reference.negative);
    saved_json(json, report, index, NULL);
    json_end(json);

    json_begin_object(json, "edges");
    if (file) {
        unavailable_json(json, "the reference has colors only");
    } else {
        json_count(json, "silhouette", scene->edges.silhouette_pixels);
        counts_json(json, "shadow", scene->edges.shadow_edge_pixels, scene->light_count);
        json_count(json, "path", scene->edges.path_pixels);
    }
    json_end(json);
}

static void kinds_json(Json *json, const AccuracyErrors *errors)
{
    const ErrorSummary *shading = &errors->shading;
    json_addf(json, "object {edge %zu away %zu} shadow {edge %zu away %zu} path {edge %zu away %zu}",
              errors->object.edge, errors->object.away, errors->shadow.edge, errors->shadow.away,
              errors->path.edge, errors->path.away);
    if (errors->shading_pixels > 0)
        json_addf(json, "shading {pixels %zu max %g rmse %g p99_9 %g bias %g}", errors->shading_pixels,
                  shading->largest, shading->rmse, shading->percentile_999, shading->bias);
    else
        missing_json(json, "shading", "no pixel agrees with the reference");
    if (errors->surface_pixels > 0) {
        json_addf(json, "t {pixels %zu relative {max %g p99_9 %g} ulps {max %g p99_9 %g}}",
                  errors->surface_pixels, errors->t_relative.largest, errors->t_relative.percentile_999,
                  errors->t_ulps.largest, errors->t_ulps.percentile_999);
        json_addf(json, "normal {pixels %zu max %g p99_9 %g}", errors->surface_pixels, errors->normal.largest,
                  errors->normal.percentile_999);
    } else {
        missing_json(json, "t", "no pixel shows the same object");
        missing_json(json, "normal", "no pixel shows the same object");
    }
}

static void errors_json(Json *json, const AccuracyErrors *errors)
{
    const ImageMetrics *display = &errors->display;
    json_begin_object(json, "errors");
    json_addf(json, "nonfinite %zu negative %zu", errors->nonfinite, errors->negative);
    if (errors->why_colors_only)
        for (unsigned measure = 0; measure < ACCURACY_IMAGE; measure++)
            missing_json(json, accuracy_measure_names[measure], errors->why_colors_only);
    else
        kinds_json(json, errors);
    json_addf(json,
              "image {rmse %g psnr %g rel_mse %g srgb_psnr %g off_by_1 %zu off_by_more %zu flip_mean %g "
              "flip_max %g}",
              errors->image.rmse, errors->image.psnr, errors->image.rel_mse, display->srgb_psnr,
              display->off_by_1, display->off_by_more, display->flip_mean, display->flip_max);
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
    json_addf(json, "x %u y %u", worst->x, worst->y);
    if (measure <= ACCURACY_PATH) json_bool(json, "away", worst->away);
    if (measure == ACCURACY_SHADOW) json_count(json, "light", worst->light);
    json_number(json, "error", worst->error);
    if (measure != ACCURACY_NORMAL)
        json_addf(json, "reference %g variant %g", worst->reference, worst->variant);
    numbers_json(json, "reference_color", 1, worst->reference_color, 3);
    numbers_json(json, "variant_color", 1, worst->variant_color, 3);
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
    json_addf(json, "precision %s lanes %u bvh %s samples %u status %s", key->precision, key->lanes, key->bvh,
              variant->samples, accuracy_status_names[variant->status]);
    if (variant->status == ACCURACY_UNAVAILABLE) json_text(json, "reason", variant->row->failure);
    if (variant->status == ACCURACY_REFERENCE) json_text(json, "reason", is_reference);
    if (variant->status != ACCURACY_UNAVAILABLE) {
        json_addf(json, "kernel_hash %016" PRIx64, variant->row->kernel_hash);
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
    json_addf(json, "budget %g measure %s", pick->budget, accuracy_measure_names[pick->measure]);
    if (pick->variant == SIZE_MAX) {
        json_none(json, "variant");
    } else {
        const AccuracyVariant *variant = &scene->variants[pick->variant];
        const Figure error = accuracy_figure(variant, pick->measure);
        json_addf(json, "variant %zu error %g frame_ms %g", pick->variant, error.why_not ? NAN : error.value,
                  accuracy_frame_ms(variant));
        json_begin_array(json, "others");
        for (size_t i = 0; i < scene->variant_count; i++) {
            const Comparison *time = &pick->times[i];
            if (time->ratio != 0)
                json_addf(json, "{variant %zu ties %d ratio %g low %g high %g}", i, accuracy_ties(pick, i),
                          time->ratio, time->low, time->high);
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
    json_addf(json, "scene %s size [%u %u] pixels %" PRIu64 " bounces %u lights %u", scene->path,
              scene->width, scene->height, (uint64_t)scene->width * scene->height, scene->bounce_count,
              scene->light_count);
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
    Json *json = report_json_open(2, report->device);
    perturb_json(json, report->perturb_seed, report->perturb_scale);
    json_begin_array(json, "scenes");
    for (size_t i = 0; i < report->scene_count; i++)
        scene_json(json, report, i);
    json_end(json);
    return json;
}
