// Tests image metrics. Expected values are computed by hand, or by the FLIP of its authors (flip-evaluator
// 1.7 of PyPI). tests/test_diff_metrics.py checks more of them.
#include "host/image/flip.h"
#include "host/image/heatmap.h"
#include "host/image/image_metrics.h"
#include "host/image/srgb.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/scene_reading.h"

enum { SIDE = 64 };

// Returns gray display values, as a PNG holds them.
static Image gray_image(unsigned step)
{
    Image image = {.width = SIDE,
                   .height = SIDE,
                   .channels = 3,
                   .values = malloc(SIDE * SIDE * 3 * sizeof(float)),
                   .display = true};
    assert_non_null(image.values);
    for (size_t i = 0; i < SIDE * SIDE * 3; i++)
        image.values[i] = (float)step / 255;
    return image;
}

TEST(equal_images)
{
    OwnedImage image = gray_image(128);
    ImageMetrics metrics = image_metrics(&image, &image);
    assert_int_equal(metrics.differing_count, 0);
    assert_int_equal(metrics.off_by_1 + metrics.off_by_more, 0);
    assert_true(isinf(metrics.linear.psnr) && isinf(metrics.srgb_psnr));
    assert_true(metrics.flip_mean == 0 && metrics.flip_max == 0 && metrics.linear.largest == 0);
}

TEST(one_black_pixel)
{
    OwnedImage plain = gray_image(128), spot = gray_image(128);
    for (size_t channel = 0; channel < 3; channel++)
        spot.values[(20 * SIDE + 40) * 3 + channel] = 0;
    ImageMetrics metrics = image_metrics(&plain, &spot);
    assert_int_equal(metrics.differing_count, 3);
    assert_int_equal(metrics.off_by_1, 0);
    assert_int_equal(metrics.off_by_more, 3);
    assert_int_equal(metrics.worst_x, 40);
    assert_int_equal(metrics.worst_y, 20);
    const double light = pow((128 / 255.0 + 0.055) / 1.055, 2.4), pixels = SIDE * SIDE;
    assert_near(metrics.linear.largest, light, 1e-7);
    assert_near(metrics.linear.rmse, light / sqrt(pixels), 1e-8);
    assert_near(metrics.linear.bias, -light / pixels, 1e-9);
    assert_true(metrics.linear.percentile_999 == 0); // 1 of 4096 is less than 0.1 %
    assert_near(metrics.linear.rel_mse, light * light / (light * light + 0.01) / pixels, 1e-9);
    assert_near(metrics.srgb_psnr, 10 * log10(pixels * 255 * 255 / (128 * 128)), 1e-9);
    assert_near(metrics.flip_mean, 0.00041315, 1e-7);
    assert_near(metrics.flip_max, 0.171734, 2e-6);
}

TEST(one_step_lighter)
{
    OwnedImage plain = gray_image(128), lighter = gray_image(129);
    ImageMetrics metrics = image_metrics(&plain, &lighter);
    assert_int_equal(metrics.off_by_1, SIDE * SIDE * 3);
    assert_int_equal(metrics.off_by_more, 0);
    assert_near(metrics.srgb_psnr, 48.1308, 1e-4);
    assert_near(metrics.flip_mean, 0.0298688, 1e-5);
    assert_near(metrics.flip_max, 0.0298688, 1e-5);
}

TEST(black_and_white)
{
    OwnedImage black = gray_image(0), white = gray_image(255);
    ImageMetrics metrics = image_metrics(&black, &white);
    assert_near(metrics.linear.psnr, 0, 1e-9);
    assert_near(metrics.linear.rel_mse, 100, 1e-9);
    assert_near(metrics.flip_mean, 0.967392, 1e-5);
}

TEST(what_is_not_finite)
{
    OwnedImage plain = gray_image(128), broken = gray_image(128);
    plain.display = broken.display = false;
    broken.values[(2 * SIDE + 7) * 3 + 1] = NAN;
    plain.values[30] = broken.values[30] = INFINITY;
    ImageMetrics metrics = image_metrics(&plain, &broken);
    assert_int_equal(metrics.differing_count, 1);
    assert_int_equal(metrics.nonfinite_reference, 1);
    assert_int_equal(metrics.nonfinite_test, 2);
    assert_int_equal(metrics.linear.count, SIDE * SIDE * 3 - 2);
    assert_true(metrics.linear.largest == 0);
    assert_int_equal(metrics.worst_x, 7);
    assert_int_equal(metrics.worst_y, 2);
    assert_true(metrics.flip_max > 0 && metrics.flip_max <= 1); // the missing number shows as none
}

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

TEST(summary_by_hand)
{
    const double expected[] = {0, 1, (double)NAN, 2, 4, 3}, found[] = {1, 1, 5, 2, 2, -(double)INFINITY};
    ErrorSummary summary = error_summarize(expected, found, 6);
    assert_int_equal(summary.count, 4);
    assert_near(summary.largest, 2, 0);
    assert_near(summary.bias, -0.25, 0);
    assert_near(summary.rmse, sqrt(1.25), 1e-15);
    assert_near(summary.psnr, -10 * log10(1.25), 1e-14);
    assert_near(summary.rel_mse, (1 / 0.01 + 4 / 16.01) / 4, 1e-13);
    assert_near(summary.percentile_999, 2, 0);
    assert_int_equal(error_summarize(expected, found, 0).count, 0);
}

TEST(percentile)
{
    enum { COUNT = 5000 };
    double expected[COUNT] = {0}, found[COUNT];
    for (int i = 0; i < COUNT; i++) // every number 1e-6 .. 5000e-6 once, in a jumble, of both signs
        found[i] = (i * 1237 % COUNT + 1) * (i % 2 ? 1e-6 : -1e-6);
    assert_near(error_summarize(expected, found, COUNT).percentile_999, 4995e-6, 1e-9);
    assert_near(error_summarize(expected, found, COUNT).largest, 5000e-6, 1e-9);
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
