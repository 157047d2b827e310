// Tests settings that must not change any bit of an image: lanes, features built in without need, bands, the
// region, a second run. Also tests those that must change it in a known way: the scene's scale, and its
// mirror image.
//
// run_tests: sanitize-long-only
#include "host/compile/transform.h"
#include "host/import/load.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

// Neither is a whole number of tiles of any width.
enum { WIDTH = 71, HEIGHT = 41 };

static Scene every_shape, sampled;

static int variants_open(void **state)
{
    every_shape = scene_of_file("tests/scenes/every_shape.yaml");
    sampled = scene_of_file("tests/scenes/sampled.yaml");
    return probe_open(state);
}

static int variants_close(void **state)
{
    scene_free(&every_shape);
    scene_free(&sampled);
    return probe_close(state);
}

// Points of areas depend on the pixel, so that a mirrored image has others. Parallel rays need another
// camera.
#define SAMPLED_FEATURES                                                                                     \
    (FEATURE_AREA_LIGHTS | FEATURE_SKY_LIGHT | FEATURE_LENS | FEATURE_ORTHOGRAPHIC | FEATURE_EQUIRECTANGULAR)

// Renders with the settings' features unchanged.
static Film render(const Scene *scene, const RenderSettings *settings)
{
    return film_render(&probe_compute, scene, settings, 0);
}

static void same_and_freed(Film *film, const Film *expected, const char *what)
{
    film_assert_same(film, expected, what);
    film_free(film);
}

TEST(scene_has_every_feature)
{
    // test_textures has textures, which a mirror image would have to mirror, test_instances instances
    assert_int_equal(features_of(&every_shape) | FEATURE_BVH | FEATURE_EYE_POWERS | FEATURE_IMAGES |
                         FEATURE_CUTOUTS | FEATURE_NORMAL_MAPS | FEATURE_INSTANCES | SAMPLED_FEATURES,
                     FEATURE_ALL);
    assert_int_equal(features_of(&sampled) & SAMPLED_FEATURES,
                     FEATURE_AREA_LIGHTS | FEATURE_SKY_LIGHT | FEATURE_LENS);
}

// Short tests compare the AOVs, whose kernels take long to build, at one precision.
TEST(lanes_agree)
{
    const unsigned aovs = AOV_T | AOV_NORMAL | AOV_POSITION | AOV_OBJECT | AOV_SHADOW | AOV_RAY | AOV_PATH;
    const Precision from = probe_same_bits_from();
    for (Precision precision = from; precision <= PRECISION_STRICT; precision++) {
        RenderSettings settings = film_settings(WIDTH, HEIGHT, precision);
        const unsigned compared = precision == from || tests_are_long() ? aovs : 0;
        settings.lanes = 1;
        OwnedFilm expected = film_render(&probe_compute, &every_shape, &settings, compared);
        assert_int_equal(film_count_faulty(&expected), 0);
        for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
            if (*lanes == 1) continue;
            settings.lanes = *lanes;
            OwnedFilm film = film_render(&probe_compute, &every_shape, &settings, compared);
            assert_int_equal(film_count_faulty(&film), 0);
            film_assert_same(&film, &expected, formatted("%s, %u lanes", precision_names[precision], *lanes));
        }
    }
}

#define SCENE_HEAD                                                                                           \
    "camera: {position: [0.3, 1.4, -5], look_at: [0, 0.4, 0], fov: 40}\n"                                    \
    "background: [0.1, 0.2, 0.4]\nambient: [0.5, 0.5, 0.5]\n"
#define SPHERE "objects: [{sphere: {center: [0.2, 0.5, 0], radius: 1}}]\n"
#define BALL(material, others)                                                                               \
    "objects: [{sphere: {center: [0.2, 0.5, 0], radius: 1, material: {" material "}}}" others "]\n"
#define BEFORE ", {sphere: {center: [-0.9, 0.2, -2], radius: 0.5}}"
#define BEHIND ", {sphere: {center: [0.9, 0.2, 2], radius: 0.5}}"

enum { LONG_SCENES = 5 }; // the last ones

