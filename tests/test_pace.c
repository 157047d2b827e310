// How long launches get when parts of an image cost very different times: the pace alone, without a device
// or a clock.
#include "host/render/pace.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

enum { WIDTH = 640, HEIGHT = 360, ROWS_MAX = 512 };

static const double target = 0.1, cheap = 2e-8, dear = 2e-5; // seconds; of a sample: sky, glass

typedef struct {
    double longest, longest_first; // seconds of a launch, of one with which a band begins
    unsigned launches, bands;
    uint64_t samples;
} Run;

// Renders an image whose rows from `glass_row` on are glass, as renderer_render does.
static Run run(uint32_t sample_count, uint32_t glass_row)
{
    Run run = {0};
    Pace pace = {.target_seconds = target};
    for (uint32_t row = 0; row < HEIGHT;) {
        uint64_t rows = pace_band_samples(&pace) / ((uint64_t)WIDTH * sample_count);
        rows = rows < 4 ? 4 : rows > ROWS_MAX ? ROWS_MAX : rows;
        if (rows > HEIGHT - row) rows = HEIGHT - row;
        uint64_t pixels = rows * WIDTH;
        double seconds_of_sample = 0; // of all pixels
        for (uint32_t i = row; i < row + rows; i++)
            seconds_of_sample += WIDTH * (i < glass_row ? cheap : dear);
        pace_begin_band(&pace);
        for (uint32_t done = 0; done < sample_count;) {
            uint32_t samples = pace_launch_samples(&pace, pixels, sample_count - done);
            assert_in_range(samples, 1, sample_count - done);
            double seconds = seconds_of_sample * samples;
            if (seconds > run.longest) run.longest = seconds;
            pace_note_launch(&pace, pixels, samples, seconds);
            done += samples;
            run.launches++;
            run.samples += pixels * samples;
        }
        row += (uint32_t)rows;
        run.bands++;
    }
    return run;
}

// A launch of as many samples as the sky allows would take 100 s.
static void glass_below_sky_has_no_long_launch(void **state)
{
    (void)state;
    for (uint32_t glass_row = 1; glass_row <= HEIGHT; glass_row++) {
        Run got = run(64, glass_row);
        if (!(got.longest <= 3)) fail_msg("glass from row %u: a launch of %g s", glass_row, got.longest);
        assert_int_equal(got.samples, (uint64_t)WIDTH * HEIGHT * 64);
    }
}

static void rows_shrink_after_a_slow_band(void **state)
{
    (void)state;
    Pace pace = {.target_seconds = target};
    pace_begin_band(&pace);
    pace_note_launch(&pace, 100000, 1, 100000 * cheap);
    assert_in_range(pace_band_samples(&pace), 399999, 400000);
    pace_begin_band(&pace);
    pace_note_launch(&pace, 100000, 1, 100000 * dear);
    assert_in_range(pace_band_samples(&pace), 4999, 5000);
    // however few of a band's samples its last launch had
    pace_begin_band(&pace);
    pace_note_launch(&pace, 5000, 16, 80000 * cheap);
    pace_note_launch(&pace, 5000, 1, 5000 * cheap);
    assert_in_range(pace_band_samples(&pace), 339999, 340000);
}

static void launches_of_a_band_begin_small(void **state)
{
    (void)state;
    Pace pace = {.target_seconds = target};
    pace_begin_band(&pace);
    assert_int_equal(pace_launch_samples(&pace, 1000, 1000), (1 << 17) / 1000);
    assert_int_equal(pace_launch_samples(&pace, 1 << 18, 1000), 1);
    assert_int_equal(pace_launch_samples(&pace, 1, 5000), 1024);
    static const uint32_t expected[] = {1, 16, 50, 33};
    for (int band = 0; band < 3; band++) {
        pace_note_launch(&pace, 100000, 19, 19e5 * cheap);
        pace_begin_band(&pace);
        for (uint32_t i = 0, left = 100; i < 4; i++) {
            uint32_t samples = pace_launch_samples(&pace, 100000, left);
            assert_int_equal(samples, expected[i]);
            pace_note_launch(&pace, 100000, samples, 100000 * cheap * samples);
            left -= samples;
        }
    }
    // however cheap the band before was
    pace_begin_band(&pace);
    pace_note_launch(&pace, 100000, 64, 64e5 * 1e-12);
    pace_begin_band(&pace);
    assert_int_equal(pace_launch_samples(&pace, 100, 64), 1);
}

static void plain_images_have_few_launches(void **state)
{
    (void)state;
    static const uint32_t sample_counts[] = {1, 4, 16, 64, 256};
    for (size_t i = 0; i < sizeof sample_counts / sizeof *sample_counts; i++) {
        Run got = run(sample_counts[i], HEIGHT);
        double least = (double)got.samples * cheap / target;
        assert_true(got.longest <= 1.01 * target);
        if (got.launches > 20 + 3 * least)
            fail_msg("%u samples: %u launches", sample_counts[i], got.launches);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(glass_below_sky_has_no_long_launch),
        cmocka_unit_test(rows_shrink_after_a_slow_band),
        cmocka_unit_test(launches_of_a_band_begin_small),
        cmocka_unit_test(plain_images_have_few_launches),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
