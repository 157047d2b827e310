// Tests how long launches take if parts of an image have very different costs. Only the pace is tested,
// without a device or a clock.
#include "host/render/launch_range.h"
#include "tests/check.h"

enum { WIDTH = 640, HEIGHT = 360, ROWS_MAX = 512, FIRST_LAUNCH = 4096, GROWTH_MAX = 4 };

static const double target = 0.1, cheap = 2e-8, dear = 2e-5; // seconds; of a sample: sky, glass

typedef struct {
    double longest; // seconds of a launch
    unsigned launches, bands;
    uint64_t samples, largest_first, last_launch;
} Run;

// Launches rows of the image, as samples_render does, with whole rows as groups. Those from `glass_row` on
// are glass.
static void sweep_run(Run *run, Pace *pace, uint32_t first_row, uint32_t rows, uint32_t samples,
                      uint32_t glass_row)
{
    for (uint32_t done = 0, part; done < rows; done += part) {
        const uint64_t most = pace_launch_samples(pace);
        part = (uint32_t)(most / samples / WIDTH);
        part = part < 1 ? 1 : part > rows - done ? rows - done : part;
        const uint64_t launched = (uint64_t)part * WIDTH * samples;
        double seconds = 0;
        for (uint32_t row = first_row + done; row < first_row + done + part; row++)
            seconds += (double)WIDTH * samples * (row < glass_row ? cheap : dear);
        if (run->launches == 0) assert_true(launched >= 1 && launched <= FIRST_LAUNCH);
        const uint64_t allowed = GROWTH_MAX * run->last_launch;
        if (run->launches > 0)
            assert_true(launched >= 1 && launched <= (allowed > FIRST_LAUNCH ? allowed : FIRST_LAUNCH));
        run->last_launch = launched;
        run->launches++;
        run->samples += launched;
        if (seconds > run->longest) run->longest = seconds;
        pace_record_launch(pace, launched, seconds);
    }
}

// Renders an image whose rows from `glass_row` on are glass, as renderer_render does.
static Run run(uint32_t sample_count, uint32_t glass_row)
{
    Run run = {0};
    Pace pace = {.target_seconds = target};
    for (uint32_t row = 0; row < HEIGHT;) {
        uint64_t rows = pace_band_samples(&pace) / ((uint64_t)WIDTH * sample_count);
        rows = rows < 4 ? 4 : rows > ROWS_MAX ? ROWS_MAX : rows;
        if (rows > HEIGHT - row) rows = HEIGHT - row;
        pace_begin_band(&pace);
        for (uint32_t done = 0; done < sample_count;) {
            const uint32_t samples = pace_begin_sweep(&pace, rows * WIDTH, sample_count - done);
            assert_true(samples >= 1 && samples <= sample_count - done);
            sweep_run(&run, &pace, row, (uint32_t)rows, samples, glass_row);
            done += samples;
        }
        row += (uint32_t)rows;
        run.bands++;
    }
    return run;
}

// A launch of as many samples as the sky allows would take 100 s.
TEST(glass_below_sky_has_no_long_launch)
{
    static const uint32_t sample_counts[] = {1, 64};
    for (size_t i = 0; i < COUNT_OF(sample_counts); i++)
        for (uint32_t glass_row = 1; glass_row <= HEIGHT; glass_row++) {
            Run got = run(sample_counts[i], glass_row);
            // the rows of glass below sky in a launch that would take a quarter of the target if all were sky
            if (!(got.longest <= 2.6))
                fail_msg("glass from row %u: a launch of %g s", glass_row, got.longest);
            assert_int_equal(got.samples, (uint64_t)WIDTH * HEIGHT * sample_counts[i]);
        }
}

TEST(rows_shrink_after_a_slow_band)
{
    Pace pace = {.target_seconds = target};
    pace_begin_band(&pace);
    pace_record_launch(&pace, 100000, 100000 * cheap);
    assert_true(pace_band_samples(&pace) >= 399999 && pace_band_samples(&pace) <= 400000);
    pace_begin_band(&pace);
    pace_record_launch(&pace, 100000, 100000 * dear);
    assert_true(pace_band_samples(&pace) >= 4999 && pace_band_samples(&pace) <= 5000);
    // however few of a band's samples its last launch had
    pace_begin_band(&pace);
    pace_record_launch(&pace, 80000, 80000 * cheap);
    pace_record_launch(&pace, 5000, 5000 * cheap);
    assert_true(pace_band_samples(&pace) >= 339999 && pace_band_samples(&pace) <= 340000);
}

