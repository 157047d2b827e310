// Measures the differences of an image from a reference by cause, which is another object, another shadow,
// another path, or different numbers where these three agree. docs/accuracy.md defines every figure.
#pragma once

#include "host/image/image_metrics.h"
#include "host/render/film.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The edges, where a rounding decides what a pixel shows. These are the pixels whose value differs from that
// of one of their 4 neighbors, and the pixels around them. Maps of AOVs that the film lacks are NULL.
typedef struct {
    bool *silhouette, *shadow, *path; // the shadow map is laid out as in the film, with values per light
    size_t silhouette_pixels, *shadow_edge_pixels, path_pixels; // shadow_edge_pixels has a count per light
} AccuracyEdges;

// The AOVs that are compared.
enum { ACCURACY_AOVS = AOV_T | AOV_NORMAL | AOV_OBJECT | AOV_SHADOW | AOV_PATH };

void accuracy_edges_find(AccuracyEdges *edges, const Film *reference);
// Frees the maps and sets the edges to zeros.
void accuracy_edges_free(AccuracyEdges *edges);

// The types of error. One figure of each is plotted.
typedef enum {
    ACCURACY_OBJECT,  // pixels that show another object
    ACCURACY_SHADOW,  // shadow bits that differ, over all lights
    ACCURACY_PATH,    // pixels whose rays took another path
    ACCURACY_SHADING, // RMSE
    ACCURACY_T,       // 99.9th percentile, relative
    ACCURACY_NORMAL,  // 99.9th percentile, radians
    ACCURACY_IMAGE,   // RMSE
    ACCURACY_FLIP,    // mean
    ACCURACY_MEASURE_COUNT
} AccuracyMeasure;
extern const char *const accuracy_measure_names[ACCURACY_MEASURE_COUNT]; // "object" and so on, as in the JSON

// The number of differences at the reference's edges and away from them.
typedef struct {
    size_t edge, away;
} EdgeCount;

typedef struct {
    double largest, percentile_999;
} ErrorExtremes;

// The place where an error of a type is largest. For types that are counted, it is the wrong pixel away from
// edges, or else at edges, whose color differs most.
typedef struct {
    bool found; // false if there is no error of the type or it is unavailable
    bool away;  // for counted types, whether the place is away from the reference's edges
    uint32_t x, y;
    uint32_t light; // for shadows, the first light that is wrong there
    // The error of a channel for shading and image, a relative one for t, radians for normals, and the error
    // of the color for counted types.
    double error;
    // The ids of objects, the bits of shadows, the signatures of paths, the distances for t, and the values
    // of that channel for shading and image. Unset for normals.
    double reference, variant;
    double reference_color[3], variant_color[3];
} AccuracyWorst;

typedef struct {
    // Why only nonfinite, negative, image and display are set; NULL if all members are.
    const char *why_colors_only;
    size_t nonfinite, negative;     // pixels
    EdgeCount object, shadow, path; // shadows and paths are compared where the object equals the reference's
    // Pixels that hit a surface and whose object, shadows and path equal the reference's.
    size_t shading_pixels;
    ErrorSummary shading;
    // Pixels that hit an object, which equals the reference's.
    size_t surface_pixels;
    ErrorExtremes t_relative, t_ulps, normal;
    ErrorSummary image;                          // over all pixels
    ImageMetrics display;                        // only srgb_psnr, off_by_… and flip_… are set
    AccuracyWorst worst[ACCURACY_MEASURE_COUNT]; // unset for FLIP
} AccuracyErrors;

// Compares a variant with the reference, which must have the same size and number of lights. With
// `display_values`, colors are shown on a screen without the sRGB curve.
void accuracy_compare(AccuracyErrors *errors, const Film *reference, const AccuracyEdges *edges,
                      const Film *variant, bool display_values);
// Counts the pixels with a channel that is not finite, and those with a channel below 0.
void accuracy_count_unsound(const Film *film, size_t *nonfinite, size_t *negative);
