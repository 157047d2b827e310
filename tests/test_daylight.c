// Tests the sun's place, its color, the sky's image, and the scene that has them.
#include "host/base/hash.h"
#include "host/scene/daylight.h"
#include "host/scene/portable.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

TEST(days)
{
    assert_true(days_from_epoch(2000, 1, 1) == -0.5);
    // Meeus, Astronomical algorithms, 1998, chapter 7: Julian days of examples
    assert_true(days_from_epoch(1957, 10, 4) == 2436115.5 - 2451545);
    assert_true(days_from_epoch(1988, 1, 27) == 2447187.5 - 2451545);
    assert_true(days_from_epoch(1600, 12, 31) == 2305812.5 - 2451545);
    assert_true(days_from_epoch(2024, 3, 1) - days_from_epoch(2024, 2, 28) == 2);
}

static void check_sun(double latitude, double longitude, double days, double elevation, double azimuth)
{
    const SunPosition sun = sun_position(latitude, longitude, days);
    assert_near(sun.elevation, elevation, 0.03);
    assert_near(fmod(sun.azimuth + 360, 360), azimuth, 0.03);
}

// Published places of the sun, with refraction.
TEST(positions_of_the_sun)
{
    // Reda, Andreas, Solar position algorithm for solar radiation applications, NREL/TP-560-34302, 2008, A.5
    const double reda = days_from_epoch(2003, 10, 17) + (19 + 30.5 / 60) / 24;
    check_sun(39.742476, -105.1786, reda, 90 - 50.11162, 194.34024);
    // NREL, SOLPOS 2.0, 2000, the results of its test program
    const double solpos = days_from_epoch(1999, 7, 22) + (14 + 45 / 60.0 + 37 / 3600.0) / 24;
    check_sun(33.65, -84.43, solpos, 48.409931, 97.032875);
    // the equinox of 2026-03-20 14:46 (USNO) at the pole: refraction lifts the sun by 29' (Meeus, chapter 16)
    const SunPosition pole = sun_position(90, 0, days_from_epoch(2026, 3, 20) + (14 + 46 / 60.0) / 24);
    assert_near(pole.elevation, 29 / 60.0, 0.03);
}

TEST(exponential)
{
    for (int i = -2000; i <= 2000; i++) {
        const double value = i * 0.35;
        const long double exact = expl((long double)value);
        assert_true(fabsl((long double)portable_exponential(value) / exact - 1) < 0x1p-50L);
    }
    assert_true(portable_exponential(0) == 1 && portable_exponential(-1e9) == 0);
}

TEST(colors_of_the_sun)
{
    Color before = sun_color(90, 3);
    assert_true(vector_largest(before) > 1 && vector_largest(before) < 1.3);
    for (int elevation = 89; elevation >= 0; elevation--) {
        const Color color = sun_color(elevation, 3);
        assert_true(color.x < before.x && color.x > color.y && color.y > color.z && color.z >= 0);
        assert_true(color.x / color.y > before.x / before.y); // redder
        before = color;
    }
    assert_true(before.x < 1e-3);
    assert_true(vector_is_zero(sun_color(-0.3, 3)) && vector_is_zero(sun_color(-90, 10)));
    assert_true(sun_color(30, 6).x < sun_color(30, 2).x);
}

static const float *texel_at(const Image *image, uint32_t x, uint32_t y)
{
    return image->values + 3 * ((size_t)y * image->width + x);
}

TEST(sky)
{
    uint64_t hash = HASH_START;
    static const double elevations[] = {90, 20, 3, -6};
    for (int turbidity = (int)TURBIDITY_MIN; turbidity <= (int)TURBIDITY_MAX; turbidity += 8)
        for (size_t i = 0; i < 4; i++) {
            OwnedImage image = daylight_image(elevations[i], turbidity, (Color){0.1, 0.2, 0.3});
            const size_t count = 3 * (size_t)image.width * image.height;
            for (size_t k = 0; k < count; k++)
                assert_true(image.values[k] >= 0 && image.values[k] < 10);
            for (uint32_t y = 0; y < image.height; y++)
                for (uint32_t x = 0; x < image.width; x++)
                    assert_memory_equal(texel_at(&image, x, y), texel_at(&image, image.width - 1 - x, y),
                                        3 * sizeof(float));
            hash = hash_bytes(hash, image.values, count * sizeof(float));
        }
    // All systems must have the same bits. Where a change is meant, the test prints the new number.
    if (hash != UINT64_C(0x3219593998230211))
        fail_msg("the images' hash is 0x%016llx", (unsigned long long)hash);
}

static void check_texel(const Image *image, uint32_t x, uint32_t y, double red, double green, double blue)
{
    const float *texel = texel_at(image, x, y);
    assert_near((double)texel[0], red, 2e-6);
    assert_near((double)texel[1], green, 2e-6);
    assert_near((double)texel[2], blue, 2e-6);
}

// Expected is what the model's formulas give in numpy.
TEST(sky_values)
{
    OwnedImage noon = daylight_image(60, 4.5, vector_all(0)), evening = daylight_image(3, 4.5, vector_all(0));
    check_texel(&noon, 255, 0, 0.369279, 0.532920, 0.907717);
    check_texel(&noon, 300, 60, 0.546172, 0.690949, 1.037275);
    check_texel(&evening, 256, 127, 0.601355, 0.340054, 0.035432);
    check_texel(&evening, 10, 100, 0.068967, 0.068715, 0.056575);
}

