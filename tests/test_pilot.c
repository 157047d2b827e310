// Tests the sample of pixels that a pilot renders, its upper bound of a mean, and the precision that it
// chooses.
#include "host/measure/pilot.h"
#include "host/verify/random_shape.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

enum { WIDTH = 71, HEIGHT = 50, CELL = 5 };

// Returns where in its cell of the whole image a pixel of the sample is. Fails if it is not in the cell.
static unsigned place_in_cell(const Film *whole, const double *color, uint32_t x, uint32_t y)
{
    for (uint32_t i = 0; i < CELL * CELL; i++) {
        const size_t pixel = (size_t)(y * CELL + i / CELL) * WIDTH + x * CELL + i % CELL;
        if (memcmp(whole->color + 3 * pixel, color, 3 * sizeof *color) == 0) return i;
    }
    fail_msg("the sample of cell %u,%u is not a pixel of it", x, y);
    return 0;
}

// Every cell has one, at places that differ, whatever the bands.
TEST(sample_has_a_pixel_of_each_cell)
{
    OwnedScene scene = scene_of_file("scenes/globe.yaml");
    RenderSettings settings = film_settings(WIDTH, HEIGHT, probe_sound_from());
    settings.sample_count = 2;
    OwnedFilm whole = film_render(&probe_compute, &scene, &settings, 0);
    settings.cell = CELL;
    settings.region_width = WIDTH / CELL;
    settings.region_height = HEIGHT / CELL;
    OwnedFilm sample = film_render(&probe_compute, &scene, &settings, 0);
    settings.band_rows = 4;
    OwnedFilm in_bands = film_render(&probe_compute, &scene, &settings, 0);
    film_assert_same(&in_bands, &sample, "a sample in bands");
    unsigned counts[CELL * CELL] = {0};
    for (uint32_t y = 0; y < sample.height; y++)
        for (uint32_t x = 0; x < sample.width; x++)
            counts[place_in_cell(&whole, sample.color + 3 * ((size_t)y * sample.width + x), x, y)]++;
    for (unsigned i = 0; i < CELL * CELL; i++)
        assert_true(counts[i] <= 24); // of 140; the background's first counts for all
}

TEST(bound_of_zeros_and_ones)
{
    double values[1000] = {0};
    assert_true(fabs(mean_upper_bound(values, 1000, 0.05) - (pow(0.05, -1e-3) - 1)) < 1e-12);
    values[7] = 1; // (1 + m)^999 m = 20
    const double one = mean_upper_bound(values, 1000, 0.05);
    assert_true(fabs(pow(1 + one, 999) * one * 0.05 - 1) < 1e-6);
    for (size_t i = 0; i < 1000; i++)
        values[i] = 1;
    assert_true(mean_upper_bound(values, 1000, 0.05) == 1);
    assert_true(mean_upper_bound(values, 1, 0.05) == 1);
}

// For rare values, as of wrong pixels, in strata that differ, the bound misses the mean no more often than
// it may, and is not useless (400 zeros alone give 0.006).
TEST(bound_covers_the_mean)
{
    enum { TRIALS = 2000, COUNT = 400 };
    const double risk = 0.1;
    Random random = {3};
    for (int type = 0; type < 3; type++) {
        unsigned missed = 0;
        double values[COUNT], mean = 0, bounds = 0;
        for (size_t i = 0; i < COUNT; i++)
            mean += (type == 0 ? 0.005 : type == 1 && i % 4 == 0 ? 0.02 : 0.001) / COUNT;
        if (type == 2) mean = 0.5;
        for (int trial = 0; trial < TRIALS; trial++) {
            for (size_t i = 0; i < COUNT; i++) {
                const double share = type == 0 ? 0.005 : type == 1 && i % 4 == 0 ? 0.02 : 0.001;
                values[i] = type == 2 ? random_between(&random, 0, 1) : random_between(&random, 0, 1) < share;
            }
            const double bound = mean_upper_bound(values, COUNT, risk);
            missed += bound < mean;
            bounds += bound / TRIALS;
        }
        assert_true(missed <= risk * TRIALS);
        assert_true(bounds < mean + (type == 2 ? 0.07 : 0.03));
    }
}

static Film film_of(const double *colors, uint32_t count)
{
    Film film = film_allocate(count, 1, 0, 0);
    memcpy(film.color, colors, 3 * count * sizeof *colors);
    return film;
}