TEST(launches_begin_small)
{
    Pace pace = {.target_seconds = target};
    pace_begin_band(&pace);
    assert_int_equal(pace_launch_samples(&pace), FIRST_LAUNCH);
    assert_int_equal(pace_begin_sweep(&pace, 1000, 1000), FIRST_LAUNCH / 1000);
    assert_int_equal(pace_begin_sweep(&pace, 1 << 18, 1000), 1);
    assert_int_equal(pace_begin_sweep(&pace, 1, 5000), 1024);
    // a first sweep of one sample per pixel, then four times as many per sweep, up to the target
    static const uint32_t expected[] = {1, 4, 16, 50, 29};
    for (int band = 0; band < 3; band++) {
        pace_record_launch(&pace, 1900000, 19e5 * cheap);
        pace_begin_band(&pace);
        for (uint32_t i = 0, left = 100; i < 5; i++) {
            const uint32_t samples = pace_begin_sweep(&pace, 100000, left);
            assert_int_equal(samples, expected[i]);
            pace_record_launch(&pace, (uint64_t)100000 * samples, 100000 * cheap * samples);
            left -= samples;
        }
    }
    // however cheap the band before was
    pace_begin_band(&pace);
    pace_record_launch(&pace, 6400000, 64e5 * 1e-12);
    pace_begin_band(&pace);
    assert_int_equal(pace_begin_sweep(&pace, 100, 64), 1);
}

// The device is kept busy where that makes launches longer than the target, but not in the first ones.
TEST(busy_device_grows_by_four)
{
    Pace pace = {.target_seconds = target, .samples_min = 50000};
    pace_begin_band(&pace);
    static const uint64_t expected[] = {4096, 16384, 50000, 50000};
    for (size_t i = 0; i < COUNT_OF(expected); i++) {
        assert_int_equal(pace_launch_samples(&pace), expected[i]);
        pace_record_launch(&pace, expected[i], (double)expected[i] * dear);
    }
    // a launch that is smaller than the first does not reduce the next start
    pace_record_launch(&pace, 1, 1e-9);
    assert_int_equal(pace_launch_samples(&pace), FIRST_LAUNCH);
}

TEST(plain_images_have_few_launches)
{
    static const uint32_t sample_counts[] = {1, 4, 16, 64, 256};
    for (size_t i = 0; i < COUNT_OF(sample_counts); i++) {
        Run got = run(sample_counts[i], HEIGHT);
        double least = (double)got.samples * cheap / target;
        assert_true(got.longest <= 1.01 * target);
        if (got.launches > 20 + 5 * least)
            fail_msg("%u samples: %u launches", sample_counts[i], got.launches);
    }
}

// Every pixel is in one part of a range, no part is larger than allowed, and rows that are too wide are
// split.
TEST(parts_cover_a_range)
{
    static const uint32_t sizes[][2] = {{1, 1}, {3840, 2160}, {3840, 8}, {1921, 1083}, {7, 500}, {100000, 3}};
    static const size_t groups[] = {1, 8};
    static const TileShape item_shapes[] = {{1, 1}, {16, 16}};
    for (size_t i = 0; i < COUNT_OF(sizes); i++)
        for (size_t j = 0; j < 4; j++) {
            const TileShape item = item_shapes[j / 2];
            const size_t side = groups[j % 2];
            const LaunchRange whole = {.band = {{0, 0, sizes[i][0], sizes[i][1]}},
                                       .item = item,
                                       .items = {(sizes[i][0] + item.width - 1) / item.width,
                                                 (sizes[i][1] + item.height - 1) / item.height},
                                       .group = {side, side}};
            const uint64_t group_pixels = (uint64_t)side * side * item.width * item.height;
            uint64_t covered = 0, most = FIRST_LAUNCH;
            size_t column = 0, row = 0;
            for (LaunchRange part = {0}; launch_range_next(&part, &whole, most); most *= GROWTH_MAX) {
                assert_int_equal(part.first[0], column);
                assert_int_equal(part.first[1], row);
                assert_int_equal(part.first[0] % side, 0);
                assert_true(launch_range_pixels(&part) >= 1 &&
                            launch_range_pixels(&part) <= (most > group_pixels ? most : group_pixels));
                covered += launch_range_pixels(&part);
                column += part.items[0];
                if (column < whole.items[0]) continue;
                column = 0;
                row += part.items[1];
            }
            assert_int_equal(row, whole.items[1]);
            assert_int_equal(covered, (uint64_t)sizes[i][0] * sizes[i][1]);
        }
}

TEST_MAIN(NULL, NULL)
