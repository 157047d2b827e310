// Renders at `certified` and compares with the exact reference, for the tests of one program.
#pragma once

#include "host/verify/certify.h"
#include "host/verify/random_shape.h"
#include "tests/check.h"
#include "tests/probe.h"

static Random random_state;

enum { AOVS = AOV_OBJECT | AOV_SHADOW | AOV_PATH | AOV_FLAG };

typedef struct {
    size_t wrong, violations; // pixels; the latter are not listed as uncertified
    uint64_t rerendered, uncertified;
} DecisionCounts;

static inline Film image_render(const Scene *scene, const RenderSettings *settings)
{
    Film film;
    assert_true(renderer_render_film(probe_shared_renderer(scene, settings), AOVS, &film));
    return film;
}

static inline DecisionCounts decisions_count(const Scene *scene, const CertifySample *reference,
                                             const RenderSettings *settings)
{
    OwnedFilm film = image_render(scene, settings);
    const CertifyErrors errors = certify_compare(reference, &film);
    const DecisionCounts counted = {errors.object + errors.shadow + errors.path, errors.violations,
                                    film.rerenders.rerendered, film.rerenders.uncertified};
    return counted;
}

enum { SMALL_SIDE = 15 }; // odd: the image has a pixel in its center

// Returns settings of a small image at certified, with the same features for all, so that one program serves
// them.
static inline RenderSettings small_settings(uint32_t bounce_count)
{
    RenderSettings settings = film_settings(SMALL_SIDE, SMALL_SIDE, PRECISION_CERTIFIED);
    settings.bounce_count = bounce_count;
    if (tests_are_long()) settings.extra_features = FEATURE_ALL;
    return settings;
}

// Renders a small image. Its decided pixels must have the reference's decisions and colors. Returns the
// number of uncertified samples and frees the scene.
static inline size_t check_image(Scene *scene, const RenderSettings *settings, const char *what,
                                 double number)
{
    OwnedCertifySample reference;
    assert_true(certify_sample_open(&reference, scene, settings, SMALL_SIDE * SMALL_SIDE));
    OwnedFilm film = image_render(scene, settings);
    const CertifyErrors errors = certify_compare(&reference, &film);
    if (errors.violations > 0)
        fail_msg("%s, %g: of the pixels not uncertified %zu are wrong, at most %zu of them in color", what,
                 number, errors.violations, errors.color);
    const size_t uncertified = (size_t)film.rerenders.uncertified;
    scene_free(scene);
    return uncertified;
}

static inline size_t check_small(Scene *scene, uint32_t bounce_count, const char *what, double number)
{
    const RenderSettings settings = small_settings(bounce_count);
    return check_image(scene, &settings, what, number);
}

// Returns an empty scene seen along -z from a point, with `tangent` as the camera's half_tangent.
static inline Scene scene_seen_from(Vector3 from, double tangent)
{
    Scene scene = {.camera = {.position = from,
                              .look_at = {from.x, from.y, from.z - fmax(1, fabs(from.z))},
                              .up = {0, 1, 0},
                              .field_axis = FIELD_HORIZONTAL,
                              .half_tangent = tangent},
                   .background = {0.25, 0.25, 0.25},
                   .ambient = {0.1, 0.1, 0.1}};
    array_push(scene.materials, material_default());
    return scene;
}

static inline void point_light_add(Scene *scene, Vector3 position, double intensity)
{
    const Color color = {intensity, intensity, intensity};
    array_push(scene->lights, ((Light){.type = LIGHT_POINT, .color = color, .position = position}));
}