TEST(verdicts_of_a_sample)
{
    enum { COUNT = 1000 };
    double colors[3 * COUNT], wrong[3 * COUNT];
    for (size_t i = 0; i < 3 * COUNT; i++)
        wrong[i] = colors[i] = (double)(i % 5) / 2; // 0 to 2
    const double floor_of_none = sqrt(pow(0.05, -1.0 / COUNT) - 1);
    OwnedFilm reference = film_of(colors, COUNT), equal = film_of(wrong, COUNT);
    ErrorBudget budget = {0.2, ERROR_RMSE};
    Sampling sampling = {.drawn = COUNT, .drawn_share = 1, .color_max = 3, .risk = 0.05};
    assert_true(fabs(sample_rmse_floor(&sampling) - 3 * floor_of_none) < 1e-9);
    SampleVerdict verdict = sample_classify(&budget, &reference, &equal, &sampling);
    assert_true(verdict.error == 0 && verdict.keeps);
    assert_true(fabs(verdict.bound - 3 * floor_of_none) < 1e-9);
    budget.limit = 0.15;
    assert_false(sample_classify(&budget, &reference, &equal, &sampling).keeps);
    budget = (ErrorBudget){1e-9, ERROR_MAX};
    verdict = sample_classify(&budget, &reference, &equal, &sampling);
    assert_true(verdict.keeps && fabs(verdict.bound - floor_of_none * floor_of_none) < 1e-9);
    wrong[0] += 0.5;
    OwnedFilm off = film_of(wrong, COUNT);
    verdict = sample_classify(&budget, &reference, &off, &sampling);
    assert_true(!verdict.keeps && verdict.error == 0.5 && verdict.bound > 2 * floor_of_none * floor_of_none);
    budget = (ErrorBudget){0.5, ERROR_FLIP};
    verdict = sample_classify(&budget, &reference, &off, &sampling);
    assert_true(verdict.keeps && verdict.error > 0 && verdict.error < 1e-3 && verdict.bound > 0.07);

    // pixels outside the sample count in full: an error of 0.5 in a channel of the only one
    OwnedFilm turned = film_of(wrong + 3, COUNT - 1), turned_reference = film_of(colors + 3, COUNT - 1);
    const Sampling most = {.drawn = COUNT - 1, .drawn_share = 0.999, .color_max = 3, .risk = 0.05};
    const double drawn_bound =
        sample_classify(&(ErrorBudget){1, ERROR_RMSE}, &turned_reference, &turned, &most).bound;
    memmove(reference.color, reference.color + 3, 3 * (COUNT - 1) * sizeof *colors);
    memmove(off.color, off.color + 3, 3 * (COUNT - 1) * sizeof *colors);
    for (size_t i = 0; i < 3; i++) {
        reference.color[3 * (COUNT - 1) + i] = colors[i];
        off.color[3 * (COUNT - 1) + i] = wrong[i];
    }
    verdict = sample_classify(&(ErrorBudget){1, ERROR_RMSE}, &reference, &off, &most);
    assert_true(fabs(verdict.bound * verdict.bound - drawn_bound * drawn_bound - 0.001 * 0.25 / 3) < 1e-9);

    off.color[5] = NAN;
    assert_true(isinf(sample_classify(&budget, &reference, &off, &sampling).bound));
    assert_false(sample_classify(&(ErrorBudget){1e9, ERROR_RMSE}, &reference, &off, &sampling).keeps);
    sampling.color_max = INFINITY;
    assert_false(sample_classify(&(ErrorBudget){1e9, ERROR_RMSE}, &reference, &equal, &sampling).keeps);
    assert_true(sample_classify(&(ErrorBudget){10, ERROR_MAX}, &reference, &equal, &sampling).keeps);
}

// Calculated by hand, per channel: the larger square, in all lights, and half of that in each of two mirrors.
TEST(scene_bounds_its_colors)
{
    static const char text[] =
        "camera: {position: [0, 0, -4], look_at: [0, 0, 0], fov: 60}\n"
        "background: [0, 9, 0]\n"
        "ambient: [0.1, 0.1, 0.1]\n"
        "lights:\n"
        "  - point: {position: [3, 4, -5], intensity: 2}\n"
        "  - directional: {direction: [0, -1, 0.3], color: [1, 0, 0]}\n"
        "objects:\n"
        "  - plane: {point: [0, -1, 0], normal: [0, 1, 0], material: {checker: {colors: [[1, 0, 0], [0.5, 0, "
        "0.5]], size: 1},\n"
        "            specular: 100, diffuse: 0.5, reflection: 0.3, transmission: 0.2, shininess: 1.0e15}}\n";
    OwnedScene scene = scene_of_text("a.yaml", text);
    const double red = 0.1 + 3 * (0.5 + 100), blue = 0.05 + 2 * (0.25 + 100);
    for (uint32_t bounces = 0; bounces < 3; bounces++) {
        const CompileSettings settings = {
            .width = 9, .height = 9, .sample_count = 1, .lanes = 4, .bounce_count = bounces};
        OwnedCompiledScene compiled = scene_compiled(&scene, &settings);
        const double halves = 2 - pow(0.5, bounces), largest = scene_color_max(&compiled, &scene, bounces);
        assert_true(blue < red && fabs(largest / (1.01 * red * halves) - 1) < 1e-12);
    }
}

