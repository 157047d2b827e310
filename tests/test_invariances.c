// Renders random scenes of every shape, light and type of material with settings that must not change any bit
// of an image or its AOVs (hard cases R6, R7, P7, M6 of docs/verify.md). test_variants has a scene made by
// hand.
//
// run_tests: sanitize-long-only
#include "host/compile/transform.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/random_scene.h"

enum {
    SEEDS = 5, // the first two where tests are short
    OBJECTS = 40,
    WIDTH = 53, // neither is a whole number of tiles of any width
    HEIGHT = 37,
    AOVS = AOV_T | AOV_NORMAL | AOV_POSITION | AOV_OBJECT | AOV_SHADOW | AOV_RAY
};

typedef struct {
    const Scene *scene;
    RenderSettings settings;
    Film film;
    const char *name;
} Case;

static Film render(const Scene *scene, const RenderSettings *settings)
{
    return film_render(&probe_compute, scene, settings, AOVS);
}

// Renders without AOVs, whose kernels take longer to build than to test.
static Film render_alone(const Scene *scene, const RenderSettings *settings)
{
    return film_render(&probe_compute, scene, settings, 0);
}

static void same_and_freed(const Case *c, Film *film, const char *what)
{
    film_assert_same(film, &c->film, formatted("%s, %s", c->name, what));
    film_free(film);
}

static size_t objects_seen(const Film *film)
{
    bool seen[OBJECTS] = {false};
    size_t count = 0;
    for (size_t i = 0; i < (size_t)film->width * film->height; i++) {
        if (film->object[i] == UINT32_MAX) continue;
        assert_true(film->object[i] < OBJECTS);
        count += !seen[film->object[i]];
        seen[film->object[i]] = true;
    }
    return count;
}

// Returns a random scene with what `certified` refuses, a precision that other tests of random scenes
// include.
static Scene optical_scene(uint64_t seed)
{
    Scene scene = random_scene(seed, OBJECTS);
    Material *glass = &scene.materials.items[2];
    glass->fresnel = true;
    scene.materials.items[1].conductor.n = (Color){0.2, 1, 1.5};
    scene.materials.items[1].conductor.k = (Color){3.5, 2.5, 0};
    glass->absorption = vector_scale(glass->color, 0.25);
    return scene;
}

static void runs_bands_and_bvh_change_nothing(const Case *c)
{
    RenderSettings settings = c->settings;
    Film again = render(c->scene, &settings);
    same_and_freed(c, &again, "again");
    for (settings.band_rows = 1; settings.band_rows <= 5; settings.band_rows += 4) {
        Film bands = render(c->scene, &settings);
        same_and_freed(c, &bands, formatted("bands of %u rows", settings.band_rows));
    }
    settings = c->settings;
    settings.bvh = BVH_OFF;
    Film listed = render_alone(c->scene, &settings);
    same_and_freed(c, &listed, "without a BVH");
}

static void lanes_change_nothing(const Case *c)
{
    for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
        RenderSettings settings = c->settings;
        settings.lanes = *lanes;
        if (settings.precision != PRECISION_SINGLE && settings.lanes > 1) break;
        Film film = render_alone(c->scene, &settings);
        same_and_freed(c, &film, formatted("%u lanes", settings.lanes));
    }
}

// Hard case R6 (docs/verify.md): nothing in the kernels depends on an absolute length. A scene whose squares
// would overflow is scaled.
static void scale_changes_lengths_alone(const Case *c, uint64_t seed)
{
    static const int exponents[] = {-90, -60, -10, 3, 10, 60, 90};
    for (size_t i = 0; i < COUNT_OF(exponents); i++) {
        OwnedScene scene = optical_scene(seed);
        scene_scale(&scene, ldexp(1, exponents[i]));
        Film film = render(&scene, &c->settings);
        for (size_t k = 0; k < (size_t)WIDTH * HEIGHT; k++) {
            film.t[k] = ldexp(film.t[k], -exponents[i]);
            for (size_t axis = 0; axis < 3; axis++)
                film.position[3 * k + axis] = ldexp(film.position[3 * k + axis], -exponents[i]);
        }
        same_and_freed(c, &film, formatted("scaled by 2^%d", exponents[i]));
    }
}

// Mirrors each row of pixels of `size` bytes.
static void columns_flip(void *values, size_t size)
{
    unsigned char *bytes = values, kept[4 * sizeof(double)];
    assert_true(size <= sizeof kept);
    for (size_t row = 0; row < HEIGHT; row++)
        for (size_t left = 0; left < WIDTH / 2; left++) {
            unsigned char *a = bytes + (row * WIDTH + left) * size;
            unsigned char *b = bytes + (row * WIDTH + WIDTH - 1 - left) * size;
            memcpy(kept, a, size);
            memcpy(a, b, size);
            memcpy(b, kept, size);
        }
}

// Returns the optical scene without checkers. In a plane they lie along axes made from its normal, whose
// mirror images differ.
static Scene unchecked_scene(uint64_t seed)
{
    Scene scene = optical_scene(seed);
    for (size_t i = 0; i < scene.materials.count; i++)
        scene.materials.items[i].checker.is_on = false;
    return scene;
}

