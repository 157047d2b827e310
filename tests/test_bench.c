// Checks by hand what glint bench makes of times: quantiles, which clock is trusted, when runs suffice, and
// the rows of an earlier report.
#include "host/base/fault.h"
#include "host/measure/baseline.h"
#include "host/measure/bench.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/scene_reading.h"

#include <sys/mman.h>

TEST(quantiles)
{
    Series series = {0};
    assert_int_equal(series_summarize(&series).count, 0);
    const double values[] = {5, 1, 4, 2, 30};
    for (size_t i = 0; i < 5; i++)
        series_add(&series, values[i]);
    Summary five = series_summarize(&series);
    assert_true(five.min == 1 && five.median == 4 && five.max == 30 && five.count == 5);
    assert_true(five.lower_quartile == 2 && five.upper_quartile == 5);
    series_add(&series, 3);
    Summary six = series_summarize(&series);
    assert_true(six.median == 3.5 && six.lower_quartile == 2.25 && six.upper_quartile == 4.75);
    assert_true(series.items[0] == 5); // the order of the runs stays
    series_free(&series);
}

// Returns a launch on a device's clock that starts at 1000 s and runs `rate` times as fast as the host's.
static LaunchTime launch_at(double host_start, double seconds, double rate)
{
    return (LaunchTime){
        .start_seconds = 1000 + host_start * rate,
        .end_seconds = 1000 + (host_start + seconds) * rate,
        .event_seconds = seconds * rate,
        .host_seconds = seconds,
        .host_start_seconds = host_start,
    };
}

// Returns the times of runs with two launches of 10 and 20 ms, one run each 100 ms.
static BenchTimes times_make(size_t runs, double rate)
{
    BenchTimes times = {0};
    for (size_t i = 0; i < runs; i++) {
        LaunchTime first = launch_at(5 + 0.1 * (double)i, 0.010, rate);
        LaunchTime second = launch_at(5.02 + 0.1 * (double)i, 0.020, rate);
        bench_add_launch(&times, &first);
        bench_add_launch(&times, &second);
        bench_end_run(&times, 0.045, 0.06);
    }
    return times;
}

TEST(events_that_agree)
{
    OwnedBenchTimes times = times_make(30, 1.001);
    assert_null(times.clock_fault);
    assert_near(bench_kernel(&times).median, 0.030 * 1.001, 1e-12);
    assert_near(series_summarize(&times.processor).median, 0.06, 1e-12);
    assert_int_equal(bench_kernel(&times).count, 30);
    assert_true(bench_converged(&times, 30));
    assert_false(bench_converged(&times, 31));
}

TEST(clock_that_drifts)
{
    BenchTimes times = times_make(30, 1.02);
    assert_non_null(times.clock_fault);
    assert_near(bench_kernel(&times).median, 0.030, 1e-12);
    bench_times_free(&times);
    times = times_make(30, 0.98);
    assert_non_null(times.clock_fault);
    bench_times_free(&times);
    times = times_make(30, 0.991);
    assert_null(times.clock_fault);
    bench_times_free(&times);
}

// The device's clock is not blamed if the host learns late of a launch. A clock that drifts is.
TEST(stalled_launches)
{
    enum { LAUNCHES = 20 };
    static const double rates[] = {1, 1.009, 0.991, 1.02, 0.98};
    for (unsigned stalled = 0; stalled < 1u << 4; stalled++)
        for (size_t i = 0; i < COUNT_OF(rates); i++) {
            OwnedBenchTimes times = {0};
            for (unsigned k = 0; k < LAUNCHES; k++) {
                LaunchTime launch = launch_at(5 + 0.1 * k, 0.010, rates[i]);
                const unsigned which = k == 0 ? 1 : k == LAUNCHES - 1 ? 2 : k == 9 ? 4 : k % 2 ? 8 : 0;
                if (stalled & which) launch.host_seconds += 0.08;
                bench_add_launch(&times, &launch);
            }
            assert_true((times.clock_fault != NULL) == (fabs(rates[i] - 1) > 0.01));
        }
}

// One event that cannot be trusted makes the whole row use the host's clock.
TEST(event_without_times)
{
    OwnedBenchTimes times = times_make(30, 1);
    LaunchTime zeros = launch_time_classify(0, 0, 0.030, 0);
    zeros.host_start_seconds = 9;
    bench_add_launch(&times, &zeros);
    bench_end_run(&times, 0.045, 0.06);
    assert_string_equal(times.clock_fault, "the runtime reports no times for events");
    assert_near(bench_kernel(&times).min, 0.030, 1e-12);
}

