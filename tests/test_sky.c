// Tests the sky as a light. Its cells must have the light of its colors, and what hides them must cast a
// shadow.
#include "host/scene/sky.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

#define HEAD "camera: {position: [0, 0.5, 0], look_at: [0, 0, 0], up: [0, 0, -1], height: 1e-3}\n"

// Adds what a white surface reflects of a color from a direction, for the part of the sphere.
static void reflected_add(Color *sum, Color color, Vector3 direction, Vector3 normal, double solid_angle)
{
    const double facing = fmax(vector_dot(direction, normal), 0);
    *sum = vector_add(*sum, vector_scale(color, facing * solid_angle / M_PI));
}

// Returns the unit direction of a longitude in turns from -z towards +x, and of a latitude's sine.
static Vector3 direction_of(double longitude, double sine)
{
    const double across = sqrt(1 - sine * sine), angle = longitude * 2 * M_PI, x = across * sin(angle),
                 z = -across * cos(angle);
    return (Vector3){x, sine, z};
}

// Returns what a white surface reflects of the sky, by a fine grid of latitudes and longitudes.
static Color reflected_of(Color (*color_of)(Vector3 direction), Vector3 normal)
{
    enum { ROWS = 384, COLUMNS = 768 };
    Color sum = {0};
    for (int y = 0; y < ROWS; y++) {
        const double top = cos(M_PI * y / ROWS), bottom = cos(M_PI * (y + 1) / ROWS);
        for (int x = 0; x < COLUMNS; x++) {
            const Vector3 direction = direction_of((x + 0.5) / COLUMNS - 0.5, (top + bottom) / 2);
            reflected_add(&sum, color_of(direction), direction, normal, 2 * M_PI / COLUMNS * (top - bottom));
        }
    }
    return sum;
}

// Checks what a white surface reflects of the sky's cells, from points in each, as kernels do, that no cell
// has more light than the light's color, and that the mean of all has more than `evenness` of that.
static void check_cells(const Scene *scene, Color (*color_of)(Vector3 direction), Vector3 normal,
                        double evenness)
{
    enum { COUNT = SKY_CELL_ROWS * SKY_CELL_COLUMNS, SIDE = 16 };
    const Light *light = &scene->lights.items[scene->lights.count - 1];
    const Color expected = reflected_of(color_of, normal);
    Color sum = {0};
    double brightest = 0, total = 0; // of all cells, in parts of the light
    for (size_t i = 0; i < COUNT; i++) {
        const SkyCell *cell = &scene->sky.cells[i];
        const double longitudes = cell->longitude_end - cell->longitude_begin,
                     sines = cell->sine_end - cell->sine_begin;
        assert_true(longitudes >= 0 && sines >= 0);
        for (int point = 0; point < SIDE * SIDE; point++) {
            const int row = point / SIDE, column = point % SIDE;
            const double longitude = cell->longitude_begin + longitudes * (column + 0.5) / SIDE,
                         sine = cell->sine_begin + sines * (row + 0.5) / SIDE;
            const Vector3 direction = direction_of(longitude, sine);
            const Color color =
                vector_scale(color_of(direction), longitudes * sines * scene->sky.cell_factor);
            brightest = fmax(brightest, vector_largest(color));
            total += vector_largest(color) / COUNT / SIDE / SIDE;
            // 1 / COUNT of the samples, of a light whose color times the cosine is reflected
            reflected_add(&sum, vector_multiply(light->color, color), direction, normal,
                          M_PI / COUNT / SIDE / SIDE);
        }
    }

    assert_true(brightest <= 1 + 1e-7 && brightest > 0.95);
    assert_true(total > evenness);
    const double allowed = 4e-3 * vector_largest(expected);
    assert_near(sum.x, expected.x, allowed);
    assert_near(sum.y, expected.y, allowed);
    assert_near(sum.z, expected.z, allowed);
}

static Color gradient(Vector3 direction)
{
    const Color horizon = {0.5, 2, 0}, zenith = {3, 0.25, 1}, nadir = {0, 0.5, 0};
    const double height = direction.y;
    return vector_add(vector_scale(horizon, 1 - fabs(height)),
                      vector_scale(height > 0 ? zenith : nadir, fabs(height)));
}

TEST(colors_are_a_light)
{
    Scene scene = scene_of_text("s.yaml", HEAD "background: {horizon: [0.5, 2, 0], zenith: [3, 0.25, 1], "
                                               "nadir: [0, 0.5, 0], light: true}\n");
    assert_int_equal(scene.lights.count, 1);
    assert_true(vector_is_zero(scene.ambient));
    static const Vector3 normals[] = {{0, 1, 0}, {0, 0, 1}, {-0.8, 0.6, 0}, {0, -1, 0}};
    for (size_t i = 0; i < 4; i++)
        check_cells(&scene, gradient, normals[i], 0.9);
    scene_free(&scene);

    scene = scene_of_text("s.yaml", HEAD "ambient: 0.25\nbackground: {horizon: 0, zenith: 0, light: true}\n");
    assert_int_equal(scene.lights.count, 0);
    assert_number(scene.ambient.x, 0.25);
    scene_free(&scene);
}

enum { IMAGE_WIDTH = 24, IMAGE_HEIGHT = 12, SUN_COLUMN = 5, SUN_ROW = 3 };

// Returns a texel of an image in which one texel has nine tenths of the light.
static Color texel(int x, int y)
{
    if (x == SUN_COLUMN && y == SUN_ROW) return (Color){900, 500, 10};
    return (Color){0.1 * (x % 3), 0.02 * y, x < 7 ? 0.5 : 0};
}