static void mirror_flips_the_image(const Case *checkered, uint64_t seed)
{
    OwnedScene given = unchecked_scene(seed), scene = unchecked_scene(seed);
    scene_mirror(&scene);
    Case c = *checkered;
    c.film = render(&given, &c.settings);
    Film film = render(&scene, &c.settings);
    double *vectors[] = {film.color, film.normal, film.position, film.ray};
    for (size_t i = 0; i < 4; i++) {
        columns_flip(vectors[i], 3 * sizeof(double));
        for (size_t k = 0; k < (size_t)WIDTH * HEIGHT && i > 0; k++)
            vectors[i][3 * k] = -vectors[i][3 * k];
    }
    columns_flip(film.t, sizeof *film.t);
    columns_flip(film.object, sizeof *film.object);
    columns_flip(film.shadow, film.light_count * sizeof *film.shadow);
    same_and_freed(&c, &film, "mirrored");
    film_free(&c.film);
}

// Maps object ids, which are list indices, back to the original order.
static void order_changes_ids_alone(const Case *c, uint64_t seed)
{
    Random random = {seed};
    for (int permutation = 0; permutation < 2; permutation++) {
        OwnedScene given = optical_scene(seed), scene = optical_scene(seed);
        uint32_t from[OBJECTS];
        for (uint32_t i = 0; i < OBJECTS; i++)
            from[i] = OBJECTS - 1 - i;
        for (uint32_t i = OBJECTS - 1; permutation == 1 && i > 0; i--) {
            uint32_t k = (uint32_t)random_between(&random, 0, i + 1), kept = from[i];
            from[i] = from[k];
            from[k] = kept;
        }
        for (size_t i = 0; i < OBJECTS; i++)
            scene.objects.items[i] = given.objects.items[from[i]];
        Film film = render(&scene, &c->settings);
        for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; i++)
            if (film.object[i] != UINT32_MAX) film.object[i] = from[film.object[i]];
        same_and_freed(c, &film, permutation == 0 ? "objects in reverse" : "objects shuffled");
    }
}

static void precision_holds(void **state)
{
    const Precision precision = *(const Precision *)*state;
    if (!probe_has(precision) || precision < probe_same_bits_from()) skip();
    for (uint64_t seed = 1; seed <= (tests_are_long() ? SEEDS : 2); seed++) {
        OwnedScene scene = optical_scene(seed);
        OWNED char *name = text_format("%s, seed %u", precision_names[precision], (unsigned)seed);
        Case c = {.scene = &scene, .settings = film_settings(WIDTH, HEIGHT, precision), .name = name};
        c.settings.bvh = BVH_ON;
        c.settings.extra_features |= features_of(&scene); // also where a changed scene needs fewer
        // without points of areas, which depend on the pixel, and so change in a mirror image
        assert_int_equal(features_of(&scene) | FEATURE_BVH | FEATURE_EYE_POWERS | FEATURE_IMAGES |
                             FEATURE_CUTOUTS | FEATURE_NORMAL_MAPS | FEATURE_AREA_LIGHTS | FEATURE_SKY_LIGHT |
                             FEATURE_LENS | FEATURE_ORTHOGRAPHIC | FEATURE_EQUIRECTANGULAR |
                             FEATURE_INSTANCES,
                         FEATURE_ALL);
        c.film = render(&scene, &c.settings);
        assert_int_equal(film_count_faulty(&c.film), 0);
        assert_true(objects_seen(&c.film) >= OBJECTS / 3);

        runs_bands_and_bvh_change_nothing(&c);
        // double's kernel at 1 lane takes as long to build as the rest to test
        if (precision != PRECISION_DOUBLE || tests_are_long()) lanes_change_nothing(&c);
        scale_changes_lengths_alone(&c, seed);
        mirror_flips_the_image(&c, seed);
        order_changes_ids_alone(&c, seed);
        film_free(&c.film);
    }
}

TEST_CASE(single_holds, precision_holds, &(Precision){PRECISION_SINGLE})
TEST_CASE(strict_holds, precision_holds, &(Precision){PRECISION_STRICT})
TEST_CASE(double_holds, precision_holds, &(Precision){PRECISION_DOUBLE})

// Without BVH, mirrors and glass up to 32 objects are culled for several packets at once. With one lane there
// are no packets, and with every feature built in there may be mirrors.
TEST(culls_of_several_packets_change_nothing)
{
    static const size_t counts[] = {3, 9, 31, 32, 33, 34, OBJECTS};
    OwnedScene scene = random_scene(1, 2 * OBJECTS);
    for (size_t i = 0; i < OBJECTS; i++) // all bounded
        scene.objects.items[i] = scene.objects.items[2 * OBJECTS - 1 - i];
    scene.objects.count = OBJECTS;
    for (size_t i = 0; i < scene.materials.count; i++)
        scene.materials.items[i].reflection.largest = scene.materials.items[i].transmission.largest = 0;
    RenderSettings settings = film_settings(8 * WIDTH, 8 * HEIGHT, probe_same_bits_from());
    settings.extra_features = features_of(&scene);
    assert_int_equal(settings.extra_features & (FEATURE_REFLECTION | FEATURE_TRANSMISSION), 0);
    settings.bvh = BVH_OFF;
    for (size_t i = 0; i < COUNT_OF(counts); i++) {
        scene.objects.count = counts[i];
        Case c = {.scene = &scene, .settings = settings, .name = "without mirrors and glass"};
        c.settings.lanes = 1;
        c.settings.extra_features = FEATURE_ALL;
        c.film = render_alone(&scene, &c.settings);
        c.settings.extra_features = settings.extra_features;
        for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
            if (*lanes == 1) continue;
            const char *what = formatted("%zu objects, %u lanes", counts[i], *lanes);
            c.settings.lanes = *lanes;
            Film film = render_alone(&scene, &c.settings);
            same_and_freed(&c, &film, what);
        }
        film_free(&c.film);
    }
}

TEST_MAIN(probe_open, probe_close)
