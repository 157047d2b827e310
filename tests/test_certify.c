// Checks whole scenes as glint certify does. Double and certified must decide as the reference does, and the
// reference must raise no false alarms. tests/test_certify.py has the command.
// run_tests: sanitize-long-only
#include "host/verify/certify.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

enum { WIDTH = 96, HEIGHT = 64, PIXELS = WIDTH * HEIGHT };

// Renders the scene, `scale` times as wide and high as WIDTH and HEIGHT, and compares about `count` pixels.
// `uncertified`, which may be NULL, receives the pixels that are uncertified.
static CertifyErrors certify(const Scene *scene, Precision precision, uint32_t scale, size_t count,
                             CertifyUncertified *uncertified)
{
    const RenderSettings settings = film_settings(WIDTH * scale, HEIGHT * scale, precision);
    OwnedCertifySample reference;
    assert_true(certify_sample_open(&reference, scene, &settings, count));
    OwnedFilm film =
        film_render(&probe_compute, scene, &settings, AOV_OBJECT | AOV_SHADOW | AOV_PATH | AOV_FLAG);
    const CertifyErrors errors = certify_compare(&reference, &film);
    size_t uncertain = 0;
    for (size_t i = 0; i < reference.count; i++)
        uncertain += reference_is_uncertain(&reference.pixels[i]);
    assert_int_equal(errors.compared, reference.count - uncertain);
    assert_true(uncertain < reference.count / 10);
    if (uncertified) *uncertified = certify_uncertified(scene, &film, &settings, count / 10 + 1);
    return errors;
}

static size_t wrong_pixels(const CertifyErrors *errors)
{
    return errors->object + errors->shadow + errors->path + errors->color;
}

// Scenes of every shape, light and type of bounce. The largest error of double is 3e-12.
TEST(the_best_precision_is_right)
{
    const bool has_double = probe_has(PRECISION_DOUBLE);
    const char *const paths[] = {"scenes/demo.yaml", "scenes/mirror-glass.yaml", "scenes/paraboloids.yaml",
                                 "scenes/triangles.yaml"};
    for (size_t i = 0; i < (tests_are_long() ? 4 : 3); i++) {
        OwnedScene scene = scene_of_file(paths[i]);
        const CertifyErrors errors =
            certify(&scene, has_double ? PRECISION_DOUBLE : PRECISION_STRICT, 1, 600, NULL);
        print_message("%s\n", paths[i]);
        assert_true(wrong_pixels(&errors) <= (has_double ? 0 : 2));
        assert_true(!has_double || errors.right_color < 1e-10);
    }
}

// By a smooth triangle's normals the reflected ray would run through it, and a light behind it shine on it.
TEST(tilted_normals_are_decided)
{
    if (!probe_has(PRECISION_DOUBLE)) skip();
    OwnedScene scene = scene_of_text(
        "tilted.yaml",
        "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\n"
        "lights: [{point: {position: [8, 0, 2]}}, {point: {position: [3, 1, -4]}}]\n"
        "objects:\n"
        "  - triangle: {vertices: [[-2, -1, 0], [0, 2, 0], [2, -1, 0]], material: {reflection: 0.5},\n"
        "               normals: [[3, 0, -1], [3, 1, -1], [1, 0, -1]]}\n"
        "  - sphere: {center: [3, 0, 3], radius: 2}\n");
    const CertifyErrors errors = certify(&scene, PRECISION_DOUBLE, 1, 600, NULL);
    assert_int_equal(wrong_pixels(&errors), 0);
    assert_true(errors.right_color < 1e-10);
    const CertifyErrors certified = certify(&scene, PRECISION_CERTIFIED, 1, 600, NULL);
    assert_int_equal(wrong_pixels(&certified), 0);
}