// For each feature a scene that needs it and as little else as can be.
static const struct {
    FeatureSet features;
    const char *text;
} feature_scenes[] = {
    {0, SCENE_HEAD},
    {FEATURE_SPHERES, SCENE_HEAD SPHERE},
    {FEATURE_PLANES, SCENE_HEAD "objects: [{plane: {point: [0, 0, 0], normal: [0.1, 1, 0]}}]\n"},
    {FEATURE_DISCS, SCENE_HEAD "objects: [{disc: {center: [0, 1, 0], normal: [0.2, 0.4, -1], radius: 1}}]\n"},
    {FEATURE_BOXES, SCENE_HEAD "objects: [{box: {min: [-1, 0, -0.5], max: [0.5, 1, 1]}}]\n"},
    {FEATURE_CYLINDERS,
     SCENE_HEAD "objects: [{cylinder: {from: [-1, 0, 0], to: [1, 1, 0.3], radius: 0.4}}]\n"},
    {FEATURE_CONES,
     SCENE_HEAD "objects: [{cone: {from: [-1, 0, 0], to: [1, 1, 0.3], radius: [0.7, 0.1]}}]\n"},
    {FEATURE_TRIANGLES,
     SCENE_HEAD "objects: [{triangle: {vertices: [[-1, 0, 0], [1, 0.2, 0], [0, 1.5, 0.4]]}}]\n"},
    {FEATURE_TRIANGLES | FEATURE_SMOOTH_NORMALS | FEATURE_DIRECTIONAL_LIGHTS,
     SCENE_HEAD "lights: [{directional: {direction: [2, -1, 0.6]}}]\n"
                "objects: [{triangle: {vertices: [[-1, 0, 0], [1, 0.2, 0], [0, 1.5, 0.4]],\n"
                "  normals: [[-1, -0.5, -1], [1, -0.5, -1], [0, 1, -1]]}}]\n"},
    {FEATURE_TORI,
     SCENE_HEAD "objects: [{torus: {center: [0, 0.5, 0], axis: [0.3, 1, 0.2], major: 1, minor: 0.4}}]\n"},
    {FEATURE_PARABOLOIDS, SCENE_HEAD
     "objects: [{paraboloid: {apex: [0, 0, 0], axis: [0.3, 1, -0.2], radius: 0.8, height: 1.2}}]\n"},
    {FEATURE_SUPERELLIPSOIDS,
     SCENE_HEAD "objects: [{superellipsoid: {center: [0.2, 0.5, 0], radii: [0.6, 1.2, 1], exponent: 6}}]\n"},
    {FEATURE_SPHERES | FEATURE_OVALS, SCENE_HEAD
     "objects: [{sphere: {center: [0.2, 0.5, 0], radius: 1, transform: {scale: [0.6, 1.2, 1]}}}]\n"},
    {FEATURE_TORI | FEATURE_OVALS, SCENE_HEAD
     "objects: [{torus: {center: [0, 0.5, 0], axis: [0.3, 1, 0.2], major: 1, minor: 0.4, transform: {scale: "
     "[0.6, 1.2, 1]}}}]\n"},
    {FEATURE_SPHERES | FEATURE_REFLECTION, SCENE_HEAD BALL("reflection: 0.5", BEFORE)},
    {FEATURE_SPHERES | FEATURE_TRANSMISSION, SCENE_HEAD BALL("transmission: 0.9", BEHIND)},
    {FEATURE_SPHERES | FEATURE_REFLECTION | FEATURE_TINTS,
     SCENE_HEAD BALL("reflection: [0.9, 0.5, 0]", BEFORE)},
    {FEATURE_SPHERES | FEATURE_EMISSION, SCENE_HEAD BALL("emission: [0.9, 3, 0]", "")},
    {FEATURE_SPHERES | FEATURE_TRANSMISSION | FEATURE_FRESNEL,
     SCENE_HEAD BALL("transmission: 0.9, fresnel: true", BEHIND)},
    {FEATURE_SPHERES | FEATURE_TRANSMISSION | FEATURE_TINTS | FEATURE_FILTERS | FEATURE_DIRECTIONAL_LIGHTS,
     SCENE_HEAD
     "lights: [{directional: {direction: [0, -1, 1]}}]\n"
     "objects: [{sphere: {center: [0.2, 0.5, 0], radius: 1, material: {transmission: [0, 0.9, 0.4]}}},\n"
     "  {sphere: {center: [-0.4, 1.8, -1], radius: 0.3, material: {transmission: [0.8, 0, 0.4]}}},\n"
     "  {sphere: {center: [0.9, 0.2, 2], radius: 0.5}}]\n"},
    {FEATURE_SPHERES | FEATURE_REFLECTION | FEATURE_TINTS | FEATURE_CONDUCTORS,
     SCENE_HEAD BALL("conductor: gold", BEFORE)},
    {FEATURE_SPHERES | FEATURE_TRANSMISSION | FEATURE_TINTS | FEATURE_ABSORPTION,
     SCENE_HEAD BALL("transmission: 0.9, absorption: {color: [0.1, 0.9, 0]}", BEHIND)},
    {FEATURE_SPHERES | FEATURE_POINT_LIGHTS, SCENE_HEAD "lights: [{point: {position: [2, 3, -4]}}]\n" SPHERE},
    {FEATURE_SPHERES | FEATURE_POINT_LIGHTS | FEATURE_FADING_LIGHTS,
     SCENE_HEAD "lights: [{point: {position: [2, 3, -4], intensity: 20, falloff: inverse_square}}]\n" SPHERE},
    {FEATURE_SPHERES | FEATURE_DIRECTIONAL_LIGHTS,
     SCENE_HEAD "lights: [{directional: {direction: [1, -1, 2]}}]\n" SPHERE},
    {FEATURE_SPHERES | FEATURE_SPOT_LIGHTS, SCENE_HEAD
     "lights: [{spot: {position: [2, 3, -4], look_at: [0, 0.5, 0], angle: 12, penumbra: 5}}]\n" SPHERE},
    {FEATURE_SPHERES | FEATURE_POINT_LIGHTS | FEATURE_AREA_LIGHTS,
     SCENE_HEAD "lights: [{sphere: {center: [2, 3, -4], radius: 0.5}}]\n" SPHERE},
    {FEATURE_SPHERES | FEATURE_DIRECTIONAL_LIGHTS | FEATURE_AREA_LIGHTS,
     SCENE_HEAD "lights: [{directional: {direction: [1, -1, 2], angle: 5}}]\n" SPHERE},
    {FEATURE_SPHERES | FEATURE_LENS, "camera: {position: [0.3, 1.4, -5], look_at: [0, 0.4, 0], aperture: "
                                     "0.4, focus: 4}\nambient: 0.5\n" SPHERE},
    {FEATURE_SPHERES | FEATURE_ORTHOGRAPHIC,
     "camera: {position: [0.3, 1.4, -5], look_at: [0, 0.4, 0], height: 4}\nambient: 0.5\n" SPHERE},
    {FEATURE_SPHERES | FEATURE_EQUIRECTANGULAR, "camera: {position: [0.3, 1.4, -5], look_at: [0, 0.4, 0], "
                                                "projection: equirectangular}\nambient: 0.5\n" SPHERE},
    {FEATURE_SKY, "camera: {position: [0.3, 1.4, -5], look_at: [0, 0.4, 0]}\n"
                  "background: {horizon: 1, zenith: [0, 0, 1], up: [0.1, 1, 0]}\n"},
    {FEATURE_SPHERES | FEATURE_SKY | FEATURE_DIRECTIONAL_LIGHTS | FEATURE_AREA_LIGHTS | FEATURE_SKY_LIGHT,
     "camera: {position: [0.3, 1.4, -5], look_at: [0, 0.4, 0]}\n"
     "background: {horizon: 1, zenith: [0, 0, 1], light: true}\n" SPHERE},
    {FEATURE_SKY | FEATURE_IMAGES, "camera: {position: [0.3, 1.4, -5], look_at: [0, 0.4, 0]}\n"
                                   "background: {image: scenes/images/globe.png}\n"},
    {FEATURE_SPHERES | FEATURE_CHECKERS,
     SCENE_HEAD BALL("checker: {colors: [[1, 1, 1], [0, 0, 0]], size: 0.3}", "")},
    {FEATURE_SPHERES | FEATURE_IMAGES, SCENE_HEAD BALL("image: scenes/images/globe.png", "")},
    {FEATURE_TRIANGLES | FEATURE_IMAGES, SCENE_HEAD "objects: [{mesh: {file: tests/textures/quad.obj,\n"
                                                    "  material: {image: scenes/images/globe.png}}}]\n"},
    {FEATURE_TRIANGLES | FEATURE_IMAGES | FEATURE_CUTOUTS | FEATURE_DIRECTIONAL_LIGHTS, SCENE_HEAD
     "lights: [{directional: {direction: [0.2, -0.1, 1]}}]\n"
     "materials: {leaf: {image: tests/textures/leaf.png, cutout: 0.5}}\n"
     "objects: [{mesh: {file: tests/textures/quad.obj, material: leaf}},\n"
     "  {mesh: {file: tests/textures/quad.obj, material: leaf, transform: {translate: [0.5, 0, 1]}}}]\n"},
    {FEATURE_SPHERES | FEATURE_IMAGES | FEATURE_CUTOUTS,
     SCENE_HEAD BALL("image: tests/textures/leaf.png, cutout: 0.5", "")},
    {FEATURE_SPHERES | FEATURE_IMAGES | FEATURE_NORMAL_MAPS | FEATURE_REFLECTION | FEATURE_DIRECTIONAL_LIGHTS,
     SCENE_HEAD "lights: [{directional: {direction: [2, -1, 0.6]}}]\n" BALL(
         "normal_map: scenes/images/globe.png, reflection: 0.5", "")},
    // where tests are long
    {FEATURE_POINT_LIGHTS, SCENE_HEAD "lights: [{point: {position: [2, 3, -4]}}]\n"},
    {FEATURE_DIRECTIONAL_LIGHTS, SCENE_HEAD "lights: [{directional: {direction: [1, -1, 2]}}]\n"},
    {FEATURE_SPOT_LIGHTS,
     SCENE_HEAD "lights: [{spot: {position: [2, 3, -4], look_at: [0, 0, 0], angle: 20}}]\n"},
    {FEATURE_PLANES | FEATURE_CHECKERS,
     SCENE_HEAD "objects: [{plane: {point: [0, 0, 0], normal: [0.1, 1, 0],\n"
                "  material: {checker: {colors: [[1, 1, 1], [0, 0, 0]], size: 0.3}}}}]\n"},
    {FEATURE_PLANES | FEATURE_IMAGES,
     SCENE_HEAD "objects: [{plane: {point: [0, 0, 0], normal: [0.1, 1, 0],\n"
                "  material: {image: scenes/images/globe.png, size: 0.7}}}]\n"},
};

