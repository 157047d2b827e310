#include "host/measure/film_comparison.h"

#include "host/base/memory.h"
#include "host/base/percentile.h"
#include "host/base/ulp.h"
#include "host/scene/vector.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const accuracy_measure_names[ACCURACY_MEASURE_COUNT] = {"object", "shadow", "path",  "shading",
                                                                    "t",      "normal", "image", "flip"};

// A map with `stride` values per pixel.
typedef struct {
    const uint32_t *values;
    uint32_t width, height, stride, offset;
} ValueMap;

static uint32_t map_at(const ValueMap *map, size_t x, size_t y)
{
    return map->values[(y * map->width + x) * map->stride + map->offset];
}

static bool differs_from_neighbor(const ValueMap *map, size_t x, size_t y)
{
    uint32_t value = map_at(map, x, y);
    return (x > 0 && map_at(map, x - 1, y) != value) ||
           (x + 1 < map->width && map_at(map, x + 1, y) != value) ||
           (y > 0 && map_at(map, x, y - 1) != value) ||
           (y + 1 < map->height && map_at(map, x, y + 1) != value);
}

// Marks the map's edges in `edges`, which has the map's layout. Returns the number of pixels at edges.
static size_t edges_mark(const ValueMap *map, bool *edges)
{
    size_t count = 0;
    for (size_t y = 0; y < map->height; y++)
        for (size_t x = 0; x < map->width; x++) {
            if (!differs_from_neighbor(map, x, y)) continue;
            // the pixel and those around it
            for (size_t v = y > 0 ? y - 1 : 0; v <= y + 1 && v < map->height; v++)
                for (size_t u = x > 0 ? x - 1 : 0; u <= x + 1 && u < map->width; u++) {
                    bool *edge = &edges[(v * map->width + u) * map->stride + map->offset];
                    count += !*edge;
                    *edge = true;
                }
        }
    return count;
}

// Returns the map of the edges of a film's layer with `stride` values per pixel, and their numbers in
// `counts`.
static bool *layer_edges(const Film *film, const uint32_t *values, uint32_t stride, size_t *counts)
{
    bool *edges = memory_allocate_zeroed(film_pixel_count(film) * stride, sizeof *edges);
    ValueMap map = {values, film->width, film->height, stride, 0};
    for (; map.offset < stride; map.offset++)
        counts[map.offset] = edges_mark(&map, edges);
    return edges;
}

void accuracy_edges_find(AccuracyEdges *edges, const Film *reference)
{
    *edges = (AccuracyEdges){0};
    if (reference->object)
        edges->silhouette = layer_edges(reference, reference->object, 1, &edges->silhouette_pixels);
    if (reference->path) edges->path = layer_edges(reference, reference->path, 1, &edges->path_pixels);
    if (!reference->shadow) return;
    const uint32_t lights = reference->light_count;
    edges->shadow_edge_pixels = memory_allocate_zeroed(lights, sizeof(size_t));
    edges->shadow = layer_edges(reference, reference->shadow, lights, edges->shadow_edge_pixels);
}

void accuracy_edges_free(AccuracyEdges *edges)
{
    free(edges->silhouette);
    free(edges->shadow);
    free(edges->path);
    free(edges->shadow_edge_pixels);
    *edges = (AccuracyEdges){0};
}

void accuracy_count_unsound(const Film *film, size_t *nonfinite, size_t *negative)
{
    *nonfinite = *negative = 0;
    for (size_t i = 0; i < film_pixel_count(film); i++) {
        const double *color = film->color + 3 * i;
        *nonfinite += !isfinite(color[0]) || !isfinite(color[1]) || !isfinite(color[2]);
        *negative += color[0] < 0 || color[1] < 0 || color[2] < 0;
    }
}

typedef struct {
    const Film *reference, *variant;
    const AccuracyEdges *edges;
    AccuracyErrors *errors;
    // Values of the pixels that hit the reference's object:
    double *expected, *found; // the colors of the shaded ones
    float *t_relative, *t_ulps, *normal;
} FilmComparison;