// Spheres around the zenith, the nadir and the seam, and shapes in all directions.
TEST(panoramas_are_right)
{
    const bool has_double = probe_has(PRECISION_DOUBLE);
    OwnedScene scene = scene_of_text(
        "panorama.yaml",
        "camera: {position: [0.1, 1, 0.2], look_at: [1, 1.3, -2], up: [0.1, 1, 0], projection: "
        "equirectangular}\n"
        "background: {horizon: 0.5, zenith: blue, nadir: [1, 0.5, 0]}\n"
        "lights: [{point: {position: [1, 6, 0]}}, {directional: {direction: [1, -1, 2]}}]\n"
        "objects:\n"
        "  - sphere: {center: [0.3, 4, 0.2], radius: 0.7, material: {color: gold}}\n"
        "  - sphere: {center: [-0.5, -3, 0.3], radius: 1, material: {color: red}}\n"
        "  - sphere: {center: [-1, 0.7, 2.2], radius: 0.8, material: {color: green, reflection: 0.4}}\n"
        "  - box: {min: [2, 0, -3], max: [4, 2, -1], material: {checker: {colors: [1, 0.3], size: 0.3}}}\n"
        "  - torus: {center: [-3, 1, -2], axis: [1, 0, 1], major: 1, minor: 0.3}\n"
        "  - disc: {center: [0, -1, 0], normal: [0, 1, 0], radius: 6}\n");
    const CertifyErrors errors =
        certify(&scene, has_double ? PRECISION_DOUBLE : PRECISION_STRICT, 1, PIXELS, NULL);
    assert_true(wrong_pixels(&errors) <= (has_double ? 0 : 2));
    assert_true(!has_double || errors.right_color < 1e-10);
}

// The reference knows the ambient light that is the mean of a sky's image.
TEST(skies_light_the_reference)
{
    OwnedScene scene =
        scene_of_text("sky.yaml", "camera: {position: [0, 0, 5], look_at: [0, 0, 0]}\n"
                                  "background: {image: scenes/images/globe.png, intensity: 0.7}\n"
                                  "lights: [{directional: {direction: [1, -1, 2]}}]\n"
                                  "objects: [{sphere: {center: [0, 0, 0], radius: 2}}]\n");
    assert_true(vector_largest(scene.ambient) > 0.1);
    const CertifyErrors errors = certify(&scene, PRECISION_STRICT, 1, PIXELS, NULL);
    assert_int_equal(errors.color, 0);
}

static void colors_compare(const Scene *scene, uint32_t scale)
{
    const size_t count = PIXELS * (size_t)scale * scale;
    const CertifyErrors single = certify(scene, PRECISION_SINGLE, scale, count, NULL),
                        certified = certify(scene, PRECISION_CERTIFIED, scale, count, NULL);
    assert_int_equal(single.color + certified.color, 0);
    assert_true(certified.right_color <= 2 * single.right_color);
}

// Colors at certified are as exact as at single, even at the edges of round shapes.
TEST(colors_of_certified_are_exact)
{
    if (!probe_has(PRECISION_DOUBLE)) skip();
    OwnedScene scene = scene_of_file("scenes/article.yaml");
    if (tests_are_long()) colors_compare(&scene, 6);
    scene.camera.look_at = (Vector3){-1.6947, 1.4227, 0.2414}; // the edge of the cone
    scene.camera.half_tangent /= 30;
    colors_compare(&scene, 1);
}

// A camera whose vectors rounding turns by a ten-thousandth, a blocker just before a light, and glass just
// above a floor. The reference starts from the vectors of double, and neither skips nor joins surfaces that
// are close to each other.
TEST(there_are_no_false_alarms)
{
    if (!probe_has(PRECISION_DOUBLE)) skip();
    OwnedScene scene = scene_of_text(
        "near.yaml",
        "camera: {position: [0.3, 2.1, -5], look_at: [1, 0.4, 0.7], up: [0.7, -1.7, 5.70000000005], fov: "
        "50}\n"
        "lights: [{point: {position: [1, 5, 0]}}, {point: {position: [-3, 4, -6]}}]\n"
        "materials:\n"
        "  tiles: {checker: {colors: [[1, 1, 1], [0.2, 0.2, 0.2]], size: 0.05}}\n"
        "  glass: {transmission: 0.8, ior: 1.1}\n"
        "objects:\n"
        "  - plane: {point: [0, 0, 0], normal: [0.1, 1, 0.2], material: tiles}\n"
        "  - disc: {center: [1, 4.999999999999, 0], normal: [0, 1, 0], radius: 1}\n"
        "  - disc: {center: [0, 1e-10, 0], normal: [0.1, 1, 0.2], radius: 2, material: glass}\n");
    for (int shifts = 0; shifts < 2; shifts++) {
        scene.camera.shift[1] = shifts;
        CertifyUncertified uncertified;
        const CertifyErrors errors = certify(&scene, PRECISION_CERTIFIED, 1, PIXELS, &uncertified);
        assert_int_equal(errors.violations + errors.unconfirmed + errors.contradicted, 0);
        assert_true(errors.compared > 6000 && uncertified.count < 600);
    }
}

TEST_MAIN(probe_open, probe_close)