enum { GROUP_SCENES = 5 };

static size_t group_of(size_t scene)
{
    return (scene + GROUP_SCENES - 1) / GROUP_SCENES;
}

// Returns the features of the scene's group. The first scene, which has none, is a group by itself.
static FeatureSet features_of_group(size_t scene)
{
    FeatureSet features = 0;
    for (size_t i = 0; i < COUNT_OF(feature_scenes) - LONG_SCENES; i++)
        if (group_of(i) == group_of(scene)) features |= feature_scenes[i].features;
    return features;
}

// Compares builds for a scene's features alone with the one build for all. Short tests build for five scenes
// at once, so that most features are left out of six builds of seven.
TEST(features_alone_and_all_together_agree)
{
    FeatureSet seen = 0;
    RenderSettings settings = film_settings(WIDTH, HEIGHT, probe_same_bits_from());
    const size_t count = COUNT_OF(feature_scenes);
    for (size_t i = 0; i < count - (tests_are_long() ? 0 : LONG_SCENES); i++) {
        OwnedScene scene = scene_of_text("feature.yaml", feature_scenes[i].text);
        assert_int_equal(features_of(&scene), feature_scenes[i].features);
        seen |= feature_scenes[i].features;

        settings.extra_features = tests_are_long() ? 0 : features_of_group(i);
        Film specialised = render(&scene, &settings);
        settings.extra_features = FEATURE_ALL;
        OwnedFilm general = render(&scene, &settings);
        same_and_freed(&specialised, &general, feature_scenes[i].text);
    }
    // these depend on numbers and settings, and have separate tests
    assert_int_equal(seen | FEATURE_BVH | FEATURE_EYE_POWERS | FEATURE_INSTANCES, FEATURE_ALL);

    // No scene needs only checkers, so they are built in without need, on an empty scene.
    OwnedScene empty = scene_of_text("feature.yaml", SCENE_HEAD);
    settings.extra_features = FEATURE_CHECKERS;
    Film checkers = render(&empty, &settings);
    settings.extra_features = FEATURE_ALL;
    OwnedFilm general = render(&empty, &settings);
    same_and_freed(&checkers, &general, "checkers alone");
}

