// What glint bench makes of times, worked out by hand: quantiles, which clock is believed, when runs suffice,
// and the ratios to an earlier report.
#include "host/measure/baseline.h"
#include "host/measure/bench.h"
#include "host/measure/work.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance)) fail_msg("%.17g, expected %.17g", value, expected);
}

static void test_quantiles(void **state)
{
    (void)state;
    Series series = {0};
    assert_int_equal(series_summarize(&series).count, 0);
    const double values[] = {5, 1, 4, 2, 30};
    for (size_t i = 0; i < 5; i++)
        series_add(&series, values[i]);
    Summary five = series_summarize(&series);
    assert_true(five.min == 1 && five.median == 4 && five.max == 30 && five.quartile_range == 3 &&
                five.count == 5);
    series_add(&series, 3);
    Summary six = series_summarize(&series);
    assert_true(six.median == 3.5 && six.quartile_range == 4.75 - 2.25);
    assert_true(series.items[0] == 5); // the order of the runs stays
    series_free(&series);
}

// A launch on a device's clock that starts at 1000 s and runs `rate` times as fast as the host's.
static LaunchTime launch_at(double host_start, double seconds, double rate)
{
    return (LaunchTime){
        .start_seconds = 1000 + host_start * rate,
        .end_seconds = 1000 + (host_start + seconds) * rate,
        .event_seconds = seconds * rate,
        .host_seconds = seconds,
        .host_start_seconds = host_start,
        .trusted = true,
    };
}

// Runs of two launches of 10 and 20 ms, one each 100 ms.
static BenchTimes times_make(size_t runs, double rate)
{
    BenchTimes times = {0};
    for (size_t i = 0; i < runs; i++) {
        LaunchTime first = launch_at(5 + 0.1 * (double)i, 0.010, rate);
        LaunchTime second = launch_at(5.02 + 0.1 * (double)i, 0.020, rate);
        bench_add_launch(&times, &first);
        bench_add_launch(&times, &second);
        bench_end_run(&times, 0.045);
    }
    return times;
}

static void test_events_that_agree(void **state)
{
    (void)state;
    BenchTimes times = times_make(30, 1.001);
    assert_null(bench_doubt(&times));
    assert_near(bench_kernel(&times).median, 0.030 * 1.001, 1e-12);
    assert_int_equal(bench_kernel(&times).count, 30);
    assert_true(bench_converged(&times, 30));
    assert_false(bench_converged(&times, 31));
    bench_times_free(&times);
}

static void test_clock_that_drifts(void **state)
{
    (void)state;
    BenchTimes times = times_make(30, 1.02);
    assert_non_null(bench_doubt(&times));
    assert_near(bench_kernel(&times).median, 0.030, 1e-12);
    bench_times_free(&times);
    times = times_make(5, 1.02); // half a second is too short to say
    assert_null(bench_doubt(&times));
    bench_times_free(&times);
}

// One event that cannot be believed, and the whole row goes by the host's clock.
static void test_event_without_times(void **state)
{
    (void)state;
    BenchTimes times = times_make(30, 1);
    LaunchTime zeros = {.host_seconds = 0.030, .host_start_seconds = 9};
    bench_add_launch(&times, &zeros);
    bench_end_run(&times, 0.045);
    assert_string_equal(bench_doubt(&times), "the runtime reports no times for events");
    assert_near(bench_kernel(&times).min, 0.030, 1e-12);
    bench_times_free(&times);
}

static void test_runs_that_scatter(void **state)
{
    (void)state;
    BenchTimes times = {0};
    for (int i = 0; i < 40; i++) {
        LaunchTime launch = launch_at(i, i % 2 ? 0.010 : 0.011, 1);
        bench_add_launch(&times, &launch);
        bench_end_run(&times, 0.045);
    }
    assert_false(bench_converged(&times, 20));
    bench_times_free(&times);
}

static BenchRow row_make(void)
{
    BenchRow row = {
        .key = {"scenes/a \"b\".yaml", "single", "auto", 16, 40, 30},
        .times = times_make(30, 1),
        .rays = {1200, 900, 100, 200, 1500},
        .flops_per_ray = 50,
        .image_bytes = 1200 * 12,
    };
    return row;
}

