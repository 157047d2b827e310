// Tests where textures lie on surfaces and how they are filtered, in closed form or against double here,
// that bits are the same at every width, and the messages for textures that cannot be used.
#include "host/image/image.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"
#include <turbojpeg.h>

static char *folder;
static char texture_path[64];

static int textures_open(void **state)
{
    folder = folder_make();
    snprintf(texture_path, sizeof texture_path, "%s/texture.npy", folder);
    return probe_open(state);
}

static int textures_close(void **state)
{
    folder_remove(folder);
    return probe_close(state);
}

typedef struct {
    uint32_t width, height;
    float colors[64][3]; // rows from the top
} TestTexture;

// Returns a texture whose texels all have different colors, in eighths.
static TestTexture texture_make(uint32_t width, uint32_t height)
{
    TestTexture texture = {width, height, {{0}}};
    for (uint32_t i = 0; i < width * height; i++) {
        texture.colors[i][0] = (float)(i * 5 % 8) / 8;
        texture.colors[i][1] = (float)(i % 8) / 8;
        texture.colors[i][2] = (float)(i / 8 % 8) / 8;
    }
    return texture;
}

static void texture_write(const TestTexture *texture)
{
    const ImageHeader header = {.format = IMAGE_NPY,
                                .width = texture->width,
                                .height = texture->height,
                                .channels = 3,
                                .npy_type = 'f'};
    MessageList messages = {0};
    ImageWriter *writer = image_writer_open(texture_path, &header, &messages);
    assert_non_null(writer);
    assert_true(image_writer_rows(writer, texture->colors, texture->height, &messages));
    assert_true(image_writer_commit(writer, &messages));
}

// Returns a scene that shows colors as they are, with one object whose material has the texture.
static const char *scene_text(const char *camera, const char *object)
{
    return formatted("camera: {%s}\nambient: [1, 1, 1]\nmaterials: {texture: {image: %s, size: 2}}\n"
                     "objects: [{%s material: texture}}]\n",
                     camera, texture_path, object);
}

static Scene scene_make(const char *camera, const char *object)
{
    return scene_of_text("s.yaml", scene_text(camera, object));
}

// Checks the color along the camera's axis by one ray.
static void check_seen(const char *camera, const char *object, double red, double green, double blue)
{
    OwnedScene scene = scene_make(camera, object);
    RenderSettings settings = film_settings(1, 1, PRECISION_STRICT);
    OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
    const double expected[3] = {red, green, blue};
    for (size_t i = 0; i < 3; i++)
        if (!(fabs(film.color[i] - expected[i]) < 2e-7))
            fail_msg("%s: channel %zu is %.9g, not %.9g", camera, i, film.color[i], expected[i]);
}

#define BALL          "sphere: {center: [0, 0, 0], radius: 1,"
#define WALL          "plane: {point: [0, 0, 0], normal: [0, 0, 1],"
#define SQUARE        "mesh: {file: tests/textures/quad.obj,"
#define FROM(x, y, z) "position: [" #x ", " #y ", " #z "], look_at: [0, 0, 0], fov: 0.01"

TEST(sphere_shows_east_and_west)
{
    const TestTexture texture = {2, 1, {{1, 0, 0.25F}, {0, 1, 0.75F}}}; // west, east
    texture_write(&texture);
    check_seen(FROM(-5, 0, 0), BALL, 1, 0, 0.25);
    check_seen(FROM(5, 0, 0), BALL, 0, 1, 0.75);
    check_seen(FROM(0, 0, 5), BALL, 0.5, 0.5, 0.5);
    check_seen(FROM(0, 0, -5), BALL, 0.5, 0.5, 0.5); // the seam
    check_seen(FROM(3, 0, 3), BALL, 0.25, 0.75, 0.625);
    check_seen(FROM(-3, 0, -3), BALL, 0.75, 0.25, 0.375);
}

