// Checks the errors of images made by hand, in which the count of each type is known, and the conclusions
// from errors and times. tests/test_accuracy.py checks the same figures of rendered images against an
// independent implementation.
#include "host/measure/accuracy.h"
#include "tests/check.h"
#include "tests/scene_reading.h"

enum { WIDTH = 12, HEIGHT = 8, PIXELS = WIDTH * HEIGHT, LIGHTS = 2, NOTHING_FROM = 10 };

static size_t at(size_t x, size_t y)
{
    return y * WIDTH + x;
}

// Returns a film of object 0 in the left half, 1 in the right one, and nothing from column NOTHING_FROM on.
// The lower half lies in the shadow of light 0. All of it is gray 0.5, 8 away and seen along z.
static Film film_make(void)
{
    Film film = film_allocate(WIDTH, HEIGHT, LIGHTS, ACCURACY_AOVS);
    for (size_t i = 0; i < PIXELS; i++) {
        size_t x = i % WIDTH, y = i / WIDTH;
        bool nothing = x >= NOTHING_FROM;
        for (size_t k = 0; k < 3; k++)
            film.color[3 * i + k] = 0.5;
        film.t[i] = nothing ? (double)INFINITY : 8;
        film.normal[3 * i + 2] = nothing ? 0 : 1;
        film.object[i] = nothing ? UINT32_MAX : x < WIDTH / 2 ? 0 : 1;
        film.shadow[LIGHTS * i] = y >= HEIGHT / 2 && !nothing;
        film.path[i] = film.object[i] + 77;
    }
    return film;
}

static AccuracyErrors compare(const Film *reference, const Film *variant)
{
    AccuracyEdges edges;
    AccuracyErrors errors;
    accuracy_edges_find(&edges, reference);
    accuracy_compare(&errors, reference, &edges, variant, false);
    accuracy_edges_free(&edges);
    return errors;
}

TEST(edges)
{
    OwnedFilm film = film_make();
    AccuracyEdges edges;
    accuracy_edges_find(&edges, &film);
    // columns 4 to 7 and 8 to 11
    assert_int_equal(edges.silhouette_pixels, 8 * HEIGHT);
    assert_int_equal(edges.path_pixels, 8 * HEIGHT);
    for (size_t y = 0; y < HEIGHT; y++)
        for (size_t x = 0; x < WIDTH; x++) {
            assert_int_equal(edges.silhouette[at(x, y)], x >= 4);
            // rows 2 to 5, where something is hit, and around the lower end of what is
            bool shadow = (y >= 2 && y <= 5 && x <= NOTHING_FROM) || (y >= 3 && x >= NOTHING_FROM - 2);
            assert_int_equal(edges.shadow[LIGHTS * at(x, y)], shadow);
            assert_false(edges.shadow[LIGHTS * at(x, y) + 1]);
        }
    assert_int_equal(edges.shadow_edge_pixels[1], 0);
    accuracy_edges_free(&edges);

    // a lone pixel in a corner: itself and its two neighbors differ, and what is around these three
    memset(film.object, 0, PIXELS * sizeof *film.object);
    film.object[0] = 5;
    accuracy_edges_find(&edges, &film);
    assert_int_equal(edges.silhouette_pixels, 8);
    assert_true(edges.silhouette[at(2, 1)] && edges.silhouette[at(1, 2)] && !edges.silhouette[at(2, 2)]);
    accuracy_edges_free(&edges);
}

TEST(equal)
{
    OwnedFilm reference = film_make(), variant = film_make();
    AccuracyErrors errors = compare(&reference, &variant);
    assert_int_equal(accuracy_disqualifications(&errors), 0);
    assert_int_equal(errors.surface_pixels, NOTHING_FROM * HEIGHT);
    assert_int_equal(errors.shading_pixels, NOTHING_FROM * HEIGHT);
    assert_int_equal(errors.image.count, 3 * PIXELS);
    assert_true(errors.shading.rmse == 0 && errors.image.rmse == 0 && isinf(errors.image.psnr));
    assert_true(errors.t_relative.largest == 0 && errors.normal.largest == 0);
    for (size_t type = 0; type < ACCURACY_MEASURE_COUNT; type++)
        assert_false(errors.worst[type].found);
}