// With bands as short as they can be, each sample of a pixel has a separate launch.
TEST(launches_of_samples_agree)
{
    RenderSettings settings = film_settings(WIDTH, HEIGHT, probe_same_bits_from());
    OwnedFilm one = render(&every_shape, &settings);
    settings.sample_count = 5;
    settings.band_seconds = 100;
    OwnedFilm expected = render(&every_shape, &settings);
    settings.band_seconds = 1e-9;
    Film apart = render(&every_shape, &settings);
    same_and_freed(&apart, &expected, "5 samples in launches apart");
    settings.band_rows = 7;
    settings.lanes = 1;
    Film scalar = render(&every_shape, &settings);
    same_and_freed(&scalar, &expected, "5 samples, bands of 7 rows, 1 lane");

    // The samples do something, and no more than soften edges.
    double difference = 0;
    for (size_t i = 0; i < (size_t)3 * WIDTH * HEIGHT; i++)
        difference += fabs(one.color[i] - expected.color[i]) / (3 * WIDTH * HEIGHT);
    assert_true(difference > 1e-4 && difference < 0.1);
}

TEST(regions_are_cuts_of_the_whole)
{
    static const uint32_t regions[][4] = {
        {0, 0, 1, 1},      {WIDTH - 1, HEIGHT - 1, 1, 1}, {3, 5, 37, 19}, {WIDTH - 18, 0, 18, HEIGHT},
        {0, 13, WIDTH, 1},
    };
    RenderSettings settings = film_settings(WIDTH, HEIGHT, probe_same_bits_from());
    OwnedFilm whole = render(&every_shape, &settings);
    for (size_t i = 0; i < COUNT_OF(regions); i++) {
        const uint32_t *r = regions[i];
        settings.region_x = r[0];
        settings.region_y = r[1];
        settings.region_width = r[2];
        settings.region_height = r[3];
        Film part = render(&every_shape, &settings), expected = film_cut(&whole, r[0], r[1], r[2], r[3]);
        same_and_freed(&part, &expected, formatted("region %u,%u,%u,%u", r[0], r[1], r[2], r[3]));
        film_free(&expected);
    }
}