TEST(sphere_shows_north_and_south)
{
    const TestTexture texture = {
        4, 2, {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, {0, 1, 1}, {1, 0, 0}, {1, 0, 1}, {1, 1, 0}, {1, 1, 1}}};
    texture_write(&texture);
    check_seen(FROM(0, 5, 0), BALL, 0, 0.5, 0.5);  // north: of longitude 0, the mean of two texels
    check_seen(FROM(0, -5, 0), BALL, 1, 0.5, 0.5); // south
    check_seen(FROM(0, 0, 5), BALL, 0.5, 0.5, 0.5);
    check_seen(FROM(0, 4, 4), BALL, 0, 0.5, 0.5); // latitude 45: the upper row's centers
    check_seen(FROM(4, -5.656854249492381, 4), BALL, 1, 1,
               0); // longitude 45, latitude -45: one texel's center
}

// Along u and v.
static const TextureWrap repeated[2] = {TEXTURE_REPEATED, TEXTURE_REPEATED},
                         on_sphere[2] = {TEXTURE_REPEATED, TEXTURE_CLAMPED};

static long texel_wrapped(long i, long count, TextureWrap wrap)
{
    if (wrap == TEXTURE_CLAMPED) return i < 0 ? 0 : i >= count ? count - 1 : i;
    const long period = wrap == TEXTURE_MIRRORED ? 2 * count : count;
    i = (i % period + period) % period;
    return i < count ? i : period - 1 - i;
}

static double texture_at(const TestTexture *texture, long column, long row, const TextureWrap wraps[2],
                         size_t channel)
{
    column = texel_wrapped(column, (long)texture->width, wraps[0]);
    row = texel_wrapped(row, (long)texture->height, wraps[1]);
    return (double)texture->colors[row * (long)texture->width + column][channel];
}

static double texture_between(const TestTexture *texture, double u, double v, const TextureWrap wraps[2],
                              size_t channel)
{
    double x = u * texture->width - 0.5, y = (1 - v) * texture->height - 0.5;
    double left = floor(x), top = floor(y), across = x - left, down = y - top;
    long i = (long)left, j = (long)top;
    return (1 - down) * ((1 - across) * texture_at(texture, i, j, wraps, channel) +
                         across * texture_at(texture, i + 1, j, wraps, channel)) +
           down * ((1 - across) * texture_at(texture, i, j + 1, wraps, channel) +
                   across * texture_at(texture, i + 1, j + 1, wraps, channel));
}

enum { WIDTH = 61, HEIGHT = 47 };

// u and v as functions of x, y, z and 1.
typedef double TextureMap[2][4];

// A texture that is twice as wide as tall has size 2 on the planes. On the last mesh it is three times in
// each direction, the whole texture in the middle.
static const TextureMap map_wall = {{0.5, 0, 0, 0}, {0, 1, 0, 0}},
                        map_wall_from_behind = {{-0.5, 0, 0, 0}, {0, 1, 0, 0}},
                        map_floor = {{0.5, 0, 0, 0}, {0, 0, -1, 0}},
                        map_quad = {{0.25, 0, 0, 0.5}, {0, 0.25, 0, 0.5}},
                        map_wide = {{0.75, 0, 0, 0.5}, {0, 0.75, 0, 0.5}};

// Without a map the surface is a sphere.
static void texture_place(const TextureMap *map, Vector3 p, Vector3 normal, double *u, double *v)
{
    if (map) {
        const double(*rows)[4] = *map;
        *u = rows[0][0] * p.x + rows[0][1] * p.y + rows[0][2] * p.z + rows[0][3];
        *v = rows[1][0] * p.x + rows[1][1] * p.y + rows[1][2] * p.z + rows[1][3];
    } else {
        *u = atan2(normal.x, normal.z) / (2 * M_PI) + 0.5;
        *v = asin(fmin(fmax(normal.y, -1), 1)) / M_PI + 0.5;
    }
}

static Vector3 vector_at(const double *values, size_t pixel)
{
    return (Vector3){values[3 * pixel], values[3 * pixel + 1], values[3 * pixel + 2]};
}

