// Checks that an image rendered in rounds, or by a renderer whose camera was moved, has the bits of one
// rendered at once. A preview's may differ by roundings.
// run_tests: sanitize-long-only
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

enum { WIDTH = 53, HEIGHT = 37, SAMPLES = 7, AOVS = AOV_T | AOV_OBJECT | AOV_SHADOW };

typedef struct {
    Film film;
    uint32_t samples; // of the last band of color
    uint32_t first_samples;
    unsigned color_bands, aov_bands;
} Received;

static bool band_receive(void *context, const Film *band)
{
    const uint32_t samples = band->samples;
    Received *received = context;
    film_copy_band(&received->film, band);
    if (!band->color) {
        assert_int_equal(samples, 1);
        received->aov_bands++;
        return true;
    }
    assert_true(samples >= received->samples);
    if (received->color_bands++ == 0) received->first_samples = samples;
    received->samples = samples;
    return true;
}

TEST(rounds_give_the_bits_of_one_render)
{
    OwnedScene scene = scene_of_file("scenes/globe.yaml");
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_SINGLE);
    settings.sample_count = SAMPLES;
    OwnedFilm expected = film_render(&probe_compute, &scene, &settings, AOVS);
    settings.band_rows = 8;
    Renderer *renderer = probe_renderer(&scene, &settings);
    Received received = {.film = film_allocate(WIDTH, HEIGHT, (uint32_t)scene.lights.count, AOVS)};
    assert_true(renderer_accumulate(renderer, AOVS, band_receive, &received));
    assert_int_equal(received.first_samples, 1);
    assert_int_equal(received.samples, SAMPLES);
    assert_int_equal(received.aov_bands, 5);
    assert_true(received.color_bands >= 10 && received.color_bands % 5 == 0);
    film_assert_same(&received.film, &expected, "rounds");
    film_free(&received.film);
    renderer_close(renderer);
}

// The last sample of `certified` flags pixels after the AOVs were delivered.
TEST(rounds_flag_the_pixels_of_one_render)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    OwnedScene scene = scene_of_file("tests/scenes/mirror-balls.yaml");
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_CERTIFIED);
    settings.sample_count = 3;
    OwnedFilm expected = film_render(&probe_compute, &scene, &settings, AOV_FLAG);
    Renderer *renderer = probe_renderer(&scene, &settings);
    Received received = {.film = film_allocate(WIDTH, HEIGHT, (uint32_t)scene.lights.count, AOV_FLAG)};
    assert_true(renderer_accumulate(renderer, AOV_FLAG, band_receive, &received));
    film_assert_same(&received.film, &expected, "flags of rounds");
    film_free(&received.film);
    renderer_close(renderer);
}

// What the first pass of `certified` proves is replayed in double. If the device's buffers are too small for
// the record, the second pass searches again.
TEST(replayed_decisions_change_nothing)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    static const char *const files[] = {"tests/scenes/mirror-balls.yaml", "scenes/mirror-glass.yaml"};
    Device small = *probe_compute.device;
    Compute compute = probe_compute;
    compute.device = &small;
    small.largest_buffer_bytes = 1 << 17; // holds the film, but not a sample's records
    for (size_t i = 0; i < COUNT_OF(files); i++) {
        Scene scene = scene_of_file(files[i]);
        RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_CERTIFIED);
        settings.sample_count = 3;
        settings.bvh = BVH_ON;
        Film searched = film_render(&compute, &scene, &settings, 0);
        assert_true(searched.rerenders.rerendered > WIDTH * HEIGHT / 10);
        for (; settings.band_rows <= 8; settings.band_rows += 8) { // several bands use the same buffers
            Film replayed = film_render(&probe_compute, &scene, &settings, 0);
            film_assert_same(&replayed, &searched, files[i]);
            assert_int_equal(replayed.rerenders.rerendered, searched.rerenders.rerendered);
            assert_int_equal(replayed.rerenders.uncertified, searched.rerenders.uncertified);
            film_free(&replayed);
        }
        film_free(&searched);
        scene_free(&scene);
    }
}

