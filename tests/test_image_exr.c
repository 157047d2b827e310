// EXR files as other programs write them: halves, every lossless compression, tiles, more channels than
// three.
#include "host/image/image.h"
#include "tests/files.h"

#include <openexr.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 23, HEIGHT = 37, TILE = 8, CHANNELS = 4 }; // at most

static const char path[] = "a.exr";

// 0 to 2047 / 2048: exact in a half, and another value in each channel. Runs of equal values compress well:
// the library that writes these files spoils a block whose compressed size happens to be its full size
// (OpenEXR's issue 2306).
static float value_at(uint32_t x, uint32_t y, uint32_t channel)
{
    return (float)((x / 6 * 31 + y * 57 + channel * 400) % 2048) / 2048.0F;
}

static void must(exr_result_t code)
{
    assert_int_equal(code, EXR_ERR_SUCCESS);
}

static void chunk_write(exr_context_t context, const exr_chunk_info_t *chunk, const float *pixels)
{
    exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
    must(exr_encoding_initialize(context, 0, chunk, &pipeline));
    for (int i = 0; i < pipeline.channel_count; i++) {
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

// `names`: a letter for each channel, in the order of EXR, which is that of the alphabet.
static void exr_write(const char *names, exr_compression_t compression, exr_pixel_type_t type, bool is_tiled)
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
    for (const char *name = names; *name; name++)
        must(exr_add_channel(context, 0, (char[]){*name, '\0'}, type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
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

// `expected`: the letters of the channels that are read, in the image's order.
static void check_read(const char *names, const char *expected, exr_compression_t compression,
                       exr_pixel_type_t type, bool is_tiled)
{
    exr_write(names, compression, type, is_tiled);
    MessageList messages = {0};
    Image image;
    if (!image_read(&image, path, &messages))
        fail_msg("%s, compression %d, type %d, tiled %d: %s", names, (int)compression, (int)type, is_tiled,
                 messages.items[0].text);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, HEIGHT);
    assert_int_equal(image.channels, strlen(expected));
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            for (uint32_t i = 0; i < image.channels; i++) {
                uint32_t channel = (uint32_t)(strchr(names, expected[i]) - names);
                assert_true(image.values[(y * WIDTH + x) * image.channels + i] == value_at(x, y, channel));
            }
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
            check_read("ABGR", "RGB", compressions[i], EXR_PIXEL_HALF, is_tiled);
            check_read("ABGR", "RGB", compressions[i], EXR_PIXEL_FLOAT, is_tiled);
        }
    }
}

// Every number of channels, of which some are not wanted.
static void test_choice_of_channels(void **state)
{
    (void)state;
    static const char *const files[][2] = {{"Y", "Y"},     {"AY", "Y"},     {"BGY", "Y"},
                                           {"ABGY", "Y"},  {"BGR", "RGB"},  {"BGRZ", "RGB"},
                                           {"UVW", "UVW"}, {"TUVW", "TUV"}, {"UV", "U"}};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        for (int is_tiled = 0; is_tiled < 2; is_tiled++) {
            check_read(files[i][0], files[i][1], EXR_COMPRESSION_ZIPS, EXR_PIXEL_HALF, is_tiled);
            check_read(files[i][0], files[i][1], EXR_COMPRESSION_NONE, EXR_PIXEL_HALF, is_tiled);
            check_read(files[i][0], files[i][1], EXR_COMPRESSION_ZIPS, EXR_PIXEL_FLOAT, is_tiled);
            check_read(files[i][0], files[i][1], EXR_COMPRESSION_NONE, EXR_PIXEL_FLOAT, is_tiled);
        }
    }
}

// Among blocks of every size and compressibility are some whose compressed size is their full size; glint
// must not spoil those.
static void test_blocks_as_large_as_compressed(void **state)
{
    (void)state;
    uint32_t random = 1;
    for (uint32_t width = 8; width < 48; width++) {
        for (uint32_t kept_bits = 0; kept_bits < 24; kept_bits++) {
            float values[48];
            for (uint32_t i = 0; i < width; i++) {
                random = random * 1664525U + 1013904223U;
                values[i] = (float)(random >> (31 - kept_bits)) * 0x1p-24F;
            }
            MessageList messages = {0};
            ImageHeader header = {IMAGE_EXR, width, 1, 1, TRANSFER_NONE, 8, 'f', NULL};
            ImageWriter *writer = image_writer_open(path, &header, &messages);
            assert_non_null(writer);
            assert_true(image_writer_rows(writer, values, 1, &messages));
            assert_true(image_writer_commit(writer, &messages));
            Image image;
            assert_true(image_read(&image, path, &messages));
            assert_memory_equal(image.values, values, width * sizeof *values);
            image_free(&image);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_compressions),
        cmocka_unit_test(test_choice_of_channels),
        cmocka_unit_test(test_blocks_as_large_as_compressed),
        cmocka_unit_test(test_integer_channels_are_refused),
    };
    return cmocka_run_group_tests(tests, folder_open, folder_close);
}