// Returns the error of the channel in which a pixel's colors differ most, and its values.
static AccuracyWorst color_worst(const FilmComparison *comparison, size_t pixel)
{
    AccuracyWorst worst = {.error = -1};
    for (size_t i = 3 * pixel; i < 3 * pixel + 3; i++) {
        const double reference = comparison->reference->color[i], variant = comparison->variant->color[i];
        const double error = value_error(reference, variant);
        if (error > worst.error)
            worst = (AccuracyWorst){.error = error, .reference = reference, .variant = variant};
    }
    return worst;
}

// Keeps the error if it is the worst of its type so far. An error away from edges is worse than any at edges.
static void worst_record(const FilmComparison *comparison, AccuracyMeasure type, size_t pixel,
                         const AccuracyWorst *candidate)
{
    AccuracyWorst *worst = &comparison->errors->worst[type];
    if (worst->found && (worst->away > candidate->away ||
                         (worst->away == candidate->away && !(candidate->error > worst->error))))
        return;
    *worst = *candidate;
    worst->found = true;
    worst->x = (uint32_t)(pixel % comparison->reference->width);
    worst->y = (uint32_t)(pixel / comparison->reference->width);
    memcpy(worst->reference_color, comparison->reference->color + 3 * pixel, sizeof worst->reference_color);
    memcpy(worst->variant_color, comparison->variant->color + 3 * pixel, sizeof worst->variant_color);
}

static void count_wrong(const FilmComparison *comparison, AccuracyMeasure type, size_t pixel, bool edge,
                        const uint32_t values[2], uint32_t light)
{
    AccuracyErrors *errors = comparison->errors;
    EdgeCount *count = type == ACCURACY_OBJECT   ? &errors->object
                       : type == ACCURACY_SHADOW ? &errors->shadow
                                                 : &errors->path;
    count->edge += edge;
    count->away += !edge;
    worst_record(comparison, type, pixel,
                 &(AccuracyWorst){.away = !edge,
                                  .light = light,
                                  .error = color_worst(comparison, pixel).error,
                                  .reference = values[0],
                                  .variant = values[1]});
}

// Returns whether every light's bit equals the reference's. Where two surfaces touch, a rounding decides
// whether a point of the one lies in the other's shadow, so silhouettes are edges of every shadow.
static bool shadows_compare(const FilmComparison *comparison, size_t pixel)
{
    const uint32_t lights = comparison->reference->light_count;
    bool equal = true;
    for (uint32_t light = 0; light < lights; light++) {
        const size_t bit = pixel * lights + light;
        const uint32_t values[2] = {comparison->reference->shadow[bit], comparison->variant->shadow[bit]};
        if (values[0] == values[1]) continue;
        equal = false;
        count_wrong(comparison, ACCURACY_SHADOW, pixel,
                    comparison->edges->shadow[bit] || comparison->edges->silhouette[pixel], values, light);
    }
    return equal;
}

static bool path_compare(const FilmComparison *comparison, size_t pixel)
{
    const uint32_t values[2] = {comparison->reference->path[pixel], comparison->variant->path[pixel]};
    if (values[0] == values[1]) return true;
    count_wrong(comparison, ACCURACY_PATH, pixel, comparison->edges->path[pixel], values, 0);
    return false;
}

// Returns the angle between two vectors of about unit length, accurately even if it is small or near pi.
static double vector_angle(Vector3 a, Vector3 b)
{
    double angle = atan2(vector_length(vector_cross(a, b)), vector_dot(a, b));
    return isfinite(angle) ? angle : INFINITY;
}

static void surface_compare(const FilmComparison *comparison, size_t pixel)
{
    AccuracyErrors *errors = comparison->errors;
    const size_t place = errors->surface_pixels++;
    const double expected = comparison->reference->t[pixel], found = comparison->variant->t[pixel];
    const double difference = value_error(expected, found), relative = difference / fabs(expected);
    const int significant_bits = comparison->variant->is_double ? DBL_MANT_DIG : FLT_MANT_DIG;
    const double ulps = difference / ulp_of(expected, significant_bits);
    const double angle = vector_angle(vector_from(comparison->reference->normal + 3 * pixel),
                                      vector_from(comparison->variant->normal + 3 * pixel));
    comparison->t_relative[place] = (float)relative;
    comparison->t_ulps[place] = (float)ulps;
    comparison->normal[place] = (float)angle;
    errors->t_relative.largest = fmax(errors->t_relative.largest, relative);
    errors->t_ulps.largest = fmax(errors->t_ulps.largest, ulps);
    errors->normal.largest = fmax(errors->normal.largest, angle);
    if (relative > 0)
        worst_record(comparison, ACCURACY_T, pixel,
                     &(AccuracyWorst){.error = relative, .reference = expected, .variant = found});
    if (angle > 0) worst_record(comparison, ACCURACY_NORMAL, pixel, &(AccuracyWorst){.error = angle});
}