TEST(wrong_objects)
{
    OwnedFilm reference = film_make(), variant = film_make();
    variant.object[at(5, 0)] = 1;
    variant.object[at(7, 6)] = UINT32_MAX;
    variant.color[3 * at(5, 0)] = 0.9;
    AccuracyErrors errors = compare(&reference, &variant);
    assert_int_equal(errors.object.edge, 2);
    assert_int_equal(errors.object.away, 0);
    assert_int_equal(accuracy_disqualifications(&errors), 0);
    const AccuracyWorst *worst = &errors.worst[ACCURACY_OBJECT];
    assert_true(worst->found && worst->x == 5 && worst->y == 0 && !worst->away);
    assert_true(worst->reference == 0 && worst->variant == 1);
    assert_near(worst->error, 0.4, 1e-15);

    // a leak, whose color is less far off
    variant.object[at(1, 1)] = UINT32_MAX;
    variant.color[3 * at(1, 1) + 2] = 0.4;
    // what else is wrong there does not count: it is another object
    variant.shadow[LIGHTS * at(1, 1) + 1] = 1;
    variant.path[at(1, 1)] = 3;
    variant.t[at(1, 1)] = (double)INFINITY;
    errors = compare(&reference, &variant);
    assert_int_equal(errors.object.edge, 2);
    assert_int_equal(errors.object.away, 1);
    assert_int_equal(errors.shadow.edge + errors.shadow.away + errors.path.edge + errors.path.away, 0);
    assert_int_equal(errors.surface_pixels, NOTHING_FROM * HEIGHT - 3);
    assert_true(errors.t_relative.largest == 0 && errors.shading.largest == 0);
    assert_near(errors.image.largest, 0.4, 1e-15);
    assert_int_equal(accuracy_disqualifications(&errors), DISQUALIFIED_OBJECT);
    assert_true(worst->x == 1 && worst->y == 1 && worst->away && worst->variant == (double)UINT32_MAX);
    assert_true(worst->variant_color[2] == 0.4 && worst->reference_color[2] == 0.5);
}

TEST(wrong_shadows)
{
    OwnedFilm reference = film_make(), variant = film_make();
    variant.shadow[LIGHTS * at(0, 3)] = 1; // at light 0's edge
    variant.color[3 * at(0, 3)] = 0;
    AccuracyErrors errors = compare(&reference, &variant);
    assert_int_equal(errors.shadow.edge, 1);
    assert_int_equal(errors.shadow.away, 0);
    assert_int_equal(accuracy_disqualifications(&errors), 0);
    assert_int_equal(errors.shading_pixels, NOTHING_FROM * HEIGHT - 1);
    assert_true(errors.shading.largest == 0);

    variant.shadow[LIGHTS * at(5, 0) + 1] = 1; // where two objects meet
    variant.shadow[LIGHTS * at(0, 3) + 1] = 1; // not an edge of light 1
    variant.shadow[LIGHTS * at(2, 7)] = 0;     // acne, or light behind a wall
    errors = compare(&reference, &variant);
    assert_int_equal(errors.shadow.edge, 2);
    assert_int_equal(errors.shadow.away, 2);
    assert_int_equal(accuracy_disqualifications(&errors), DISQUALIFIED_SHADOW);
    const AccuracyWorst *worst = &errors.worst[ACCURACY_SHADOW];
    assert_true(worst->away && worst->x == 0 && worst->y == 3 && worst->light == 1 && worst->variant == 1);
}

TEST(wrong_paths)
{
    OwnedFilm reference = film_make(), variant = film_make();
    variant.path[at(6, 1)] = 1;
    variant.path[at(1, 1)] = 2;
    variant.path[at(2, 1)] = 2;
    variant.color[3 * at(2, 1) + 1] = 0.75;
    AccuracyErrors errors = compare(&reference, &variant);
    assert_int_equal(errors.path.edge, 1);
    assert_int_equal(errors.path.away, 2);
    assert_int_equal(accuracy_disqualifications(&errors), 0);
    assert_int_equal(errors.shading_pixels, NOTHING_FROM * HEIGHT - 3);
    assert_true(errors.shading.largest == 0 && errors.worst[ACCURACY_PATH].x == 2);
}

