// How far an image is from a reference, split by what went wrong: another object, another shadow, another
// path, or the same of all three and other numbers. Works on plain arrays; docs/accuracy.md defines every
// figure.
#pragma once

#include "host/measure/bench.h"
#include "host/measure/comparison.h"
#include "host/measure/image_metrics.h"
#include "host/render/film.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Where a rounding decides what a pixel shows: the pixels whose value differs from one of their 4 neighbors',
// and those around them. NULL where the film lacks the AOV.
typedef struct {
    bool *silhouette, *shadow, *path;                           // shadow: for each light, as in the film
    size_t silhouette_pixels, *shadow_edge_pixels, path_pixels; // shadow: for each light
} AccuracyEdges;

// The AOVs that are compared.
enum { ACCURACY_AOVS = AOV_T | AOV_NORMAL | AOV_OBJECT | AOV_SHADOW | AOV_PATH };

void accuracy_edges_find(AccuracyEdges *edges, const Film *reference);
void accuracy_edges_free(AccuracyEdges *edges); // and zeroes

// The kinds of error, each with one figure that is plotted.
typedef enum {
    ACCURACY_OBJECT,  // pixels that show another object
    ACCURACY_SHADOW,  // shadow bits that differ, of all lights
    ACCURACY_PATH,    // pixels whose rays took another path
    ACCURACY_SHADING, // RMSE
    ACCURACY_T,       // 99.9th percentile, relative
    ACCURACY_NORMAL,  // 99.9th percentile, radians
    ACCURACY_IMAGE,   // RMSE
    ACCURACY_FLIP,    // mean
    ACCURACY_KIND_COUNT
} AccuracyKind;
extern const char *const accuracy_kind_names[ACCURACY_KIND_COUNT]; // "object", …, as in the JSON

// What differs at the reference's edges, and away from them.
typedef struct {
    size_t edge, away;
} EdgeCount;

typedef struct {
    double largest, percentile_999;
} ErrorExtremes;

// Where an error of a kind is largest. Of the kinds that are counted: among the wrong ones away from edges,
// or else those at edges, the one with the largest difference of color.
typedef struct {
    bool found; // false: there is no error of the kind, or it is unavailable
    bool away;  // of counted kinds: away from the reference's edges
    uint32_t x, y;
    uint32_t light; // shadow: the first that is wrong there
    // shading, image: of a channel; t: relative; normal: radians; counted kinds: of the color
    double error;
    // object: ids, shadow: bits, path: signatures, t: distances, shading, image: that channel; normal: none
    double reference, variant;
    double reference_color[3], variant_color[3];
} AccuracyWorst;

typedef struct {
    const char
        *why_colors_only; // why there is nothing but nonfinite, negative, image and display; NULL: there is
    size_t nonfinite, negative;     // pixels
    EdgeCount object, shadow, path; // shadow, path: where the object is the reference's
    // where object, shadows and path are the reference's, and a surface was hit
    size_t shading_pixels;
    ErrorSummary shading;
    // where the object is the reference's, and is one
    size_t surface_pixels;
    ErrorExtremes t_relative, t_ulps, normal;
    ErrorSummary image;                       // of every pixel
    ImageMetrics display;                     // as 8 bits and eyes see it: srgb_psnr, off_by_…, flip_…
    AccuracyWorst worst[ACCURACY_KIND_COUNT]; // none of FLIP
} AccuracyErrors;

// `variant` and `reference` are of one size, and of one number of lights. `display_values`: colors are for a
// screen as they are, without the sRGB curve.
void accuracy_compare(AccuracyErrors *errors, const Film *reference, const AccuracyEdges *edges,
                      const Film *variant, bool display_values);
// Pixels with a channel that is not finite, and with one below 0.
void accuracy_count_unsound(const Film *film, size_t *nonfinite, size_t *negative);

typedef enum {
    ACCURACY_MEASURED,
    ACCURACY_REFERENCE,   // the reference: times but no errors
    ACCURACY_UNAVAILABLE, // row->failure says why
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
    float *image;          // linear, 3 per pixel; NULL where unavailable
    unsigned disqualified; // set of DISQUALIFIED_…: why its speed does not count
    unsigned pareto;       // set of 1 << AccuracyKind: no other is as good in less time, by medians
} AccuracyVariant;

// An error that a user allows, and the fastest that keeps within it.
typedef struct {
    double budget;
    AccuracyKind measure; // shading, or image where there are colors only
    size_t variant;       // with the least median time of a frame; SIZE_MAX: none
    // for each variant, its time over the picked one's; a ratio of 0: it is the picked one, or is not within
    // the budget
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
        const char *file; // NULL: it was rendered as the next say
        const char *precision, *bvh;
        const char *device; // NULL: that of the variants
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

void accuracy_scene_free(AccuracyScene *scene); // with its images; and zeroes

// Returns whether a variant is within the pick's budget and not certainly slower than the picked one.
bool accuracy_ties(const AccuracyRecommendation *pick, size_t variant);
// The plotted figure of a kind, or why there is none.
Figure accuracy_figure(const AccuracyVariant *variant, AccuracyKind kind);
// From its errors, what disqualifies a variant.
unsigned accuracy_faults(const AccuracyErrors *errors);
// From errors and times: sets each variant's disqualified and pareto, and a recommendation for each budget.
// The runs of the variants must have been interleaved.
void accuracy_judge(AccuracyScene *scene, const AccuracyBudgets *budgets);
