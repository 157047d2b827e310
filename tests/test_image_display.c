// Tests exposure, the tone curve and the dither of PNG and PPM.
#include "host/image/display.h"
#include "tests/check.h"
#include "tests/files.h"

enum { SIDE = 8 };

static uint8_t shown(float value, const ImageHeader *settings)
{
    ImageHeader header = *settings;
    header.width = header.channels = 1;
    header.bits = 8;
    uint8_t byte;
    display_rows(&byte, &value, &header, 0, 1);
    return byte;
}

// The curve's values are those of Python's fractions, rounded to 10 digits.
TEST(filmic_curve)
{
    static const double points[][2] = {{0, 0},
                                       {0.01, 0.0037702798},
                                       {0.18, 0.2668989204},
                                       {1, 0.8037974684},
                                       {4, 0.9734171097},
                                       {7.25, 1},
                                       {1e30, 1},
                                       {-3, 0}};
    for (size_t i = 0; i < COUNT_OF(points); i++)
        assert_true(fabs(tone_apply(points[i][0], TONE_FILMIC) - points[i][1]) < 1e-10);
    assert_true(tone_apply(INFINITY, TONE_FILMIC) == 1);
    assert_true(tone_apply(NAN, TONE_FILMIC) == 0);
    for (int i = 0; i < 10240; i++)
        assert_true(tone_apply(i / 1024.0, TONE_FILMIC) <= tone_apply((i + 1) / 1024.0, TONE_FILMIC));
}

// A stop doubles the light before the curve.
TEST(exposure)
{
    for (int tone = TONE_NONE; tone < TONE_COUNT; tone++)
        for (int i = 0; i < 400; i++) {
            const float value = 0.01F * (float)i;
            const ImageHeader none = {.tone = (Tone)tone}, two = {.tone = (Tone)tone, .exposure = 2},
                              less = {.tone = (Tone)tone, .exposure = -1},
                              part = {.tone = (Tone)tone, .exposure = 0.5};
            assert_int_equal(shown(value, &two), shown(4 * value, &none));
            assert_int_equal(shown(value, &less), shown(value / 2, &none));
            assert_int_equal(shown(value, &part), shown(value * sqrtf(2), &none));
        }
    const ImageHeader one = {.exposure = 1};
    assert_int_equal(shown(NAN, &one), 0);
    assert_int_equal(shown(FLT_MAX, &one), 255);
}

// Fills 8 by 8 pixels with a value and writes their display values.
static void block_show(uint8_t bytes[SIDE * SIDE], float value, Transfer transfer, bool dither)
{
    const ImageHeader header = {
        .width = SIDE, .channels = 1, .transfer = transfer, .bits = 8, .dither = dither};
    float values[SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++)
        values[i] = value;
    display_rows(bytes, values, &header, 0, SIDE);
}

// A block's mean is the exact display value to 1/64 of a step, or half a step of 16 bits, and it has two
// neighboring values at most.
TEST(dither_keeps_the_mean)
{
    uint8_t bytes[SIDE * SIDE];
    for (int k = 0; k <= 1400; k++) {
        const float value = (float)k / 1400;
        block_show(bytes, value, TRANSFER_NONE, true);
        unsigned sum = 0, least = 255, most = 0;
        for (int i = 0; i < SIDE * SIDE; i++) {
            sum += bytes[i];
            least = bytes[i] < least ? bytes[i] : least;
            most = bytes[i] > most ? bytes[i] : most;
        }
        assert_true(most - least <= 1);
        assert_true(fabs(sum / 64.0 - 255.0 * (double)value) <= 1 / 64.0 + 1 / 257.0);
    }
}