// A shifted frame shows a part of a larger frame around the view. The numbers are exact.
TEST(shifted_frames_are_cuts_of_a_larger_one)
{
    enum { SIDE = 32 };
    Scene scene = every_shape;
    scene.camera = (Camera){.position = {0.5, 3, -10}, .look_at = {0.5, 3, 1}, .up = {0, 1, 0}};
    RenderSettings settings = film_settings(2 * SIDE, 2 * SIDE, probe_same_bits_from());
    for (int i = 0; i < 2; i++) {
        scene.camera.projection = i == 1 ? PROJECTION_ORTHOGRAPHIC : PROJECTION_PERSPECTIVE;
        scene.camera.half_tangent = i == 1 ? 4 : 0.5;
        settings.width = settings.height = settings.region_width = settings.region_height = 2 * SIDE;
        OwnedFilm whole = render(&scene, &settings), expected = film_cut(&whole, SIDE, 0, SIDE, SIDE);
        scene.camera.half_tangent /= 2;
        scene.camera.shift[0] = scene.camera.shift[1] = 0.5;
        settings.width = settings.height = settings.region_width = settings.region_height = SIDE;
        Film shifted = render(&scene, &settings);
        same_and_freed(&shifted, &expected, i == 1 ? "shift of parallel rays" : "shift");
        scene.camera.shift[0] = scene.camera.shift[1] = 0;
    }
}