// Checks each pixel against its place in the texture, where texels are larger than pixels.
static void check_places(const char *camera, const char *object, const TextureMap *map,
                         const TextureWrap wraps[2])
{
    TestTexture texture = texture_make(4, 2);
    texture_write(&texture);
    OwnedScene scene = scene_make(camera, object);
    memcpy(scene.materials.items[0].image.wraps, wraps, sizeof scene.materials.items[0].image.wraps);
    for (Precision precision = PRECISION_SINGLE; precision <= PRECISION_DOUBLE; precision++) {
        if (!probe_has(precision)) continue;
        RenderSettings settings = film_settings(WIDTH, HEIGHT, precision);
        OwnedFilm film =
            film_render(&probe_compute, &scene, &settings, AOV_NORMAL | AOV_POSITION | AOV_OBJECT);
        double allowed = precision == PRECISION_DOUBLE ? 0x1p-48 : 0x1p-19, largest = 0;
        size_t seen = 0;
        for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; i++) {
            if (film.object[i] == UINT32_MAX) continue;
            Vector3 normal = vector_at(film.normal, i), from_eye = vector_at(film.position, i);
            if (vector_dot(normal, from_eye) > -0.3 * vector_length(from_eye))
                continue; // foreshortened texels
            double u, v;
            texture_place(map, vector_add(from_eye, scene.camera.position), normal, &u, &v);
            for (size_t channel = 0; channel < 3; channel++)
                largest = error_max(largest, fabs(film.color[3 * i + channel] -
                                                  texture_between(&texture, u, v, wraps, channel)));
            seen++;
        }
        assert_true(seen >= WIDTH * HEIGHT / 4 && seen <= WIDTH * HEIGHT);
        if (!(largest <= allowed))
            fail_msg("%s, %s: off by %g, more than %g", object, precision_names[precision], largest, allowed);
    }
}

TEST(sphere_agrees_all_around)
{
    check_places("position: [1, 2, 5], look_at: [0, 0, 0], fov: 25", BALL, NULL, on_sphere);
    check_places("position: [0.1, -0.3, -5], look_at: [0, 0, 0], fov: 25", BALL, NULL, on_sphere); // the seam
    check_places("position: [0.1, 5, 0.2], look_at: [0, 0, 0], fov: 25", BALL, NULL, on_sphere);   // a pole
    check_places("position: [0, -5, 0], look_at: [0, 0, 0], fov: 25", BALL, NULL, on_sphere);
}

TEST(planes_repeat_it)
{
    check_places("position: [0.3, 0.2, 3], look_at: [0.5, 0.5, 0]", WALL, &map_wall, repeated);
    check_places("position: [0.3, 0.2, -3], look_at: [0.5, 0.5, 0]",
                 "plane: {point: [0, 0, 0], normal: [0, 0, -3],", &map_wall_from_behind, repeated);
    check_places("position: [0.3, 3, 0.5], look_at: [0, 0, 0]",
                 "plane: {point: [0, 0, 0], normal: [0, 1, 0],", &map_floor, repeated);
    check_places("position: [0.3, 3, 0.5], look_at: [0, 0, 0]",
                 "disc: {center: [0, 0, 0], normal: [0, 1, 0], radius: 1.5,", &map_floor, repeated);
}

TEST(meshes_have_it_by_uv)
{
    check_places("position: [0.3, 0.2, 4], look_at: [0, 0, 0]", SQUARE, &map_quad, repeated);
}

TEST(meshes_wrap_it)
{
    static const TextureWrap wraps[][2] = {{TEXTURE_REPEATED, TEXTURE_REPEATED},
                                           {TEXTURE_CLAMPED, TEXTURE_MIRRORED},
                                           {TEXTURE_MIRRORED, TEXTURE_CLAMPED}};
    for (size_t i = 0; i < COUNT_OF(wraps); i++)
        check_places("position: [0.3, 0.2, 4], look_at: [0, 0, 0]", "mesh: {file: tests/textures/wide.obj,",
                     &map_wide, wraps[i]);
}

