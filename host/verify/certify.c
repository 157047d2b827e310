#include "host/verify/certify.h"

#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Chooses a pixel of a cell of the image by a hash. The cell is at least one pixel wide and high.
static void place_choose(const CertifySample *sample, uint32_t columns, uint32_t rows, size_t index,
                         uint32_t place[2])
{
    const uint32_t cell[2] = {(uint32_t)(index % columns), (uint32_t)(index / columns)};
    const uint32_t counts[2] = {columns, rows}, sizes[2] = {sample->width, sample->height};
    const uint64_t hash = hash_bytes(HASH_START, cell, sizeof cell);
    for (int axis = 0; axis < 2; axis++) {
        const uint32_t first = (uint32_t)((uint64_t)cell[axis] * sizes[axis] / counts[axis]);
        const uint32_t end = (uint32_t)((uint64_t)(cell[axis] + 1) * sizes[axis] / counts[axis]);
        place[axis] = first + (uint32_t)(hash >> (24 * axis) & 0xffffff) % (end - first);
    }
}

static bool is_stopped(const RenderSettings *settings)
{
    return settings->stop && settings->stop(settings->stop_context);
}

// Computes a pixel with errors of rays by up to `blur`, from the random numbers of `seed`.
static ReferencePixel pixel_compute(const ReferenceScene *scene, const RenderSettings *settings,
                                    const uint32_t place[2], double blur, uint64_t seed, bool *shadows)
{
    const ReferencePath path = {settings->bounce_count, settings->min_contribution, blur, seed};
    const ReferenceRay ray =
        reference_camera_ray(&scene->scene.camera, settings->width, settings->height, place[0], place[1]);
    return reference_pixel(scene, &ray, &path, shadows);
}

typedef struct {
    CertifySample *sample;
    const ReferenceScene *scene;
    const RenderSettings *settings;
} Computation;

static void pixels_compute(void *context, size_t begin, size_t end)
{
    const Computation *computation = context;
    CertifySample *sample = computation->sample;
    for (size_t i = begin; i < end && !is_stopped(computation->settings); i++)
        sample->pixels[i] = pixel_compute(computation->scene, computation->settings, sample->places[i], 0, 0,
                                          sample->shadows + i * sample->light_count);
}

bool certify_sample_open(CertifySample *sample, const Scene *scene, const RenderSettings *settings,
                         size_t count)
{
    const uint32_t width = settings->width, height = settings->height;
    const double side = sqrt((double)width * height / (double)count);
    const uint32_t columns = (uint32_t)fmin(width, fmax(1, round(width / side)));
    const uint32_t rows = (uint32_t)fmin(height, fmax(1, round(height / side)));
    *sample = (CertifySample){.width = width,
                              .height = height,
                              .light_count = (uint32_t)scene->lights.count,
                              .count = (size_t)columns * rows};
    sample->places = memory_allocate(sample->count, sizeof *sample->places);
    sample->pixels = memory_allocate(sample->count, sizeof *sample->pixels);
    sample->shadows = memory_allocate_zeroed(sample->count * sample->light_count, sizeof(bool));
    for (size_t i = 0; i < sample->count; i++)
        place_choose(sample, columns, rows, i, sample->places[i]);
    OwnedReferenceScene reference = reference_scene_open(scene);
    Computation computation = {sample, &reference, settings};
    parallel_run(sample->count, 1, pixels_compute, &computation);
    if (!is_stopped(settings)) return true;
    certify_sample_close(sample);
    return false;
}

void certify_sample_close(CertifySample *sample)
{
    free(sample->places);
    free(sample->pixels);
    free(sample->shadows);
    *sample = (CertifySample){0};
}

// Returns the largest error of a channel, or infinity if a channel is not finite.
static double color_error(Color color, Color expected)
{
    const Vector3 error = vector_subtract(color, expected);
    return vector_is_within(error, DBL_MAX) ? vector_largest(error) : INFINITY;
}

// The first way in which a pixel is wrong.
typedef enum { RIGHT, WRONG_OBJECT, WRONG_SHADOW, WRONG_PATH, WRONG_COLOR } Mismatch;

static Mismatch mismatch_of(const CertifySample *sample, size_t index, const Film *film, size_t pixel)
{
    const ReferencePixel *expected = &sample->pixels[index];
    if (film->object[pixel] != expected->object) return WRONG_OBJECT;
    for (size_t i = 0; i < sample->light_count && expected->object != UINT32_MAX; i++)
        if ((film->shadow[pixel * sample->light_count + i] != 0) !=
            sample->shadows[index * sample->light_count + i])
            return WRONG_SHADOW;
    if (film->path[pixel] != expected->path) return WRONG_PATH;
    if (expected->has_texture) return RIGHT;
    const double bound = CERTIFIED_COLOR_ERROR * fmax(1, vector_largest(expected->color));
    return color_error(vector_from(film->color + 3 * pixel), expected->color) <= bound ? RIGHT : WRONG_COLOR;
}

