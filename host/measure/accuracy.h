// Ranks the variants of a scene by their errors and times, and recommends the fastest within an error that a
// user allows. docs/accuracy.md defines every figure.
#pragma once

#include "host/measure/bench.h"
#include "host/measure/comparison.h"
#include "host/measure/film_comparison.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum {
    ACCURACY_MEASURED,
    ACCURACY_REFERENCE,   // the reference itself, which has times but no errors
    ACCURACY_UNAVAILABLE, // row->failure has the reason
    ACCURACY_STATUS_COUNT
} AccuracyStatus;
extern const char *const accuracy_status_names[ACCURACY_STATUS_COUNT];

enum {
    DISQUALIFIED_NONFINITE = 1,
    DISQUALIFIED_NEGATIVE = 2,
    DISQUALIFIED_OBJECT = 4,
    DISQUALIFIED_SHADOW = 8
};

typedef struct {
    const BenchRow *row; // precision, lanes, bvh; times, rays, the kernel's hash
    uint32_t samples;
    AccuracyStatus status;
    AccuracyErrors errors;
    float *image;          // linear, 3 values per pixel; NULL if unavailable
    double frame_seconds;  // the median
    unsigned disqualified; // the set of DISQUALIFIED_… for which its speed does not count
    unsigned pareto; // the set of 1 << AccuracyMeasure for which no other is as good in less median time
} AccuracyVariant;

// An error that a user allows, and the fastest variant that stays within it.
typedef struct {
    double budget;
    AccuracyMeasure measure; // shading, or image if there are only colors
    size_t variant;          // the one with the least median time of a frame, or SIZE_MAX
    // The time of each variant divided by that of the picked one. The ratio is 0 for the picked variant and
    // for those beyond the budget.
    Comparison *times;
} AccuracyRecommendation;

enum { BUDGETS_MAX = 16 };
typedef struct {
    double limits[BUDGETS_MAX];
    size_t count;
} AccuracyBudgets;

typedef struct {
    const char *path;
    uint32_t width, height, light_count, bounce_count;
    bool display_values;
    struct {
        const char *file; // NULL if the reference was rendered with the settings that follow
        const char *precision, *bvh;
        const char *device; // NULL if it is the variants' device
        uint32_t lanes, samples;
        uint64_t kernel_hash;
        size_t nonfinite, negative; // pixels
        float *image;               // linear, 3 per pixel
    } reference;
    AccuracyEdges edges;
    AccuracyVariant *variants;
    size_t variant_count;
    AccuracyRecommendation recommendations[BUDGETS_MAX];
    size_t recommendation_count;
} AccuracyScene;

// Frees the scene with its images and sets it to zeros.
void accuracy_scene_free(AccuracyScene *scene);

// Returns whether a variant is within the pick's budget and not certainly slower than the picked one.
bool accuracy_ties(const AccuracyRecommendation *pick, size_t variant);
// Returns the plotted figure of a type, or the reason why it is unavailable.
Figure accuracy_figure(const AccuracyVariant *variant, AccuracyMeasure type);
// Returns the set of DISQUALIFIED_… that follows from a variant's errors.
unsigned accuracy_disqualifications(const AccuracyErrors *errors);
// Sets, from errors and times, each variant's frame_seconds, disqualified and pareto, and a recommendation
// for each budget. The runs of the variants must have been interleaved.
void accuracy_classify(AccuracyScene *scene, const AccuracyBudgets *budgets);