static Color image_color(Vector3 direction)
{
    const double u = 0.5 + atan2(direction.x, -direction.z) / (2 * M_PI), v = acos(direction.y) / M_PI;
    return texel((int)(u * IMAGE_WIDTH) % IMAGE_WIDTH, (int)(v * IMAGE_HEIGHT));
}

TEST(an_image_is_a_light)
{
    float values[3 * IMAGE_WIDTH * IMAGE_HEIGHT];
    for (int i = 0; i < IMAGE_WIDTH * IMAGE_HEIGHT; i++) {
        const Color color = texel(i % IMAGE_WIDTH, i / IMAGE_WIDTH);
        values[3 * i] = (float)color.x;
        values[3 * i + 1] = (float)color.y;
        values[3 * i + 2] = (float)color.z;
    }
    SceneTexture texture = {
        .image = {.width = IMAGE_WIDTH, .height = IMAGE_HEIGHT, .channels = 3, .values = values}};
    Light lights[1];
    Scene scene = {.textures = {&texture, 1, 1},
                   .lights = {lights, 0, 1},
                   .sky = {.up = {0, 2, 0}, .texture = 1, .forward = {0, 0, -1}, .intensity = 1}};
    scene_add_sky_light(&scene);
    const Vector3 to_sun =
        direction_of((SUN_COLUMN + 0.5) / IMAGE_WIDTH - 0.5, cos((SUN_ROW + 0.5) / IMAGE_HEIGHT * M_PI));
    const Vector3 normals[] = {to_sun, {0, 1, 0}, {0, 0, 1}, vector_scale(to_sun, -1)};
    for (size_t i = 0; i < 4; i++)
        check_cells(&scene, image_color, normals[i], 0.3);
    free(scene.sky.cells);
}

// Below the middle of a disc that hides the sky within 45 degrees of the zenith, a white floor under a sky
// with the colors h and z reflects the integral of 2 c (h + (z - h) c) from c = 0 to the root of 1/2.
TEST(what_hides_the_sky_casts_a_shadow)
{
    OwnedScene scene =
        scene_of_text("s.yaml", HEAD "background: {horizon: [0.5, 1, 2], zenith: [2, 1, 0], light: true}\n"
                                     "objects:\n"
                                     "  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n"
                                     "  - disc: {center: [0, 1, 0], normal: [0, 1, 0], radius: 1}\n");
    RenderSettings settings = film_settings(2, 2, PRECISION_STRICT);
    settings.sample_count = 4096;
    OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
    const double c = sqrt(0.5), horizon[] = {0.5, 1, 2}, zenith[] = {2, 1, 0};
    for (size_t i = 0; i < 4; i++)
        for (size_t channel = 0; channel < 3; channel++) {
            const double h = horizon[channel], z = zenith[channel];
            const double expected = h * c * c + 2 * (z - h) * c * c * c / 3;
            assert_near((double)film.color[3 * i + channel], expected, 0.004);
        }
}

// A wall is lit by what the eye sees of the sky, whichever way the sky is turned.
TEST(what_is_seen_shines)
{
    enum { ROWS = 32, COLUMNS = 64 };
    static const char sky[] = "background: {sun: {elevation: 12, azimuth: 70, light: false}, turn: 37, up: "
                              "[0.3, 1, -0.2], light: true, ground: [0.1, 0.3, 0.2]}\n";
    char *text = text_format(
        "camera: {position: [0, 0, 0], look_at: [0, 0, -1], projection: equirectangular}\n%s", sky);
    Scene scene = scene_of_text("sky.yaml", text);
    RenderSettings settings = film_settings(COLUMNS, ROWS, PRECISION_STRICT);
    OwnedFilm seen = film_render(&probe_compute, &scene, &settings, AOV_RAY);
    scene_free(&scene);
    free(text);
    static const Vector3 normals[] = {{0, 1, 0}, {1, 0, 0}, {0, 0, -1}, {-0.6, 0, 0.8}};
    for (size_t i = 0; i < COUNT_OF(normals); i++) {
        const Vector3 n = normals[i];
        Color expected = {0};
        for (size_t pixel = 0; pixel < (size_t)ROWS * COLUMNS; pixel++) {
            const double *ray = seen.ray + 3 * pixel, *color = seen.color + 3 * pixel;
            const size_t y = pixel / COLUMNS;
            const double top = cos(M_PI * (double)y / ROWS), bottom = cos(M_PI * (double)(y + 1) / ROWS);
            reflected_add(&expected, (Color){color[0], color[1], color[2]}, (Vector3){ray[0], ray[1], ray[2]},
                          n, 2 * M_PI / COLUMNS * (top - bottom));
        }
        text = text_format("camera: {position: [%g, %g, %g], look_at: [0, 0, 0], up: [0.1, 0.2, 1], height: "
                           "1e-3}\n%sobjects:\n  - plane: {point: [0, 0, 0], normal: [%g, %g, %g]}\n",
                           n.x, n.y, n.z, sky, n.x, n.y, n.z);
        scene = scene_of_text("sky.yaml", text);
        settings = film_settings(1, 1, PRECISION_STRICT);
        settings.sample_count = 1024;
        OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
        const double allowed = 0.02 * vector_largest(expected);
        assert_near(film.color[0], expected.x, allowed);
        assert_near(film.color[1], expected.y, allowed);
        assert_near(film.color[2], expected.z, allowed);
        scene_free(&scene);
        free(text);
    }
}

TEST_MAIN(probe_open, probe_close)