// Sets `mean` to the mean of all texels.
static void texture_mean(const TestTexture *texture, double mean[3])
{
    const uint32_t count = texture->width * texture->height;
    memset(mean, 0, 3 * sizeof *mean);
    for (uint32_t k = 0; k < 3 * count; k++)
        mean[k % 3] += (double)texture->colors[k / 3][k % 3] / count;
}

// Far away, where a pixel sees more than the whole texture, its color is the mean of all texels. No dimension
// of 5 x 3 is a power of two.
TEST(far_away_it_is_its_mean)
{
    static const uint32_t sizes[][2] = {{8, 8}, {5, 3}, {7, 1}, {1, 6}, {1, 1}};
    for (size_t i = 0; i < COUNT_OF(sizes); i++) {
        TestTexture texture = texture_make(sizes[i][0], sizes[i][1]);
        double mean[3];
        texture_mean(&texture, mean);
        texture_write(&texture);
        const char *far_camera = "position: [0, 0, 1000], look_at: [0, 0, 0], fov: 5";
        check_seen(far_camera, BALL, mean[0], mean[1], mean[2]);
        check_seen(far_camera, WALL, mean[0], mean[1], mean[2]);
        check_seen(far_camera, SQUARE, mean[0], mean[1], mean[2]);
    }
}

// A pixel sees 3 texels of a row across, halfway between those levels where a texel stands for 2 and for 4.
TEST(between_levels_it_blends)
{
    TestTexture texture = {8, 8, {{0}}};
    for (uint32_t i = 0; i < 64; i++)
        texture.colors[i][0] = i % 8 < 2; // two columns of eight
    texture_write(&texture);
    // 0.25 a texel; 2 distance tan(fov / 2) = 0.75. The eye looks at the middle of a texel of 2 columns,
    // which is the second of the four: black, its neighbors of half the texture's width: the colors 1 and 0.
    double finer = 0, coarser = 0.5 * (1 - 0.25); // of 4 columns: white in half of the first
    check_seen(formatted("position: [0.75, 0.75, 1], look_at: [0.75, 0.75, 0], fov: %.17g",
                         2 * atan(0.375) * 180 / M_PI),
               WALL, (finer + coarser) / 2, 0, 0);
}

// A mirror's texture of a texture is filtered for the whole path to the eye.
TEST(mirrors_filter_textures)
{
    TestTexture texture = texture_make(8, 8);
    double mean[3];
    texture_mean(&texture, mean);
    texture_write(&texture);
    check_seen("position: [0, 0, 1000], look_at: [0, 0, 0], fov: 5",
               "plane: {point: [0, 0, 0], normal: [0, 0, 1], material: {color: [0, 0, 0], reflection: 1}}},\n"
               "  {plane: {point: [0, 0, 1001], normal: [0, 0, -1],",
               mean[0], mean[1], mean[2]);
}

static void check_builds(const char *path)
{
    OwnedScene scene = scene_of_file(path);
    for (Precision precision = probe_same_bits_from(); precision <= PRECISION_STRICT; precision++) {
        RenderSettings settings = film_settings(71, 41, precision);
        settings.lanes = 1;
        settings.instances = INSTANCES_SHARED;
        OwnedFilm expected = film_render(&probe_compute, &scene, &settings, 0);
        assert_int_equal(film_count_faulty(&expected), 0);
        const uint32_t *tested = tested_lanes(probe_compute.device);
        for (const uint32_t *lanes = tested; *lanes; lanes++) {
            settings.lanes = *lanes;
            settings.bvh = BVH_ON;
            // builds without other features take long, so short tests have them at one precision
            const bool is_lean = precision == probe_same_bits_from() || tests_are_long();
            settings.extra_features = is_lean && *lanes != tested[1] ? 0 : FEATURE_ALL;
            OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
            film_assert_same(&film, &expected, precision_names[precision]);
        }
        settings.bvh = BVH_OFF;
        OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
        film_assert_same(&film, &expected, "without a BVH");
    }
}