TEST(rounds_stop)
{
    OwnedScene scene = scene_of_file("scenes/globe.yaml");
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_SINGLE);
    settings.sample_count = SAMPLES;
    settings.band_rows = 8;
    settings.stop = stop_now;
    Renderer *renderer = probe_renderer(&scene, &settings);
    for (unsigned launches = 0; launches < 9; launches++) {
        Received received = {.film = film_allocate(WIDTH, HEIGHT, (uint32_t)scene.lights.count, AOVS)};
        stop_countdown = launches + 1;
        assert_false(renderer_accumulate(renderer, AOVS, band_receive, &received));
        // the band of the launch after which it stops is not delivered
        if (launches < 5) assert_int_equal(received.color_bands, launches);
        assert_true(received.color_bands <= launches);
        film_free(&received.film);
    }
    renderer_close(renderer);
}

// Checks the image that a renderer which is already open makes.
static void check_render(Renderer *renderer, const Film *expected, const char *what)
{
    OwnedFilm film;
    assert_true(renderer_render_film(renderer, expected->t ? AOVS : 0, &film));
    film_assert_same(&film, expected, what);
}

static void check_moved_renderer(bool moves)
{
    OwnedScene scene = scene_of_file("scenes/globe.yaml");
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_SINGLE);
    settings.moves = moves;
    settings.bvh = BVH_ON;
    MessageList messages = {0};
    Renderer *renderer = probe_renderer(&scene, &settings);
    OwnedFilm first;
    assert_true(renderer_render_film(renderer, AOVS, &first)); // its kernels take the new arrays
    double build_seconds = renderer_report(renderer)->build_seconds;

    scene.camera.position = vector_add(scene.camera.position, (Vector3){0.3, 0.2, -0.1});
    settings.width = settings.region_width = HEIGHT;
    settings.sample_count = SAMPLES;
    assert_true(renderer_move(renderer, &scene, &settings, &messages));
    OwnedFilm expected = film_render(&probe_compute, &scene, &settings, AOVS);
    check_render(renderer, &expected, "moved");
    assert_true(renderer_report(renderer)->build_seconds == build_seconds);

    // a camera that does not fit leaves the renderer as it was
    const Camera camera = scene.camera;
    scene.camera.half_tangent = 1e300;
    scene.camera.position.x += 1;
    assert_false(renderer_move(renderer, &scene, &settings, &messages));
    assert_int_equal(message_count(&messages, MESSAGE_ERROR), 1);
    message_list_free(&messages);
    check_render(renderer, &expected, "after a camera that does not fit");
    scene.camera = camera;
    assert_true(renderer_move(renderer, &scene, &settings, &messages));
    check_render(renderer, &expected, "back from a camera that does not fit");
    renderer_close(renderer);
}

// At `certified`, a scene that does not fit the device in double must not replace the scene in float.
TEST(scene_that_does_not_fit_one_pass_is_not_rendered)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    Device small = *probe_compute.device;
    Compute compute = probe_compute;
    compute.device = &small;
    OwnedScene scene = scene_of_file("scenes/spheres16.yaml");
    const RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_CERTIFIED);
    OwnedMessageList messages = {0};
    Renderer *renderer = renderer_open(&compute, &scene, &settings, &messages);
    assert_non_null(renderer);
    OwnedFilm expected = film_render(&compute, &scene, &settings, AOVS);
    small.memory_bytes = 1 << 28;
    while (renderer_move(renderer, &scene, &settings, &messages))
        small.memory_bytes -= small.memory_bytes / 16; // in double the scene needs more
    scene.camera.position.x += 1;
    assert_false(renderer_move(renderer, &scene, &settings, &messages));
    small.memory_bytes = probe_compute.device->memory_bytes;
    check_render(renderer, &expected, "after a scene that does not fit");
    renderer_close(renderer);
}

// A reference device that fails while its arithmetic is measured must be reported by the device that it
// serves.
TEST(reference_device_that_fails_is_reported)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    Device other = *probe_compute.device;
    other.passports = device_passports_open(); // empty
    Compute compute;
    compute_open(&compute, probe_compute.device);
    assert_true(compute_open_reference(&compute, &other));
    compute_fail(compute.reference, "clFinish", CL_OUT_OF_RESOURCES, "lost");
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_CERTIFIED);
    settings.no_cache = true;
    OwnedMessageList messages = {0};
    assert_null(renderer_open_empty(&compute, &settings, NULL, &messages));
    assert_int_equal(messages.count, 0);
    assert_false(compute_ok(&compute));
    compute_close(&compute);
    device_passports_close(other.passports);
}

TEST(moved_renderer_gives_the_bits_of_a_new_one)
{
    check_moved_renderer(false);
    check_moved_renderer(true);
}

