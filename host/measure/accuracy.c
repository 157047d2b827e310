#include "host/measure/accuracy.h"

#include "host/base/memory.h"
#include <stdlib.h>

const char *const accuracy_status_names[ACCURACY_STATUS_COUNT] = {"measured", "reference", "unavailable"};

void accuracy_scene_free(AccuracyScene *scene)
{
    for (size_t i = 0; i < scene->variant_count; i++)
        free(scene->variants[i].image);
    for (size_t i = 0; i < scene->recommendation_count; i++)
        free(scene->recommendations[i].times);
    free(scene->variants);
    free(scene->reference.image);
    accuracy_edges_free(&scene->edges);
    *scene = (AccuracyScene){0};
}

static double sum_of(EdgeCount count)
{
    return (double)count.edge + (double)count.away;
}

Figure accuracy_figure(const AccuracyVariant *variant, AccuracyMeasure type)
{
    const AccuracyErrors *errors = &variant->errors;
    if (variant->status == ACCURACY_REFERENCE)
        return (Figure){.why_not = "it is the reference that the others are compared with"};
    if (variant->status == ACCURACY_UNAVAILABLE) return (Figure){.why_not = variant->row->failure};
    if (errors->why_colors_only && type != ACCURACY_IMAGE && type != ACCURACY_FLIP)
        return (Figure){.why_not = errors->why_colors_only};
    const char *no_surface = errors->surface_pixels > 0 ? NULL : "no pixel shows the same object";
    switch (type) {
    case ACCURACY_OBJECT:
        return (Figure){.value = sum_of(errors->object)};
    case ACCURACY_SHADOW:
        return (Figure){.value = sum_of(errors->shadow)};
    case ACCURACY_PATH:
        return (Figure){.value = sum_of(errors->path)};
    case ACCURACY_SHADING:
        return (Figure){errors->shading.rmse,
                        errors->shading_pixels > 0 ? NULL : "no pixel agrees with the reference"};
    case ACCURACY_T:
        return (Figure){errors->t_relative.percentile_999, no_surface};
    case ACCURACY_NORMAL:
        return (Figure){errors->normal.percentile_999, no_surface};
    case ACCURACY_IMAGE:
        return (Figure){errors->image.rmse, errors->image.count > 0 ? NULL : "no value is finite"};
    case ACCURACY_FLIP:
    case ACCURACY_MEASURE_COUNT:
        break;
    }
    return (Figure){.value = errors->display.flip_mean};
}

unsigned accuracy_disqualifications(const AccuracyErrors *errors)
{
    return (errors->nonfinite > 0 ? DISQUALIFIED_NONFINITE : 0u) |
           (errors->negative > 0 ? DISQUALIFIED_NEGATIVE : 0u) |
           (errors->object.away > 0 ? DISQUALIFIED_OBJECT : 0u) |
           (errors->shadow.away > 0 ? DISQUALIFIED_SHADOW : 0u);
}

static bool competes(const AccuracyVariant *variant)
{
    return variant->status == ACCURACY_REFERENCE ||
           (variant->status == ACCURACY_MEASURED && variant->disqualified == 0);
}

// Returns whether a is at least as good as b and better in error or time. The reference has no error, so its
// time alone decides.
static bool dominates(const AccuracyVariant *a, const AccuracyVariant *b, AccuracyMeasure type)
{
    Figure error_a = accuracy_figure(a, type), error_b = accuracy_figure(b, type);
    const double time_a = a->frame_seconds, time_b = b->frame_seconds;
    if (a->status == ACCURACY_REFERENCE) return time_a < time_b;
    if (error_a.why_not || error_a.value > error_b.value || time_a > time_b) return false;
    return error_a.value < error_b.value || time_a < time_b;
}

static bool is_pareto_optimal(const AccuracyScene *scene, const AccuracyVariant *variant,
                              AccuracyMeasure type)
{
    // the reference has no figure
    if (!competes(variant) || accuracy_figure(variant, type).why_not) return false;
    for (size_t i = 0; i < scene->variant_count; i++) {
        const AccuracyVariant *other = &scene->variants[i];
        if (other != variant && competes(other) && dominates(other, variant, type)) return false;
    }
    return true;
}

static bool is_within(const AccuracyVariant *variant, double budget, AccuracyMeasure measure)
{
    if (!competes(variant)) return false;
    if (variant->status == ACCURACY_REFERENCE) return true;
    const Figure error = accuracy_figure(variant, measure);
    return !error.why_not && error.value <= budget;
}

// Finds the recommendation for a budget. The intervals of all pairs of the scene's variants hold together, so
// they hold whichever variant is picked by its times.
static AccuracyRecommendation recommendation_find(const AccuracyScene *scene, double budget,
                                                  AccuracyMeasure measure)
{
    const size_t count = scene->variant_count, pair_count = count > 1 ? count * (count - 1) / 2 : 1;
    AccuracyRecommendation pick = {budget, measure, SIZE_MAX, NULL};
    for (size_t i = 0; i < count; i++) {
        if (!is_within(&scene->variants[i], budget, measure)) continue;
        if (pick.variant == SIZE_MAX ||
            scene->variants[i].frame_seconds < scene->variants[pick.variant].frame_seconds)
            pick.variant = i;
    }
    pick.times = memory_allocate_zeroed(count, sizeof *pick.times);
    for (size_t i = 0; i < count && pick.variant != SIZE_MAX; i++)
        if (i != pick.variant && is_within(&scene->variants[i], budget, measure))
            pick.times[i] =
                comparison_of_rounds(&scene->variants[i].row->times.frame,
                                     &scene->variants[pick.variant].row->times.frame, pair_count, 1);
    return pick;
}

bool accuracy_ties(const AccuracyRecommendation *pick, size_t variant)
{
    return pick->times[variant].ratio > 0 && pick->times[variant].verdict != VERDICT_SLOWER;
}

void accuracy_classify(AccuracyScene *scene, const AccuracyBudgets *budgets)
{
    for (size_t i = 0; i < scene->variant_count; i++) {
        AccuracyVariant *variant = &scene->variants[i];
        variant->frame_seconds = series_summarize(&variant->row->times.frame).median;
        variant->disqualified =
            variant->status == ACCURACY_MEASURED ? accuracy_disqualifications(&variant->errors) : 0;
    }
    for (size_t i = 0; i < scene->variant_count; i++) {
        AccuracyVariant *variant = &scene->variants[i];
        variant->pareto = 0;
        for (unsigned type = 0; type < ACCURACY_MEASURE_COUNT; type++)
            if (is_pareto_optimal(scene, variant, (AccuracyMeasure)type)) variant->pareto |= 1u << type;
    }
    for (size_t i = 0; i < scene->recommendation_count; i++)
        free(scene->recommendations[i].times);
    AccuracyMeasure measure = scene->reference.file ? ACCURACY_IMAGE : ACCURACY_SHADING;
    scene->recommendation_count = budgets->count;
    for (size_t i = 0; i < budgets->count; i++)
        scene->recommendations[i] = recommendation_find(scene, budgets->limits[i], measure);
}