TEST(every_build_gives_the_same_bits)
{
    check_builds("scenes/globe.yaml");
}

TEST(every_build_has_the_same_holes)
{
    check_builds("tests/scenes/cutouts.yaml");
}

// Instances that share a mesh have the holes of copies, but for pixels whose ray is at an edge.
TEST(instances_have_the_holes_of_copies)
{
    OwnedScene scene = scene_of_file("tests/scenes/cutouts.yaml");
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_STRICT);
    Film films[2];
    for (size_t i = 0; i < 2; i++) {
        settings.instances = i == 0 ? INSTANCES_SHARED : INSTANCES_COPIED;
        films[i] = film_render(&probe_compute, &scene, &settings, AOV_OBJECT | AOV_SHADOW);
    }
    const size_t count = (size_t)WIDTH * HEIGHT, first_id = 12; // the first instance's
    size_t objects = 0, shadows = 0, seen = 0;
    for (size_t i = 0; i < count; i++) {
        seen += films[0].object[i] != UINT32_MAX && films[0].object[i] >= first_id;
        objects += films[0].object[i] != films[1].object[i];
        for (size_t light = 0; light < 2; light++)
            shadows += films[0].shadow[2 * i + light] != films[1].shadow[2 * i + light];
    }
    if (objects > count / 500 || shadows > count / 100 || seen < count / 60)
        fail_msg("%zu objects and %zu shadows differ, %zu pixels show instances", objects, shadows, seen);
    film_free(&films[0]);
    film_free(&films[1]);
}

// Scenes have cutouts only if a pixel is transparent.
TEST(opaque_images_cut_nothing)
{
    static const char *const images[] = {"scenes/images/globe.png", "tests/textures/leaf.png"};
    for (size_t i = 0; i < 2; i++) {
        const char *text = formatted("camera: {%s}\nlights: [{point: {position: [0, 5, 5]}}]\n"
                                     "objects: [{%s material: {image: %s, cutout: 0.5}}}]\n",
                                     FROM(0, 0, 5), BALL, images[i]);
        OwnedScene scene = scene_of_text("s.yaml", text);
        assert_int_equal((features_of(&scene) & FEATURE_CUTOUTS) != 0, i == 1);
        assert_messages("s.yaml", text,
                        i == 1 ? ""
                               : "3:69: warning: the alpha of 'scenes/images/globe.png' is 1 everywhere, so "
                                 "nothing is cut out\n");
    }
}

// Checks the shade along the camera's axis of a white object, whose normal map's only texel is given, in the
// light from one direction.
static void check_shade(const char *camera, const char *object, const char *more, const float texel[3],
                        const char *light, double expected)
{
    TestTexture texture = {1, 1, {{texel[0], texel[1], texel[2]}}};
    texture_write(&texture);
    const char *text = formatted("camera: {%s}\nlights: [{directional: {direction: %s}}]\n"
                                 "define: {square: {objects: [{mesh: {file: tests/textures/quad.obj}}]}}\n"
                                 "objects: [{%s material: {ambient: 0, normal_map: %s%s}}}]\n",
                                 camera, light, object, texture_path, more);
    OwnedScene scene = scene_of_text("s.yaml", text);
    RenderSettings settings = film_settings(1, 1, PRECISION_STRICT);
    settings.instances = INSTANCES_SHARED;
    OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
    if (!(fabs(film.color[0] - expected) < 4e-7))
        fail_msg("%s: the shade is %.9g, not %.9g", text, film.color[0], expected);
}

#define FRONT FROM(0.1, 0.2, 5)

