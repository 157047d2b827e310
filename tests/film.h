// Renders films for the tests that compare them.
#pragma once

#include "host/render/renderer.h"
#include <stdbool.h>

// GLINT_LONG_TESTS=1: tests take minutes instead of seconds.
bool tests_are_long(void);

// Returns the lanes to compare, up to a 0: 1 and the device's default, which most other tests use, or 4 if
// that is 1, except on a GPU, whose kernels are slower at 4 and take NVIDIA's compiler minutes; in
// long tests those of 1, 4, 8 and 16 that the device runs.
const uint32_t *tested_lanes(const Device *device);

// The features of the scenes that tests render at certified, which share its programs. With every other
// feature their build would take half as long again.
#define CERTIFIED_FEATURES                                                                                   \
    (FEATURE_SPHERES | FEATURE_PLANES | FEATURE_DISCS | FEATURE_BOXES | FEATURE_CYLINDERS | FEATURE_CONES |  \
     FEATURE_TRIANGLES | FEATURE_SMOOTH_NORMALS | FEATURE_TORI | FEATURE_PARABOLOIDS |                       \
     FEATURE_SUPERELLIPSOIDS | FEATURE_OVALS | FEATURE_POINT_LIGHTS | FEATURE_DIRECTIONAL_LIGHTS |           \
     FEATURE_CHECKERS | FEATURE_REFLECTION | FEATURE_TRANSMISSION | FEATURE_EYE_POWERS | FEATURE_BVH)

// Returns the features that tests build in beyond a scene's, so that all tests of a run share one program per
// precision: all, CERTIFIED_FEATURES at certified, and none in long tests.
FeatureSet film_features(Precision precision);

// Returns settings for the whole image, one sample per pixel, with the defaults of glint render except for
// film_features.
RenderSettings film_settings(uint32_t width, uint32_t height, Precision precision);

// Returns true, after printing the reason, if a passport of the device's arithmetic refuses the precision of
// the settings.
bool arithmetic_is_refused(Compute *compute, const RenderSettings *settings);

// Skips the test if arithmetic_is_refused returns true.
void skip_if_refused(Compute *compute, const RenderSettings *settings);

// Renders with the settings. Skips the test if the device's arithmetic is refused, and fails it if they do
// not fit the device otherwise.
Film film_render(Compute *compute, const Scene *scene, const RenderSettings *settings, unsigned aovs);

// Returns the color of the part of a film that starts at x, y.
Film film_cut(const Film *film, uint32_t x, uint32_t y, uint32_t width, uint32_t height);
// Returns the color of a film with its columns from right to left.
Film film_flipped(const Film *film);

// Fails the test, naming the first pixel that differs, unless the film's layers, all of which `expected` must
// have, are equal in value (hence in their bits, except for the sign of a zero). Frees neither.
void film_assert_same(const Film *film, const Film *expected, const char *what);

// Returns the number of pixels with a value that is not finite, or a negative color.
size_t film_count_faulty(const Film *film);