// Returns the verdict on runs whose launches and processor time change by these factors after a part of them.
static Verdict drift_verdict(bool is_cpu, int run_count, double part, double launch_change,
                             double processor_change)
{
    OwnedBenchTimes times = {0};
    for (int i = 0; i < run_count; i++) {
        const bool is_late = i >= part * run_count;
        const double noise = i == run_count / 8 ? 3 : 1 + 0.002 * (i % 5); // and a run next to something else
        const LaunchTime launch = launch_at(5 + 0.1 * i, 0.03 * noise * (is_late ? launch_change : 1), 1);
        bench_add_launch(&times, &launch);
        bench_end_run(&times, 0.045, 0.06 * noise * (is_late ? processor_change : 1));
    }
    const Comparison drift = bench_drift(&times, is_cpu, 10);
    return drift.verdict;
}

TEST(drift)
{
    enum { RUNS = 90, FEW = 20 };
    for (int percent = 20; percent <= 80; percent += 20) {
        assert_int_equal(drift_verdict(false, RUNS, percent / 100.0, 1.2, 1), VERDICT_SLOWER);
        assert_int_equal(drift_verdict(false, RUNS, percent / 100.0, 0.8, 1), VERDICT_FASTER);
        assert_int_equal(drift_verdict(true, RUNS, percent / 100.0, 1, 1.2), VERDICT_SLOWER);
        assert_int_equal(drift_verdict(true, RUNS, percent / 100.0, 2, 1), VERDICT_SAME);
        assert_int_equal(drift_verdict(false, RUNS, percent / 100.0, 1.04, 2), VERDICT_SAME);
    }
    assert_int_equal(drift_verdict(false, FEW, 0.5, 1.2, 1), VERDICT_UNDECIDED);
    assert_int_equal(bench_drift(&(BenchTimes){0}, true, 1).verdict, VERDICT_UNDECIDED);
}

TEST(runs_that_scatter)
{
    OwnedBenchTimes times = {0};
    for (int i = 0; i < 40; i++) {
        LaunchTime launch = launch_at(i, i % 2 ? 0.010 : 0.011, 1);
        bench_add_launch(&times, &launch);
        bench_end_run(&times, 0.045, 0.06);
    }
    assert_false(bench_converged(&times, 20));
}

static BenchRow row_make(void)
{
    BenchRow row = {
        .key = {"scenes/a.yaml", "single", "auto", NULL, 16, 40, 30, 4, 5, 0xabcdef0123456789},
        .times = times_make(30, 1),
        .rays = {1200, 900, 100, 200, 1500},
    };
    return row;
}

TEST(figures)
{
    BenchRow row = row_make();
    assert_near(bench_rays_per_second(&row), (1200 + 100 + 200 + 1500) / 0.030, 1e-3);
    bench_row_free(&row);
}

static long allocations_left = -1; // before one fails

void *__real_malloc(size_t size);
void *__wrap_malloc(size_t size);

void *__wrap_malloc(size_t size)
{
    const bool fails = allocations_left == 0;
    if (allocations_left >= 0) allocations_left--;
    return fails ? NULL : __real_malloc(size);
}

static Baseline *baseline_of(const char *text, size_t *error_count)
{
    char path[32];
    int descriptor = memfd_create("baseline", 0);
    assert_true(descriptor >= 0);
    assert_int_equal(write(descriptor, text, strlen(text)), strlen(text));
    snprintf(path, sizeof path, "/proc/self/fd/%d", descriptor);
    OwnedMessageList messages = {0};
    Baseline *baseline = baseline_open(path, true, &messages);
    *error_count = message_count(&messages, MESSAGE_ERROR);
    if (*error_count) {
        const Message *message = &messages.items[0];
        assert_non_null(strstr(message->text, message->file ? "not a report of glint bench --json: " : path));
        if (message->file) assert_string_equal(message->file, path);
    }
    close(descriptor);
    return baseline;
}

#define BASELINE_ROW(hash, frames)                                                                           \
    "{\"scene\": \"elsewhere.yaml\", \"scene_hash\": \"" hash                                                \
    "\", \"precision\": \"single\", \"lanes\": 16, \"bvh\": \"auto\", \"samples\": 4, \"bounces\": 5, "      \
    "\"size\": [40, 30], \"frame_samples_ms\": " frames ", \"processor_samples_ms\": [7, 8]}"
#define ROW_HASH "abcdef0123456789"
// The start of a report.
#define BASELINE_HEAD "{\"schema\": 6, \"calibration\": {\"rounds\": 1048576}, "

