// Tests what image metrics have beyond the report of glint diff, whose values test_diff.py checks, and heat
// maps.
#include "host/image/heatmap.h"
#include "host/image/image_metrics.h"
#include "host/image/srgb.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/scene_reading.h"

TEST(zeros_of_two_signs_differ)
{
    float plus = 0, minus = -0.0F;
    Image a = {.width = 1, .height = 1, .channels = 1, .values = &plus}, b = a;
    b.values = &minus;
    ImageMetrics metrics = image_metrics(&a, &b);
    assert_int_equal(metrics.differing_count, 1);
    assert_true(metrics.linear.largest == 0);
    assert_false(metrics.has_color);
}

TEST(distance_in_ulp)
{
    const double inf = (double)INFINITY, nan = (double)NAN;
    assert_true(ulp_distance(1, 1 + 0x1p-23, false) == 1 && ulp_distance(1, 1 - 0x1p-24, false) == 0.5);
    assert_true(ulp_distance(-2, -2 - 0x1p-51, true) == 1);
    assert_true(ulp_distance(0, 0x1p-149, false) == 1 && ulp_distance(0x1p-140, 0, false) == 0x1p9);
    assert_true(ulp_distance(0, -0x1p-1074, true) == 1 && ulp_distance(0, -0.0, true) == 0);
    assert_true(ulp_distance(inf, inf, true) == 0 && ulp_distance(nan, -nan, true) == 0);
    assert_true(isinf(ulp_distance(inf, -inf, true)) && isinf(ulp_distance(1, nan, true)));
}

TEST(errors_of_what_is_not_finite)
{
    const double inf = (double)INFINITY, nan = (double)NAN;
    assert_true(value_error(inf, inf) == 0 && value_error(nan, nan) == 0);
    assert_true(isinf(value_error(inf, -inf)) && isinf(value_error(nan, inf)) && isinf(value_error(1, nan)));
}

TEST(summary_of_nothing)
{
    assert_int_equal(error_summarize(NULL, NULL, 0).count, 0);
}

TEST(images_that_do_not_compare)
{
    float value[3] = {0};
    Image image = {.width = 1, .height = 1, .channels = 3, .values = value}, other = image;
    OwnedMessageList messages = {0};
    assert_true(image_comparable(&image, &other, &messages));
    other.display = true;
    assert_false(image_comparable(&image, &other, &messages));
    other = image;
    other.channels = 1;
    assert_false(image_comparable(&image, &other, &messages));
    assert_int_equal(message_count(&messages, MESSAGE_ERROR), 2);
}

// Green's construction keeps .30 R + .59 G + .11 B at the fraction wherever no channel is clipped.
TEST(heatmap_rises)
{
    float color[3];
    double last = -1;
    for (int i = 0; i <= 1000; i++) {
        heatmap_color(i / 1000.0, color);
        double brightness = 0.30 * (double)color[0] + 0.59 * (double)color[1] + 0.11 * (double)color[2];
        assert_true(brightness > last);
        assert_near(brightness, i / 1000.0, 0.02);
        last = brightness;
    }
    assert_near((double)color[0] + (double)color[1] + (double)color[2], 3, 1e-6);
}

TEST(heatmaps_look_alike_in_every_format)
{
    static const char *const paths[] = {"map.png", "map.exr", "map.npy"};
    const float errors[] = {1, 0.1F, 0.01F, INFINITY};
    float expected[COUNT_OF(errors)][3];
    for (size_t i = 0; i < COUNT_OF(paths); i++) {
        OwnedMessageList messages = {0};
        OwnedImage image;
        assert_true(heatmap_write(paths[i], errors, COUNT_OF(errors), 1, 1, &messages));
        assert_true(image_read(&image, paths[i], NULL, &messages));
        for (size_t k = 0; k < COUNT_OF(errors); k++) {
            float color[3];
            image_light(&image, k, image.display, i == 0 ? expected[k] : color);
            for (int channel = 0; i > 0 && channel < 3; channel++)
                assert_float_equal(color[channel], expected[k][channel], 0.005F);
        }
    }
}

TEST_MAIN(folder_open, folder_close)
