// How far a picture is from a reference, split by what went wrong: another object, another shadow, another
// path, or the same of all three and other numbers. Works on plain arrays; docs/accuracy.md defines every
// figure.
#pragma once

#include "host/measure/bench.h"
#include "host/measure/image_metrics.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// What was rendered: a value, or 3 or light_count of them, for each pixel, rows from the top. Whatever
// precision it was computed in, numbers are kept as doubles, which change none. All but the colors may be
// NULL: not to be had.
typedef struct {
    uint32_t width, height, light_count;
    bool wide; // computed in double; else its t is counted in ulps of float
    double *colors;
    double *t, *normal;               // at the pixel's center; infinity and 0 where nothing was hit
    uint32_t *object, *shadow, *path; // UINT32_MAX where nothing was hit; a bit for each light; a hash
} AccuracyLayers;

void accuracy_layers_free(AccuracyLayers *layers); // and zeroes

// The plotted figures, one of each kind of error.
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

// Counts of what differs within the reference's edges, and away from them; `why_not`: there are none.
typedef struct {
    size_t edge, away;
    const char *why_not; // NULL: counted
} EdgeCount;

typedef struct {
    size_t count; // compared
    double largest, percentile_999;
    const char *why_not;
} Extent;

// Where an error of a kind is largest. Of counted kinds: of the wrong ones away from edges, or else at them,
// the one with the largest difference of color.
typedef struct {
    bool found; // false: no error of the kind, or not to be had
    bool away;  // counted kinds: away from the reference's edges
    uint32_t x, y;
    uint32_t light; // shadow: the first that is wrong there
    double error;   // shading, image: of a channel; t: relative; normal: radians; else of the color
    double reference, variant; // object: ids, shadow: bits, path: hashes, t; shading, image: that channel
    double reference_color[3], variant_color[3];
} AccuracyWorst;

typedef struct {
    size_t nonfinite, negative; // pixels of the variant
    EdgeCount object, shadow, path;
    ErrorSummary shading; // where object, shadows and path are the reference's, and a surface was hit
    size_t shading_pixels;
    const char *shading_why_not;
    Extent t_relative, t_ulps, normal;  // where the object is the reference's
    ErrorSummary image;                 // of every pixel
    ImageMetrics display;               // as shown, with 8 bits: srgb_psnr, off_by_…, flip_…
    AccuracyWorst worst[ACCURACY_FLIP]; // of each kind but FLIP
} AccuracyErrors;

typedef enum {
    ACCURACY_MEASURED,
    ACCURACY_REFERENCE,   // it is what the others are held against: times, but no errors
    ACCURACY_UNAVAILABLE, // row.failure tells why
} AccuracyStatus;
extern const char *const accuracy_status_names[3];

enum { CROSSED_NONFINITE = 1, CROSSED_NEGATIVE = 2, CROSSED_OBJECT = 4, CROSSED_SHADOW = 8 };

typedef struct {
    BenchRow row; // precision, lanes, bvh; times, rays, kernel's hash
    uint32_t samples;
    AccuracyStatus status;
    AccuracyErrors errors;
    unsigned crossed_out; // set of CROSSED_…: why its speed does not count
    unsigned pareto;      // set of 1 << AccuracyKind: no other has as small an error in less time
    float *picture;       // linear, 3 per pixel; NULL where unavailable; the reference's, too
} AccuracyVariant;

// An error that a user allows, and what meets it.
enum { BUDGET_COUNT = 3 };
extern const double accuracy_budgets[BUDGET_COUNT]; // 1e-2, 1e-4, 1e-6

typedef struct {
    AccuracyKind measure; // shading, or image where that is all that there is
    size_t variant;       // SIZE_MAX: none
} AccuracyPick;

typedef struct {
    const char *path;
    uint32_t width, height, light_count, bounce_count;
    const char *reference_file; // NULL: it was rendered
    const char *reference_precision, *reference_bvh;
    uint32_t reference_lanes, reference_samples;
    uint64_t reference_kernel_hash;
    size_t reference_nonfinite, reference_negative; // pixels
    float *reference_picture;                       // linear, 3 per pixel
    bool display_values;                            // the scene's colors are display values already
    // pixels of the reference's edges, widened by one; why_not: a file has none
    size_t silhouette_pixels, *shadow_edge_pixels, path_edge_pixels; // shadow: of each light
    const char *edges_why_not;
    AccuracyVariant *variants;
    size_t variant_count;
    AccuracyPick picks[BUDGET_COUNT];
} AccuracyScene;