// Lambert's cosine of normals that are tilted by 1/2 along u or v, with the light at 3/5 of u or v.
TEST(normal_maps_tilt_normals)
{
    const float right[] = {0.75F, 0.5F, 1}, up[] = {0.5F, 0.75F, 1}, flat[] = {0.5F, 0.5F, 1};
    const double toward = (0.3 + 0.8) / sqrt(1.25), away = (-0.3 + 0.8) / sqrt(1.25);
    const char *from_right = "[-0.6, 0, -0.8]", *from_up = "[0, -0.6, -0.8]";
    check_shade(FRONT, SQUARE, "", flat, from_right, 0.8);
    check_shade(FRONT, SQUARE, "", right, from_right, toward);
    check_shade(FRONT, SQUARE, "", up, from_up, toward);
    check_shade(FRONT, SQUARE, "", right, "[0.6, 0, -0.8]", away);
    check_shade(FRONT, SQUARE, ", normal_strength: 2", right, from_right, (0.6 + 0.8) / sqrt(2));
    check_shade(FRONT, SQUARE, ", normal_strength: 1e30", right, from_right, 0.6);
    check_shade(FRONT, SQUARE, ", normal_strength: 0", right, from_right, 0.8);
    // a mirrored mesh mirrors its map, and from behind the map's bumps are hollows
    check_shade(FRONT, SQUARE " transform: {scale: [-1, 1, 1]},", "", right, from_right, away);
    check_shade(FRONT, SQUARE " transform: {scale: [-1, 1, 1]},", "", up, from_up, toward);
    check_shade(FRONT, SQUARE " transform: {rotate: [0, 0, 90]},", "", right, from_up, toward);
    const char *instance = "instance: {of: square, transform: {scale: [-1, 2, 1], rotate: [0, 0, 90]},";
    check_shade(FRONT, instance, "", right, from_up, away);
    check_shade(FRONT, instance, "", up, from_right, away);
    check_shade(FROM(0.1, 0.2, -5), SQUARE, "", right, "[-0.6, 0, 0.8]", away);
    check_shade(FRONT, "plane: {point: [0, 0, 0], normal: [0, 0, 3],", "", right, from_right, toward);
    check_shade(FRONT, "disc: {center: [0, 0, 0], normal: [0, 0, 1], radius: 1,", "", up, from_up, toward);
    check_shade(FROM(0, 5, 0.1), "plane: {point: [0, 0, 0], normal: [0, 1, 0],", "", up, "[0, -0.8, 0.6]",
                toward);
    check_shade(FROM(0, 0, 5), BALL, "", right, from_right, toward);
    check_shade(FROM(0, 0, 5), BALL, "", up, from_up, toward);
    check_shade(FROM(5, 0, 0), BALL, "", right, "[-0.8, 0, 0.6]", toward);
    check_shade(FROM(0, 5, 0), BALL, "", right, "[-0.6, -0.8, 0]", 0.8); // a pole
}

// A flat map changes no bit, whatever the strength.
TEST(flat_normal_maps_change_nothing)
{
    const TestTexture texture = {2, 2, {{0.5F, 0.5F, 1}, {0.5F, 0.5F, 1}, {0.5F, 0.5F, 1}, {0.5F, 0.5F, 1}}};
    texture_write(&texture);
    Film films[2];
    for (int i = 0; i < 2; i++) {
        const char *map = i == 1 ? formatted(", normal_map: %s, normal_strength: 3", texture_path) : "";
        OwnedScene scene = scene_of_text(
            "s.yaml", formatted("camera: {position: [0, 1, 5], look_at: [0, 0, 0]}\n"
                                "lights: [{point: {position: [2, 3, 4]}}]\n"
                                "materials: {shiny: {specular: 0.5, reflection: 0.3%s}}\n"
                                "objects:\n  - sphere: {center: [1, 0, 0], radius: 1, material: shiny}\n"
                                "  - plane: {point: [0, -1, 0], normal: [0.1, 1, 0], material: shiny}\n"
                                "  - mesh: {file: tests/textures/quad.obj, material: shiny, transform: "
                                "{rotate: [0, 30, 0], translate: [-1, 0, -1]}}\n",
                                map));
        assert_int_equal((features_of(&scene) & FEATURE_NORMAL_MAPS) != 0, i == 1);
        const RenderSettings settings = film_settings(64, 48, PRECISION_STRICT);
        films[i] = film_render(&probe_compute, &scene, &settings, 0);
    }
    film_assert_same(&films[1], &films[0], "a flat normal map");
    film_free(&films[0]);
    film_free(&films[1]);
}