// The brightest texel above the horizon is the sun's, or the one next to it.
TEST(sky_is_brightest_at_the_sun)
{
    static const double elevations[] = {60, 20, 3};
    for (size_t i = 0; i < 3; i++) {
        OwnedImage image = daylight_image(elevations[i], 3, vector_all(0));
        uint32_t x_best = 0, y_best = 0;
        for (uint32_t y = 0; y < image.height; y++)
            for (uint32_t x = 0; x < image.width; x++)
                if (texel_at(&image, x, y)[1] > texel_at(&image, x_best, y_best)[1]) x_best = x, y_best = y;
        assert_int_equal(x_best, image.width / 2 - 1); // the first of two that mirror each other
        assert_near(90 - (y_best + 0.5) * 180 / image.height, elevations[i], 0.71);
    }
}

static double redness(double elevation, uint32_t degrees)
{
    OwnedImage image = daylight_image(elevation, 3, vector_all(0));
    const float *texel = texel_at(&image, image.width / 2, (90 - degrees) * image.height / 180 - 1);
    const double red = (double)(texel[0] / texel[2]);
    return red;
}

TEST(sky_colors)
{
    assert_true(redness(3, 1) > 3 && redness(3, 1) > 2 * redness(20, 1) && redness(20, 1) > redness(60, 1));
    assert_true(redness(60, 45) < 0.8); // blue at noon
    // a sun that sets and dusk are continuous, and night is dark
    OwnedImage set = daylight_image(0, 3, vector_all(0.2)), dusk = daylight_image(-0.001, 3, vector_all(0.2)),
               night = daylight_image(-18, 3, vector_all(0.2));
    for (size_t i = 0; i < 3 * (size_t)set.width * set.height; i++) {
        assert_near((double)dusk.values[i], (double)set.values[i], 0.002);
        assert_true(night.values[i] < 1e-6F);
    }
}

static Scene scene_of_background(const char *background)
{
    Scene scene = scene_of_text(
        "s.yaml",
        formatted("camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\nbackground: %s\n", background));
    return scene;
}

// The values in the file reach the light, the image and the ambient light.
TEST(scene)
{
    Scene scene = scene_of_background("{sun: {elevation: 30, azimuth: 90}, intensity: 2, turbidity: 5}");
    assert_int_equal(scene.lights.count, 1);
    const Color color = vector_scale(sun_color(30, 5), 2);
    assert_vector(scene.lights.items[0].color, color.x, color.y, color.z);
    const double across = sqrt(3) / 2;
    assert_vector(scene.lights.items[0].direction, -across, -0.5, 0); // it is in the east
    assert_vector(scene.sky.forward, 1, 0, 0);
    assert_int_equal(scene.lights.items[0].area.type, AREA_NONE);
    OwnedImage image = daylight_image(30, 5, vector_all(0.2));
    assert_memory_equal(scene.textures.items[scene.sky.texture - 1].image.values, image.values,
                        3 * sizeof(float) * image.width * image.height);
    assert_true(scene.ambient.z > scene.ambient.x && scene.ambient.x > 0.2 && scene.ambient.z < 1);
    scene_free(&scene);

    scene = scene_of_background("{sun: {elevation: 30, azimuth: 90, angle: 0.53}, turn: 90, up: [0, 0, 2]}");
    assert_vector(scene.lights.items[0].direction, across, 0, -0.5); // north is -x, turned to -y
    assert_int_equal(scene.lights.items[0].area.type, AREA_ELLIPSE);
    scene_free(&scene);

    scene = scene_of_background("{sun: {elevation: 30, azimuth: 90, light: false}}\nambient: 0.25");
    assert_int_equal(scene.lights.count, 0);
    assert_number(scene.ambient.x, 0.25);
    scene_free(&scene);

    scene = scene_of_background(
        "{sun: {latitude: 39.742476, longitude: -105.1786, date: 2003-10-17, hour: 19.508333333}}");
    const double elevation = (90 - 50.11162) * M_PI / 180, azimuth = 194.34024 * M_PI / 180;
    const Vector3 to_sun = {cos(elevation) * sin(azimuth), sin(elevation), -cos(elevation) * cos(azimuth)};
    assert_true(vector_length(vector_add(scene.lights.items[0].direction, to_sun)) < 0.001);
    scene_free(&scene);
    scene = scene_of_background("{sun: {latitude: 0, longitude: 0, date: 2024-02-29, hour: -12}}");
    scene_free(&scene);
}

// Seen from above, with north at the top, the shadow of a post points away from the sun.
TEST(shadow)
{
    OwnedScene scene = scene_of_text(
        "post.yaml", "camera: {position: [0, 40, 0], look_at: [0, 0, 0], up: [0, 0, -1], fov: 12}\n"
                     "background: {sun: {elevation: 30, azimuth: 60}}\n"
                     "objects:\n"
                     "  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n"
                     "  - cylinder: {from: [0, 0, 0], to: [0, 2, 0], radius: 0.1}\n");
    const RenderSettings settings = film_settings(64, 64, PRECISION_STRICT);
    OwnedFilm film = film_render(&probe_compute, &scene, &settings, AOV_OBJECT | AOV_SHADOW);
    double east = 0, north = 0;
    size_t count = 0;
    for (size_t y = 0; y < 64; y++)
        for (size_t x = 0; x < 64; x++) {
            if (film.object[64 * y + x] != 0 || film.shadow[64 * y + x] == 0) continue;
            east += (double)x - 31.5;
            north += 31.5 - (double)y;
            count++;
        }
    assert_true(count > 20);
    assert_near(atan2(-east, -north) * 180 / M_PI, 60, 2);
}

TEST_MAIN(probe_open, probe_close)