TEST(dither_keeps_exact_values)
{
    uint8_t bytes[SIDE * SIDE];
    for (int k = 0; k <= 255; k++) {
        block_show(bytes, (float)k / 255, TRANSFER_NONE, true);
        for (int i = 0; i < SIDE * SIDE; i++)
            assert_int_equal(bytes[i], k);
    }
    block_show(bytes, INFINITY, TRANSFER_SRGB, true);
    assert_int_equal(bytes[63], 255);
    block_show(bytes, -1, TRANSFER_SRGB, true);
    assert_int_equal(bytes[63], 0);
}

// The pixels of half a step form a checkerboard, and those of a quarter every other one of its dark fields.
TEST(dither_spreads)
{
    uint8_t half[SIDE * SIDE], quarter[SIDE * SIDE];
    block_show(half, 100.5F / 255, TRANSFER_NONE, true);
    block_show(quarter, 100.25F / 255, TRANSFER_NONE, true);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            assert_int_equal(half[SIDE * y + x], 100 + (x + y) % 2);
            assert_int_equal(quarter[SIDE * y + x], 100 + ((x % 2 == 0 && y % 2 == 1) ? 1 : 0));
        }
}

// Writes columns and rows from `left` and `top` of an image of a gradient, in two parts.
static void part_write(const char *path, uint32_t left, uint32_t top, uint32_t width, uint32_t height)
{
    const ImageHeader header = {.format = image_format_of(path),
                                .width = width,
                                .height = height,
                                .channels = 3,
                                .bits = 8,
                                .npy_type = 'f',
                                .left = left,
                                .top = top,
                                .exposure = -0.3,
                                .tone = TONE_FILMIC,
                                .dither = true};
    float values[32 * 32 * 3];
    for (uint32_t i = 0; i < 3 * width * height; i++) {
        const uint32_t x = left + i / 3 % width, y = top + i / 3 / width;
        values[i] = (float)(x + 31 * y) / 999 + 0.01F * (float)(i % 3);
    }
    MessageList messages = {0};
    ImageWriter *writer = image_writer_open(path, &header, &messages);
    assert_true(image_writer_rows(writer, values, height / 3, &messages));
    assert_true(
        image_writer_rows(writer, values + (size_t)3 * width * (height / 3), height - height / 3, &messages));
    assert_true(image_writer_commit(writer, &messages));
}

// The pattern lies in the whole image, so that a region, and bands, have the bits of the whole.
TEST_WITH(regions_and_bands, folder_open, folder_close)
{
    part_write("whole.ppm", 0, 0, 32, 32);
    part_write("part.ppm", 5, 11, 20, 9);
    OwnedText whole = file_text("whole.ppm"), part = file_text("part.ppm");
    const size_t whole_start = strlen("P6\n32 32\n255\n"), part_start = strlen("P6\n20 9\n255\n");
    for (size_t y = 0; y < 9; y++)
        assert_memory_equal(part.items + part_start + 60 * y, whole.items + whole_start + 96 * (y + 11) + 15,
                            60);
}

// Many rows at once, which threads share, have the same bytes as rows written one by one.
TEST(rows_at_once)
{
    enum { ROWS = 300, COLUMNS = 700 };
    static float values[ROWS * COLUMNS * 3];
    static uint8_t together[2 * COUNT_OF(values)], alone[sizeof together];
    for (size_t i = 0; i < ROWS * COLUMNS * 3; i++)
        values[i] = (float)(i % 1021) / 1000;
    for (unsigned bits = 8; bits <= 16; bits += 8) {
        const ImageHeader header = {
            .width = COLUMNS, .height = ROWS, .channels = 3, .bits = bits, .dither = bits == 8};
        const size_t row_size = display_row_size(&header);
        assert_int_equal(row_size, COLUMNS * 3 * bits / 8);
        display_rows(together, values, &header, 0, ROWS);
        for (uint32_t row = 0; row < ROWS; row++)
            display_rows(alone + row * row_size, values + (size_t)row * COLUMNS * 3, &header, row, 1);
        assert_memory_equal(together, alone, ROWS * row_size);
    }
}

TEST_MAIN(NULL, NULL)