// Checks that a preview, which shows the arrays of the last eye from the present eye, has the image of a
// renderer that moved them, except for their roundings. Returns the number of pixels where these show.
static size_t preview_check(Scene scene, BvhChoice bvh, double fraction_of_way)
{
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_SINGLE);
    settings.moves = true;
    settings.bvh = bvh;
    MessageList messages = {0};
    Renderer *renderer = probe_renderer(&scene, &settings);
    const Camera camera = scene.camera;
    const Vector3 ahead = vector_subtract(camera.look_at, camera.position);
    scene.camera.position = vector_add(camera.position, vector_scale(ahead, fraction_of_way));
    scene.camera.position.x += 0.1;
    settings.is_preview = true;
    assert_true(renderer_move(renderer, &scene, &settings, &messages));
    OwnedFilm film, expected = film_render(&probe_compute, &scene, &settings, AOVS);
    assert_true(renderer_render_film(renderer, AOVS, &film));
    const size_t count = film_pixel_count(&film);
    size_t others = 0, rounded = 0;
    for (size_t i = 0; i < count; i++) {
        const bool is_same = film.object[i] == expected.object[i];
        if (is_same && isinf(film.t[i])) continue;
        rounded += film.t[i] != expected.t[i];
        others += !is_same || !(fabs(film.t[i] - expected.t[i]) <= 1e-3 * expected.t[i]);
    }
    assert_true(others <= count / 200); // at outlines

    settings.is_preview = false;
    assert_true(renderer_move(renderer, &scene, &settings, &messages));
    check_render(renderer, &expected, "after a preview");
    renderer_close(renderer);
    scene_free(&scene);
    return rounded;
}

TEST(preview_differs_by_roundings)
{
    preview_check(scene_of_file("scenes/globe.yaml"), BVH_ON, 0.2);
    preview_check(scene_of_file("scenes/spheres16.yaml"), BVH_OFF, 0.2);
    // seen from afar it was rounded by 3e-5
    Scene scene =
        scene_of_text("far.yaml", "camera: {position: [0, 0.1, -1000.3], look_at: [0, 0.1, 0], fov: 40}\n"
                                  "objects: [{sphere: {center: [0.1, 0, 0.3], radius: 1.3}}]\n");
    assert_true(preview_check(scene, BVH_AUTO, 0.996) > 0);
}

// An eye next to a sphere needs the sphere's power, and so a second kernel. An eye that alternates between
// two places builds each kernel once. The first launches of each are as small as those of a new one.
TEST(eye_next_to_a_sphere_builds_two_kernels)
{
    OwnedScene scene =
        scene_of_text("two.yaml", "camera: {position: [0, 0, -4], look_at: [0, 0, 0], fov: 50}\n"
                                  "lights: [{point: {position: [0, 9, -9]}}]\n"
                                  "objects: [{sphere: {center: [0, 0, 1.5], radius: 1.125,\n"
                                  "  material: {reflection: 0.1}}}]\n"); // as glint.py's SPHERE
    RenderSettings settings = film_settings(128, 96, PRECISION_SINGLE);  // more pixels than a first launch
    settings.extra_features = 0;
    settings.moves = true;
    settings.band_seconds = 100; // no launch takes so long
    MessageList messages = {0};
    Renderer *renderer = probe_renderer(&scene, &settings);
    uint64_t hashes[4];
    double build_seconds[4];
    size_t launch_counts[4];
    for (size_t i = 0; i < 4; i++) {
        scene.camera.position.z = i % 2 ? 0.3749 : -4;
        assert_true(renderer_move(renderer, &scene, &settings, &messages));
        OwnedFilm expected = film_render(&probe_compute, &scene, &settings, 0);
        renderer_report_restart(renderer);
        check_render(renderer, &expected, "near or far");
        launch_counts[i] = renderer_report(renderer)->launches.count;
        assert_true(launch_counts[i] > 1 && launch_counts[i] == launch_counts[0]);
        hashes[i] = renderer_report(renderer)->kernel_hash;
        build_seconds[i] = renderer_report(renderer)->build_seconds;
    }
    assert_true(hashes[0] != hashes[1]);
    assert_true(hashes[2] == hashes[0] && hashes[3] == hashes[1]);
    assert_true(build_seconds[1] > build_seconds[0] && build_seconds[3] == build_seconds[1]);
    renderer_close(renderer);
}

TEST_MAIN(probe_open, probe_close)