TEST(baseline)
{
    size_t errors;
    Baseline *baseline =
        baseline_of("{\"schema\": 6, \"device\": {\"name\": \"d\"}, \"host\": {\"name\": \"h\"}, "
                    "\"calibration\": {\"rounds\": 1048576, \"samples_ms\": [1, 1.5], "
                    "\"processor_samples_ms\": [2, 2.5]}, \"runs\": [" BASELINE_ROW(
                        "0000000000000000", "[1, 1]") "," BASELINE_ROW(ROW_HASH, "[90, 91.5]") "]}",
                    &errors);
    assert_non_null(baseline);
    assert_string_equal(baseline->device, "d");
    assert_string_equal(baseline->host, "h");
    BenchRow row = row_make();
    ReportTimes wall, processor;
    assert_true(baseline_find(baseline, &row.key, &wall, &processor));
    assert_true(wall.frame->count == 2 && wall.calibration->count == 2);
    assert_near(wall.frame->items[1], 0.0915, 1e-12);
    assert_near(wall.calibration->items[1], 0.0015, 1e-12);
    assert_true(processor.frame->count == 2 && processor.calibration->count == 2);
    assert_near(processor.frame->items[1], 0.008, 1e-12);
    assert_near(processor.calibration->items[1], 0.0025, 1e-12);
    BenchKey others[7];
    for (int i = 0; i < 7; i++)
        others[i] = row.key;
    others[0].lanes = 8;
    others[1].samples = 1;
    others[2].bounces = 4;
    others[3].scene_hash++;
    others[4].precision = "double";
    others[5].height = 31;
    others[6].variant = "--work-group 4x4";
    for (int i = 0; i < 7; i++)
        assert_false(baseline_find(baseline, &others[i], &wall, &processor));
    baseline_close(baseline);
    bench_row_free(&row);
}

static void check_refused(const char *text)
{
    size_t errors;
    assert_null(baseline_of(text, &errors));
    assert_int_equal(errors, 1);
}

TEST(broken_baselines)
{
    BenchRow row = row_make();
    const char *refused[] = {"",
                             "no json: [",
                             "[1, 2]",
                             "{\"schema\": 5, \"runs\": []}",
                             "{\"schema\": \"6\", \"runs\": []}",
                             "{\"runs\": []}",
                             "\"",
                             "4",
                             "null",
                             "{\"schema\": 6}",
                             "{\"schema\": 6, \"runs\": 3}",
                             "{\"schema\": 6, \"runs\": {}}",
                             "{\"schema\": 6, \"runs\": []} {}",
                             "{\"schema\": 6, \"runs\": [],}",
                             "{'schema': 5, 'runs': []}",
                             "{\"schema\": 6, \"schema\": 6, \"runs\": []}",
                             "{\"schema\": 6, \"runs\": [1e999]}",
                             "{\"schema\": 6, \"runs\": [99999999999999999999]}",
                             "{\"schema\": 6, \"runs\": [NaN]}",
                             "{\"schema\": 6, \"runs\": [\"\xFF\"]}",
                             "{\"schema\": 6, \"runs\": [\"\n\"]}",
                             "{\"schema\": 6, \"runs\": [\"\\u0000\"]}",
                             "{\"schema\": 6, \"runs\": [\"\\uD800\"]}"};
    for (size_t i = 0; i < COUNT_OF(refused); i++)
        check_refused(refused[i]);
    // cut short anywhere
    char whole[] = BASELINE_HEAD "\"runs\": [" BASELINE_ROW(ROW_HASH, "[1.5e0, 2]") "]}";
    for (size_t i = sizeof whole - 1; i-- > 0;) {
        whole[i] = '\0';
        check_refused(whole);
    }
    // nested 100,000 levels deep
    char deep[100001] = "";
    memset(deep, '[', sizeof deep - 1);
    check_refused(deep);
    // rows without figures are never found
    const char *empty[] = {BASELINE_HEAD "\"runs\": [3, null, {}, [], {\"size\": 4}]}",
                           BASELINE_HEAD "\"runs\": [" BASELINE_ROW(ROW_HASH, "{}") "]}",
                           BASELINE_HEAD "\"runs\": [" BASELINE_ROW(ROW_HASH, "[]") "]}",
                           BASELINE_HEAD "\"runs\": [" BASELINE_ROW(ROW_HASH, "[1, 0]") "]}",
                           BASELINE_HEAD "\"runs\": [" BASELINE_ROW(ROW_HASH, "[1, -1e308]") "]}",
                           BASELINE_HEAD "\"runs\": [" BASELINE_ROW(ROW_HASH, "[1, \"2\"]") "]}",
                           BASELINE_HEAD "\"runs\": [" BASELINE_ROW(ROW_HASH, "[1, null]") "]}"};
    for (size_t i = 0; i < COUNT_OF(empty); i++) {
        size_t errors;
        ReportTimes wall, processor;
        Baseline *baseline = baseline_of(empty[i], &errors);
        assert_non_null(baseline);
        assert_string_equal(baseline->device, "");
        assert_false(baseline_find(baseline, &row.key, &wall, &processor));
        baseline_close(baseline);
    }
    bench_row_free(&row);
}

static void baseline_read(void *left)
{
    size_t errors;
    allocations_left = *(long *)left;
    baseline_close(baseline_of(BASELINE_HEAD "\"runs\": [" BASELINE_ROW(ROW_HASH, "[1, 2]") "]}", &errors));
    *(long *)left = allocations_left;
}

TEST(baseline_without_memory)
{
    assert_true(failures_without_memory(baseline_read) >= 25); // values and keys of the report
}

TEST_MAIN(NULL, NULL)