static void color_error_record(const FilmComparison *comparison, AccuracyMeasure type, size_t pixel)
{
    const AccuracyWorst candidate = color_worst(comparison, pixel);
    if (candidate.error > 0) worst_record(comparison, type, pixel, &candidate);
}

static void pixel_compare(const FilmComparison *comparison, size_t pixel)
{
    AccuracyErrors *errors = comparison->errors;
    color_error_record(comparison, ACCURACY_IMAGE, pixel);
    if (errors->why_colors_only) return;
    const uint32_t objects[2] = {comparison->reference->object[pixel], comparison->variant->object[pixel]};
    if (objects[0] != objects[1]) {
        count_wrong(comparison, ACCURACY_OBJECT, pixel, comparison->edges->silhouette[pixel], objects, 0);
        return;
    }
    bool same_shadows = shadows_compare(comparison, pixel), same_path = path_compare(comparison, pixel);
    if (objects[0] == UINT32_MAX) return;
    surface_compare(comparison, pixel);
    if (!same_shadows || !same_path) return;
    const size_t place = 3 * errors->shading_pixels++;
    memcpy(comparison->expected + place, comparison->reference->color + 3 * pixel, 3 * sizeof(double));
    memcpy(comparison->found + place, comparison->variant->color + 3 * pixel, 3 * sizeof(double));
    color_error_record(comparison, ACCURACY_SHADING, pixel);
}

static ImageMetrics display_compare(const Film *reference, const Film *variant, bool display_values)
{
    const Film *const films[] = {reference, variant};
    Image images[2];
    for (size_t i = 0; i < 2; i++)
        images[i] = (Image){.width = films[i]->width,
                            .height = films[i]->height,
                            .channels = 3,
                            .values = film_narrow_color(films[i]),
                            .display = display_values};
    ImageMetrics metrics = image_metrics(&images[0], &images[1]);
    image_free(&images[0]);
    image_free(&images[1]);
    return metrics;
}

void accuracy_compare(AccuracyErrors *errors, const Film *reference, const AccuracyEdges *edges,
                      const Film *variant, bool display_values)
{
    *errors = (AccuracyErrors){0};
    if (!reference->object) errors->why_colors_only = "the reference has colors only";
    accuracy_count_unsound(variant, &errors->nonfinite, &errors->negative);
    const size_t pixels = film_pixel_count(reference);
    OWNED double *expected = memory_allocate(pixels, 3 * sizeof *expected);
    OWNED double *found = memory_allocate(pixels, 3 * sizeof *found);
    OWNED float *t_relative = memory_allocate(pixels, sizeof *t_relative);
    OWNED float *t_ulps = memory_allocate(pixels, sizeof *t_ulps);
    OWNED float *normal = memory_allocate(pixels, sizeof *normal);
    const FilmComparison comparison = {reference, variant,    edges,  errors, expected,
                                       found,     t_relative, t_ulps, normal};
    for (size_t pixel = 0; pixel < pixels; pixel++)
        pixel_compare(&comparison, pixel);
    errors->shading = error_summarize(expected, found, 3 * errors->shading_pixels);
    errors->t_relative.percentile_999 = percentile_999(t_relative, errors->surface_pixels);
    errors->t_ulps.percentile_999 = percentile_999(t_ulps, errors->surface_pixels);
    errors->normal.percentile_999 = percentile_999(normal, errors->surface_pixels);
    errors->image = error_summarize(reference->color, variant->color, 3 * pixels);
    errors->display = display_compare(reference, variant, display_values);
}