static void violation_add(CertifyErrors *errors, const uint32_t place[2], double margin)
{
    errors->violations++;
    if (errors->violations > 1 && margin <= errors->violation_margin) return;
    errors->violation_margin = margin;
    memcpy(errors->violation_place, place, sizeof errors->violation_place);
}

static void color_compare(CertifyErrors *errors, Color color, Color expected, const uint32_t place[2],
                          bool is_wrong)
{
    errors->colors++;
    const double error = color_error(color, expected);
    if (error > fmax(errors->right_color, errors->wrong_color))
        memcpy(errors->worst, place, sizeof errors->worst);
    double *largest = is_wrong ? &errors->wrong_color : &errors->right_color;
    *largest = fmax(*largest, error);
}

CertifyErrors certify_compare(const CertifySample *sample, const Film *film)
{
    CertifyErrors errors = {0};
    size_t *const counts[] = {NULL, &errors.object, &errors.shadow, &errors.path, &errors.color};
    for (size_t i = 0; i < sample->count; i++) {
        const ReferencePixel *expected = &sample->pixels[i];
        const uint32_t *place = sample->places[i];
        const size_t pixel = (size_t)place[1] * film->width + place[0];
        const Mismatch mismatch = mismatch_of(sample, i, film, pixel);
        const bool claimed = film->flag[pixel] != FLAG_UNCERTIFIED;
        if (mismatch && claimed) violation_add(&errors, place, expected->margin);
        if (reference_is_uncertain(expected)) {
            errors.unconfirmed += claimed;
            errors.contradicted += claimed && mismatch;
            continue;
        }
        errors.compared++;
        if (mismatch) {
            ++*counts[mismatch];
            errors.margin = fmax(errors.margin, expected->margin);
        }
        if (!expected->has_texture)
            color_compare(&errors, vector_from(film->color + 3 * pixel), expected->color, place, mismatch);
    }
    return errors;
}

enum { TRIES = 16 };

typedef enum { LOOSE, CLOSE, WITNESSED } Uncertainty;

typedef struct {
    const ReferenceScene *scene;
    const RenderSettings *settings;
    const size_t *pixels;
    Uncertainty *uncertainties;
} Examination;

// Returns whether two answers differ by more than rounding.
static bool is_other(const ReferencePixel *a, const ReferencePixel *b)
{
    return a->object != b->object || a->path != b->path || color_error(a->color, b->color) > 1e-6;
}

static void pixels_examine(void *context, size_t begin, size_t end)
{
    const Examination *examination = context;
    const ReferenceScene *scene = examination->scene;
    const RenderSettings *settings = examination->settings;
    const size_t lights = scene->scene.lights.count;
    OWNED bool *shadows = memory_allocate_zeroed(2 * lights, sizeof *shadows);
    for (size_t i = begin; i < end && !is_stopped(settings); i++) {
        const size_t pixel = examination->pixels[i];
        const uint32_t place[2] = {(uint32_t)(pixel % settings->width), (uint32_t)(pixel / settings->width)};
        const ReferencePixel exact = pixel_compute(scene, settings, place, 0, 0, shadows);
        examination->uncertainties[i] = exact.margin < 0x1p-49 ? CLOSE : LOOSE;
        for (uint64_t seed = 0; seed < TRIES && examination->uncertainties[i] != WITNESSED; seed++) {
            const ReferencePixel other =
                pixel_compute(scene, settings, place, 0x1p-50, seed, shadows + lights);
            if (is_other(&exact, &other) ||
                (exact.object != UINT32_MAX && memcmp(shadows, shadows + lights, lights) != 0))
                examination->uncertainties[i] = WITNESSED;
        }
    }
}

CertifyUncertified certify_uncertified(const Scene *scene, const Film *film, const RenderSettings *settings,
                                       size_t count_max)
{
    CertifyUncertified found = {0};
    for (size_t i = 0; i < film_pixel_count(film); i++)
        found.count += film->flag[i] == FLAG_UNCERTIFIED;
    const size_t step = found.count / count_max + 1;
    OWNED size_t *pixels = memory_allocate(found.count / step + 1, sizeof *pixels);
    size_t chosen = 0;
    for (size_t i = 0, seen = 0; i < film_pixel_count(film); i++)
        if (film->flag[i] == FLAG_UNCERTIFIED && seen++ % step == 0) pixels[chosen++] = i;
    OWNED Uncertainty *uncertainties = memory_allocate(chosen, sizeof *uncertainties);
    OwnedReferenceScene reference = reference_scene_open(scene);
    Examination examination = {&reference, settings, pixels, uncertainties};
    parallel_run(chosen, 1, pixels_examine, &examination);
    found.examined = is_stopped(settings) ? 0 : chosen;
    for (size_t i = 0; i < found.examined; i++) {
        found.witnessed += uncertainties[i] == WITNESSED;
        found.close += uncertainties[i] == CLOSE;
    }
    return found;
}