static void test_figures(void **state)
{
    (void)state;
    BenchRow row = row_make();
    Peak peak = {.flops_per_second = {1e8, 0}, .bytes_per_second = 4.8e6};
    assert_near(bench_rays_per_second(&row), (1200 + 100 + 200 + 1500) / 0.030, 1e-3);
    assert_null(bench_peak_fraction(&row, &peak).why_not);
    assert_near(bench_peak_fraction(&row, &peak).value, 1500 * 50 / 0.030 / 1e8, 1e-9);
    assert_near(bench_bandwidth_fraction(&row, &peak), 0.1, 1e-9);
    row.traverses_bvh = true;
    assert_non_null(bench_peak_fraction(&row, &peak).why_not);
    bench_row_free(&row);
}

static void test_work_of_a_scene(void **state)
{
    (void)state;
    Object objects[] = {{.kind = SHAPE_SPHERE}, {.kind = SHAPE_SPHERE}, {.kind = SHAPE_MESH}};
    Mesh mesh = {.triangle_count = 10};
    Scene scene = {.objects = {objects, 3, 3}, .meshes = {&mesh, 1, 1}};
    Scene spheres = {.objects = {objects, 2, 2}};
    double sphere = work_flops_per_ray(&spheres) / 2;
    objects[0].kind = SHAPE_TRIANGLE;
    double triangle = work_flops_per_ray(&spheres) - sphere;
    assert_true(sphere > 0 && triangle > 0);
    assert_near(work_flops_per_ray(&scene), triangle + sphere + 10 * triangle, 0);
}

static Baseline *baseline_of(const char *text, size_t *error_count)
{
    char path[] = "/tmp/glint-baseline-XXXXXX";
    int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    assert_int_equal(write(descriptor, text, strlen(text)), strlen(text));
    close(descriptor);
    MessageList messages = {0};
    Baseline *baseline = baseline_open(path, &messages);
    *error_count = message_count(&messages, MESSAGE_ERROR);
    message_list_free(&messages);
    unlink(path);
    return baseline;
}

#define BASELINE_ROW(scene, frame)                                                                           \
    "{\"scene\": \"" scene "\", \"precision\": \"single\", \"lanes\": 16, \"bvh\": \"auto\", "               \
    "\"size\": [40, 30], \"frame_ms\": " frame ", \"kernel_ms\": {\"median\": 15.0}}"

static void test_baseline(void **state)
{
    (void)state;
    BenchRow row = row_make();
    size_t errors;
    Baseline *baseline =
        baseline_of("{\"schema\": 3, \"device\": {\"name\": \"d\"}, \"runs\": [" BASELINE_ROW(
                        "other.yaml", "{\"median\": 1}") "," BASELINE_ROW("scenes/a \\\"b\\\".yaml",
                                                                          "{\"median\": 90}") "]}",
                    &errors);
    assert_non_null(baseline);
    assert_string_equal(baseline_device(baseline), "d");
    Ratio ratio = baseline_ratio(baseline, &row);
    assert_true(ratio.found);
    assert_near(ratio.frame, 0.5, 1e-12);
    assert_near(ratio.kernel, 2, 1e-12);
    row.key.lanes = 8;
    assert_false(baseline_ratio(baseline, &row).found);
    baseline_close(baseline);
    bench_row_free(&row);
}

static void test_broken_baselines(void **state)
{
    (void)state;
    BenchRow row = row_make();
    const char *refused[] = {"",
                             "no json: [",
                             "[1, 2]",
                             "{\"schema\": 1, \"runs\": []}",
                             "{\"runs\": []}",
                             "\"",
                             "{\"schema\": 3}",
                             "{\"schema\": 3, \"runs\": 3}"};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        size_t errors;
        assert_null(baseline_of(refused[i], &errors));
        assert_int_equal(errors, 1);
    }
    // rows that say nothing are never found
    const char *empty[] = {"{\"schema\": 3, \"runs\": [3, null, {}, [], {\"size\": 4}]}",
                           "{\"schema\": 3, \"runs\": [" BASELINE_ROW("scenes/a \\\"b\\\".yaml",
                                                                      "{\"status\": \"unavailable\"}") "]}"};
    for (size_t i = 0; i < 2; i++) {
        size_t errors;
        Baseline *baseline = baseline_of(empty[i], &errors);
        assert_non_null(baseline);
        assert_string_equal(baseline_device(baseline), "");
        assert_false(baseline_ratio(baseline, &row).found);
        baseline_close(baseline);
    }
    bench_row_free(&row);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quantiles),         cmocka_unit_test(test_events_that_agree),
        cmocka_unit_test(test_clock_that_drifts), cmocka_unit_test(test_event_without_times),
        cmocka_unit_test(test_runs_that_scatter), cmocka_unit_test(test_figures),
        cmocka_unit_test(test_work_of_a_scene),   cmocka_unit_test(test_baseline),
        cmocka_unit_test(test_broken_baselines),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
