// EXR files as other programs write them: halves, every lossless compression, tiles, more channels than
// three.
#include "host/image/image.h"

#include <openexr.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 23, HEIGHT = 37, TILE = 8, CHANNELS = 4 };

static char path[] = "/tmp/glint-test-XXXXXX";
static const char *const names[CHANNELS] = {"A", "B", "G", "R"}; // as EXR orders them

// 0 to 2047 / 2048: exact in a half, and another value in each channel.
static float value_at(uint32_t x, uint32_t y, uint32_t channel)
{
    return (float)((x * 31 + y * 57 + channel * 400) % 2048) / 2048.0F;
}

static void must(exr_result_t code)
{
    assert_int_equal(code, EXR_ERR_SUCCESS);
}

static void chunk_write(exr_context_t context, const exr_chunk_info_t *chunk, const float *pixels)
{
    exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
    must(exr_encoding_initialize(context, 0, chunk, &pipeline));
    for (int i = 0; i < CHANNELS; i++) {
        pipeline.channels[i].encode_from_ptr = (const uint8_t *)(pixels + i);
        pipeline.channels[i].user_pixel_stride = CHANNELS * sizeof(float);
        pipeline.channels[i].user_line_stride = WIDTH * CHANNELS * sizeof(float);
        pipeline.channels[i].user_bytes_per_element = sizeof(float);
        pipeline.channels[i].user_data_type = EXR_PIXEL_FLOAT;
    }
    must(exr_encoding_choose_default_routines(context, 0, &pipeline));
    must(exr_encoding_run(context, 0, &pipeline));
    must(exr_encoding_destroy(context, &pipeline));
}

static void file_write(exr_compression_t compression, exr_pixel_type_t type, bool is_tiled)
{
    static float pixels[HEIGHT][WIDTH][CHANNELS];
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            for (uint32_t i = 0; i < CHANNELS; i++)
                pixels[y][x][i] = value_at(x, y, i);
        }
    }
    exr_context_t context;
    int part;
    must(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, NULL));
    must(exr_add_part(context, "", is_tiled ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE, &part));
    must(exr_initialize_required_attr_simple(context, 0, WIDTH, HEIGHT, compression));
    if (is_tiled)
        must(exr_set_tile_descriptor(context, 0, TILE, TILE, EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN));
    for (int i = 0; i < CHANNELS; i++)
        must(exr_add_channel(context, 0, names[i], type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
    must(exr_write_header(context));
    exr_chunk_info_t chunk;
    if (is_tiled) {
        for (int y = 0; y * TILE < HEIGHT; y++) {
            for (int x = 0; x * TILE < WIDTH; x++) {
                must(exr_write_tile_chunk_info(context, 0, x, y, 0, 0, &chunk));
                chunk_write(context, &chunk, pixels[y * TILE][x * TILE]);
            }
        }
    } else {
        int32_t rows;
        must(exr_get_scanlines_per_chunk(context, 0, &rows));
        for (int y = 0; y < HEIGHT; y += rows) {
            must(exr_write_scanline_chunk_info(context, 0, y, &chunk));
            chunk_write(context, &chunk, pixels[y][0]);
        }
    }
    must(exr_finish(&context));
}

static void check_round_trip(exr_compression_t compression, exr_pixel_type_t type, bool is_tiled)
{
    file_write(compression, type, is_tiled);
    MessageList messages = {0};
    Image image;
    bool done = image_read(&image, path, &messages);
    if (!done)
        fail_msg("compression %d, type %d, tiled %d: %s", (int)compression, (int)type, is_tiled,
                 messages.items[0].text);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, HEIGHT);
    assert_int_equal(image.channels, 3);
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            for (uint32_t i = 0; i < 3; i++)
                assert_true(image.values[(y * WIDTH + x) * 3 + i] == value_at(x, y, 3 - i));
        }
    }
    image_free(&image);
}

static void test_compressions(void **state)
{
    (void)state;
    const exr_compression_t compressions[] = {EXR_COMPRESSION_NONE, EXR_COMPRESSION_RLE, EXR_COMPRESSION_ZIPS,
                                              EXR_COMPRESSION_ZIP, EXR_COMPRESSION_PIZ};
    for (size_t i = 0; i < sizeof compressions / sizeof *compressions; i++) {
        for (int is_tiled = 0; is_tiled < 2; is_tiled++) {
            check_round_trip(compressions[i], EXR_PIXEL_HALF, is_tiled);
            check_round_trip(compressions[i], EXR_PIXEL_FLOAT, is_tiled);
        }
    }
}

static void test_integer_channels_are_refused(void **state)
{
    (void)state;
    exr_context_t context;
    int part;
    must(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, NULL));
    must(exr_add_part(context, "", EXR_STORAGE_SCANLINE, &part));
    must(exr_initialize_required_attr_simple(context, 0, 1, 1, EXR_COMPRESSION_NONE));
    must(exr_add_channel(context, 0, "Y", EXR_PIXEL_UINT, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
    must(exr_write_header(context));
    must(exr_write_scanline_chunk(context, 0, 0, &(uint32_t){7}, 4));
    must(exr_finish(&context));
    MessageList messages = {0};
    Image image;
    assert_false(image_read(&image, path, &messages));
    assert_int_equal(messages.count, 1);
    assert_non_null(
        strstr(messages.items[0].text, "EXR: channel Y is not of floats or not of full resolution"));
    message_list_free(&messages);
}

static int file_make(void **state)
{
    (void)state;
    int descriptor = mkstemp(path);
    return descriptor < 0 ? -1 : close(descriptor);
}

static int file_remove(void **state)
{
    (void)state;
    return unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_compressions),
        cmocka_unit_test(test_integer_channels_are_refused),
    };
    return cmocka_run_group_tests(tests, file_make, file_remove);
}