// No sample this small proves an RMSE of 1e-6, and every precision keeps one of a thousand.
TEST(pilot_chooses)
{
    if (!probe_has(PRECISION_DOUBLE)) skip();
    OwnedScene scene = scene_of_file("scenes/globe.yaml");
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_SINGLE);
    MessageList messages = {0};
    Pilot pilot;
    assert_true(
        pilot_run(&pilot, &(ErrorBudget){1e-6, ERROR_RMSE}, &probe_compute, &scene, &settings, &messages));
    assert_int_equal(pilot.chosen, PRECISION_DOUBLE);
    // 2 columns and 2 rows fill no square
    assert_int_equal(pilot.pixels, (WIDTH / 3) * (HEIGHT / 3) + WIDTH * HEIGHT - (WIDTH - 2) * (HEIGHT - 2));
    for (unsigned i = 0; i < ARITHMETIC_COUNT; i++) {
        const PilotCandidate *candidate = &pilot.candidates[i];
        assert_int_equal(candidate->status, i == PRECISION_DOUBLE ? PILOT_MEASURED : PILOT_UNTRIED);
        assert_true((candidate->pixel_seconds > 0) == (i == PRECISION_DOUBLE));
        assert_true(candidate->verdict.keeps == (i == PRECISION_DOUBLE));
    }
    assert_true(
        pilot_run(&pilot, &(ErrorBudget){1e3, ERROR_RMSE}, &probe_compute, &scene, &settings, &messages));
    assert_true(pilot.candidates[pilot.chosen].verdict.keeps);
    assert_int_equal(pilot.candidates[PRECISION_SINGLE].status, PILOT_MEASURED);
    assert_true(pilot.candidates[PRECISION_SINGLE].verdict.error < 1e-3);
    assert_int_equal(pilot.candidates[PRECISION_STRICT].status, PILOT_UNTRIED);

    // a highlight of less than a pixel may be anywhere: what is not sampled may be as bright as it
    const ErrorBudget budget = {0.1, ERROR_RMSE};
    settings = film_settings(320, 240, PRECISION_SINGLE);
    assert_true(pilot_run(&pilot, &budget, &probe_compute, &scene, &settings, &messages));
    // which is chosen is a matter of their times
    assert_true(pilot.candidates[PRECISION_SINGLE].verdict.keeps);
    assert_true(pilot.candidates[PRECISION_SINGLE].verdict.bound <= 0.1);
    for (size_t i = 0; i < scene.materials.count; i++) {
        scene.materials.items[i].specular.largest = 1000;
        scene.materials.items[i].shininess = 1e15;
    }
    assert_true(pilot_run(&pilot, &budget, &probe_compute, &scene, &settings, &messages));
    assert_int_equal(pilot.chosen, PRECISION_DOUBLE);
    assert_int_equal(pilot.candidates[PRECISION_SINGLE].status, PILOT_UNTRIED);
    assert_true(pilot.color_max > 1000);
    assert_int_equal(messages.count, 0);
}

// Float precisions warn of these sizes. A warning does not hide that a sample was stopped.
TEST(pilot_stops)
{
    if (!probe_has(PRECISION_DOUBLE)) skip();
    OwnedScene scene = scene_of_text("a.yaml", "camera: {position: [0, 0, -4], look_at: [0, 0, 0], fov: 50}\n"
                                               "objects:\n  - sphere: {center: [0, 0, 0], radius: 1}\n"
                                               "  - sphere: {center: [0, 0, -2], radius: 1.0e-13}\n");
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_SINGLE);
    settings.stop = stop_now;
    OwnedMessageList messages = {0};
    bool is_whole = false;
    for (unsigned launches = 1; !is_whole; launches++) {
        Pilot pilot;
        stop_countdown = launches;
        is_whole =
            pilot_run(&pilot, &(ErrorBudget){1, ERROR_MAX}, &probe_compute, &scene, &settings, &messages);
        assert_true(is_whole == (stop_countdown > 0));
    }
    assert_int_equal(messages.count, 0);
}

TEST_MAIN(probe_open, probe_close)