TEST(shading)
{
    OwnedFilm reference = film_make(), variant = film_make();
    variant.color[3 * at(0, 0)] += 0.25;
    variant.color[3 * at(3, 4) + 2] -= 0.125;
    variant.color[3 * at(11, 4)] += 0.375; // the background is not shaded
    AccuracyErrors errors = compare(&reference, &variant);
    const double values = 3.0 * NOTHING_FROM * HEIGHT, squares = 0.25 * 0.25 + 0.125 * 0.125;
    assert_near(errors.shading.largest, 0.25, 0);
    assert_near(errors.shading.rmse, sqrt(squares / values), 1e-16);
    assert_near(errors.shading.bias, 0.125 / values, 1e-16);
    assert_near(errors.shading.percentile_999, 0.25, 0); // of 240 values all are 99.9 %
    assert_near(errors.image.rmse, sqrt((squares + 0.375 * 0.375) / (3.0 * PIXELS)), 1e-16);
    const AccuracyWorst *worst = errors.worst;
    assert_true(worst[ACCURACY_SHADING].x == 0 && worst[ACCURACY_SHADING].variant == 0.75);
    assert_true(worst[ACCURACY_IMAGE].x == 11 && worst[ACCURACY_IMAGE].y == 4);
    assert_int_equal(errors.display.off_by_more, 3);
}

TEST(distances_and_normals)
{
    OwnedFilm reference = film_make(), variant = film_make();
    variant.t[at(2, 2)] = 8 + 3 * 8 * (double)FLT_EPSILON;
    // 10 degrees about y, and a tiny angle that the cosine cannot show
    const double angle = acos(-1) / 18, tiny = 1e-12;
    double *normal = variant.normal + 3 * at(4, 4);
    normal[0] = sin(angle), normal[2] = cos(angle);
    variant.normal[3 * at(5, 4) + 1] = tiny;
    AccuracyErrors errors = compare(&reference, &variant);
    assert_near(errors.t_relative.largest, 3 * (double)FLT_EPSILON, 1e-22);
    assert_near(errors.t_ulps.largest, 3, 1e-12);
    assert_near(errors.normal.largest, angle, 1e-15);
    assert_true(errors.worst[ACCURACY_T].x == 2 && errors.worst[ACCURACY_NORMAL].x == 4);
    normal[0] = 0, normal[2] = 1;
    assert_near(compare(&reference, &variant).normal.largest, tiny, 1e-24);

    // in units of double, where it was computed in double
    variant.is_double = true;
    variant.t[at(2, 2)] = 8 + 8 * DBL_EPSILON;
    assert_near(compare(&reference, &variant).t_ulps.largest, 1, 0);
    // no number is as far off as can be
    variant.t[at(2, 2)] = (double)NAN;
    normal[0] = (double)NAN;
    errors = compare(&reference, &variant);
    assert_true(isinf(errors.t_relative.largest) && isinf(errors.normal.largest));
}

TEST(unsound_pixels)
{
    OwnedFilm reference = film_make(), variant = film_make();
    variant.color[3 * at(3, 3)] = (double)NAN;
    variant.color[3 * at(3, 3) + 1] = -1; // counts for both
    variant.color[3 * at(4, 3) + 2] = -(double)INFINITY;
    variant.color[3 * at(5, 3) + 2] = -0.0;
    AccuracyErrors errors = compare(&reference, &variant);
    assert_int_equal(errors.nonfinite, 2);
    assert_int_equal(errors.negative, 2);
    assert_int_equal(accuracy_disqualifications(&errors), DISQUALIFIED_NONFINITE | DISQUALIFIED_NEGATIVE);
    assert_int_equal(errors.image.count, 3 * PIXELS - 2);
    assert_true(isfinite(errors.image.rmse) && isfinite(errors.display.flip_mean));
    assert_true(isinf(errors.worst[ACCURACY_IMAGE].error) && errors.worst[ACCURACY_IMAGE].x == 3);
}

TEST(colors_only)
{
    OwnedFilm variant = film_make(), source = film_make();
    Film reference = {.width = WIDTH, .height = HEIGHT, .color = source.color};
    variant.color[3 * at(3, 3)] = 0.75;
    AccuracyVariant compared = {.errors = compare(&reference, &variant)};
    assert_non_null(compared.errors.why_colors_only);
    assert_non_null(accuracy_figure(&compared, ACCURACY_OBJECT).why_not);
    assert_non_null(accuracy_figure(&compared, ACCURACY_SHADING).why_not);
    assert_near(accuracy_figure(&compared, ACCURACY_IMAGE).value, 0.25 / sqrt(3.0 * PIXELS), 1e-16);
    assert_null(accuracy_figure(&compared, ACCURACY_FLIP).why_not);
}

enum { VARIANTS = 5 };