static void check_sampled(const Scene *scene)
{
    RenderSettings settings = film_settings(WIDTH, HEIGHT, probe_same_bits_from());
    settings.sample_count = 3;
    settings.lanes = 1;
    OwnedFilm expected = render(scene, &settings);
    assert_int_equal(film_count_faulty(&expected), 0);
    for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
        if (*lanes == 1) continue;
        settings.lanes = *lanes;
        Film film = render(scene, &settings);
        same_and_freed(&film, &expected, "lanes");
    }
    Scene large = scene_scaled(scene, 0x1p20);
    Film grown = render(&large, &settings);
    same_and_freed(&grown, &expected, "scaled");
    scene_scaled_free(&large);
    settings.band_rows = 7;
    settings.band_seconds = 1e-9;
    Film apart = render(scene, &settings);
    same_and_freed(&apart, &expected, "launches of samples");
    settings.region_x = 13;
    settings.region_y = 5;
    settings.region_width = 31;
    settings.region_height = 21;
    Film part = render(scene, &settings), cut = film_cut(&expected, 13, 5, 31, 21);
    same_and_freed(&part, &cut, "region");
    film_free(&cut);
}

// The points of areas are those of the pixel and the sample, wherever and whenever they are computed.
TEST(points_of_areas_agree)
{
    check_sampled(&sampled);
    Scene parallel = sampled;
    parallel.camera.projection = PROJECTION_ORTHOGRAPHIC;
    parallel.camera.half_tangent = 3;
    check_sampled(&parallel);
}

// Packets of a panorama are not part of a plane, and culls must not assume that they are.
TEST(panoramas_agree)
{
    Scene panorama = every_shape;
    panorama.camera.projection = PROJECTION_EQUIRECTANGULAR;
    panorama.camera.field_axis = FIELD_HORIZONTAL;
    panorama.camera.half_tangent = M_PI;
    panorama.camera.position = (Vector3){0.3, 1.7, 0.4};
    check_sampled(&panorama);
    RenderSettings settings = film_settings(WIDTH, HEIGHT, probe_same_bits_from());
    settings.bvh = BVH_OFF;
    OwnedFilm expected = render(&panorama, &settings);
    for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
        settings.lanes = *lanes;
        settings.bvh = BVH_ON;
        Film film = render(&panorama, &settings);
        same_and_freed(&film, &expected, "panorama with a BVH");
    }
}

// Hard case R7 (docs/verify.md).
TEST(mirror_gives_the_mirrored_image)
{
    Scene mirrored = scene_of_file("tests/scenes/every_shape.yaml"), seen = every_shape;
    scene_mirror(&mirrored);
    for (Precision precision = probe_same_bits_from(); precision <= PRECISION_STRICT; precision++) {
        for (uint32_t width = WIDTH; width <= WIDTH + 1; width++) {
            seen.camera.projection = mirrored.camera.projection =
                width > WIDTH ? PROJECTION_EQUIRECTANGULAR : PROJECTION_PERSPECTIVE;
            RenderSettings settings = film_settings(width, HEIGHT, precision);
            OwnedFilm film = render(&seen, &settings), flipped = film_flipped(&film);
            Film mirror = render(&mirrored, &settings);
            same_and_freed(&mirror, &flipped,
                           formatted("%s, mirrored, %u wide", precision_names[settings.precision], width));
        }
    }
    scene_free(&mirrored);
}

// On a GPU, kernels with features that their scene does not need keep functions out of line.
TEST(functions_stay_out_of_line)
{
    const Device *device = probe_compute.device;
    Device gpu = *device;
    gpu.type = CL_DEVICE_TYPE_GPU;
    probe_compute.device = &gpu;
    RenderSettings settings = settings_of_image(WIDTH, HEIGHT, PRECISION_SINGLE);
    settings.lanes = 1;
    for (int i = 0; i < 2; i++) {
        settings.extra_features = i == 0 ? 0 : FEATURE_ALL;
        Renderer *renderer = probe_renderer(&sampled, &settings);
        OWNED char *text = renderer_kernel_text(renderer);
        assert_non_null(strstr(text, i == 0 ? "#define IS_OUT_OF_LINE 0" : "#define IS_OUT_OF_LINE 1"));
        renderer_close(renderer);
    }
    probe_compute.device = device;
}

TEST_MAIN(variants_open, variants_close)