TEST(jpeg_is_read)
{
    enum { SIDE = 16 };
    uint8_t pixels[SIDE * SIDE * 3], *bytes = NULL;
    for (size_t i = 0; i < sizeof pixels; i++)
        pixels[i] = (uint8_t[]){200, 120, 40}[i % 3];
    unsigned long length = 0;
    tjhandle encoder = tjInitCompress();
    assert_int_equal(
        tjCompress2(encoder, pixels, SIDE, 0, SIDE, TJPF_RGB, &bytes, &length, TJSAMP_420, 95, 0), 0);
    file_write_bytes(texture_path, bytes, length);
    Image image;
    OwnedMessageList messages = {0};
    assert_true(image_read(&image, texture_path, NULL, &messages));
    assert_int_equal(image.width, SIDE);
    assert_int_equal(image.height, SIDE);
    assert_true(image.display);
    for (size_t i = 0; i < sizeof pixels; i++)
        assert_true(fabs((double)image.values[i] * 255 - pixels[i]) <= 2);
    image_free(&image);
    // sRGB, made linear
    double linear[3];
    for (size_t i = 0; i < 3; i++)
        linear[i] = pow(((double)pixels[i] / 255 + 0.055) / 1.055, 2.4);
    OwnedScene scene = scene_make(FROM(0, 0, 5), BALL);
    RenderSettings settings = film_settings(1, 1, PRECISION_SINGLE);
    OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
    for (size_t i = 0; i < 3; i++)
        assert_true(fabs(film.color[i] - linear[i]) < 0.015);

    assert_int_equal(truncate(texture_path, 20), 0);
    assert_false(image_read(&image, texture_path, NULL, &messages));
    tjFree(bytes);
    tjDestroy(encoder);
}

// Checks the message about the texture, at its place in the scene file.
static void check_refused(const char *expected)
{
    OwnedText described = scene_messages("s.yaml", scene_text(FROM(0, 0, 5), BALL), false);
    if (!strstr(text_c(&described), expected) || strncmp(text_c(&described), "3:30: error: ", 13) != 0)
        fail_msg("%s lacks %s", text_c(&described), expected);
}

TEST(texture_faults_are_reported)
{
    unlink(texture_path);
    check_refused("No such file");
    assert_int_equal(symlink("/dev/null", texture_path), 0);
    check_refused("not a regular file");
    unlink(texture_path);
    file_write(texture_path, "not a texture");
    check_refused("neither PNG, JPEG, PPM, EXR nor NPY");
    TestTexture texture = texture_make(3, 2);
    texture.colors[4][1] = NAN;
    texture_write(&texture);
    check_refused("has a color that is not finite");
}

TEST(textures_are_shared)
{
    const TestTexture texture = texture_make(3, 2);
    texture_write(&texture);
    OwnedScene scene = scene_of_text(
        "scenes/images/s.yaml", formatted("camera: {position: [0, 0, 5], look_at: [0, 0, 0]}\nmaterials:\n"
                                          "  a: {image: globe.png}\n  b: {image: ../images/globe.png}\n"
                                          "  c: {image: globe.png}\n  d: {image: %s}\n",
                                          texture_path));
    assert_int_equal(scene.textures.count, 3);
    assert_string_equal(scene.textures.items[0].path, "scenes/images/globe.png");
    assert_string_equal(scene.textures.items[2].path, texture_path);
    assert_int_equal(scene.materials.items[2].image.texture, 1);
}

TEST_MAIN(textures_open, textures_close)