TEST(pareto_front_and_picks)
{
    // time of a frame, RMSE of the shading, leaks
    static const struct {
        double seconds, rmse;
        size_t leaks;
    } given[VARIANTS] = {{1, 1e-5, 3}, {2, 1e-3, 0}, {3, 1e-5, 0}, {4, 1e-4, 0}, {9, 0, 0}};
    BenchRow rows[VARIANTS] = {0};
    AccuracyScene scene = {.variants = memory_allocate_zeroed(VARIANTS, sizeof(AccuracyVariant)),
                           .variant_count = VARIANTS};
    for (size_t i = 0; i < VARIANTS; i++) {
        series_add(&rows[i].times.frame, given[i].seconds);
        scene.variants[i] = (AccuracyVariant){.row = &rows[i]};
        scene.variants[i].errors.shading.rmse = given[i].rmse;
        scene.variants[i].errors.shading_pixels = 1;
        scene.variants[i].errors.object.away = given[i].leaks;
    }
    scene.variants[4].status = ACCURACY_REFERENCE;
    const AccuracyBudgets budgets = {.limits = {1e-2, 1e-4, 1e-6}, .count = 3};
    accuracy_classify(&scene, &budgets);
    assert_int_equal(scene.recommendation_count, 3);
    const unsigned shading = 1u << ACCURACY_SHADING;
    assert_int_equal(scene.variants[0].disqualified, DISQUALIFIED_OBJECT);
    assert_int_equal(scene.variants[0].pareto, 0);
    assert_true(scene.variants[1].pareto & shading);
    assert_true(scene.variants[2].pareto & shading);
    assert_false(scene.variants[3].pareto & shading); // slower than the third and worse
    assert_int_equal(scene.variants[4].pareto, 0);
    // all but the first have no wrong object: only the fastest of them is on that front
    assert_true(scene.variants[1].pareto & 1u << ACCURACY_OBJECT);
    assert_false(scene.variants[2].pareto & 1u << ACCURACY_OBJECT);
    assert_int_equal(scene.recommendations[0].measure, ACCURACY_SHADING);
    assert_int_equal(scene.recommendations[0].variant, 1);
    assert_int_equal(scene.recommendations[1].variant, 2);
    assert_int_equal(scene.recommendations[2].variant, 4);

    // one run tells nothing of the times
    assert_true(accuracy_ties(&scene.recommendations[0], 2) && accuracy_ties(&scene.recommendations[0], 4));
    assert_false(accuracy_ties(&scene.recommendations[0], 0) || accuracy_ties(&scene.recommendations[0], 1));
    assert_false(accuracy_ties(&scene.recommendations[1], 1));
    assert_true(scene.recommendations[0].times[2].low == 0 &&
                fabs(scene.recommendations[0].times[2].ratio - 1.5) < 1e-12);

    // 30 rounds, in which the load varies more than the times differ: the fifth takes 4.5 times as long, and
    // the fourth half a percent more or less
    for (size_t i = 0; i < VARIANTS; i++) {
        rows[i].times.frame.count = 0;
        for (size_t round = 0; round < 30; round++)
            series_add(&rows[i].times.frame, (i == 3 ? 2.01 + 0.02 * (double)(round % 2) : given[i].seconds) *
                                                 (double)(1 + round % 5));
    }
    accuracy_classify(&scene, &budgets);
    assert_int_equal(scene.recommendations[0].variant, 1);
    assert_true(accuracy_ties(&scene.recommendations[0], 3));
    assert_false(accuracy_ties(&scene.recommendations[0], 2) || accuracy_ties(&scene.recommendations[0], 4));
    const Comparison *far = &scene.recommendations[0].times[4];
    assert_true(far->low > 4.3 && far->low < 4.5 && far->high > 4.5 && far->high < 4.7);
    for (size_t i = 0; i < VARIANTS; i++) {
        rows[i].times.frame.count = 1;
        rows[i].times.frame.items[0] = given[i].seconds;
    }

    // a reference that is faster than all leaves nothing to pick but itself
    rows[4].times.frame.items[0] = 0.5;
    accuracy_classify(&scene, &budgets);
    assert_int_equal(scene.recommendations[0].variant, 4);
    assert_int_equal(scene.variants[1].pareto | scene.variants[2].pareto, 0);

    // no reference among them, and none exact enough
    scene.variants[4].status = ACCURACY_UNAVAILABLE;
    accuracy_classify(&scene, &budgets);
    assert_true(scene.recommendations[2].variant == SIZE_MAX);
    for (size_t i = 0; i < VARIANTS; i++)
        bench_times_free(&rows[i].times);
    accuracy_scene_free(&scene);
}

TEST_MAIN(NULL, NULL)
