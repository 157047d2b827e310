// Reads EXR files as other programs write them: halves, every lossless compression, tiles, more channels than
// three.
#include "host/image/image.h"
#include "tests/check.h"
#include "tests/files.h"

#include <openexr.h>

enum { WIDTH = 23, HEIGHT = 37, TILE = 8, CHANNELS = 6 }; // at most

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

static void chunk_write(exr_context_t context, int part, const exr_chunk_info_t *chunk, const float *pixels)
{
    exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
    must(exr_encoding_initialize(context, part, chunk, &pipeline));
    for (int i = 0; i < pipeline.channel_count; i++) {
        pipeline.channels[i].encode_from_ptr = (const uint8_t *)(pixels + i);
        pipeline.channels[i].user_pixel_stride = CHANNELS * sizeof(float);
        pipeline.channels[i].user_line_stride = WIDTH * CHANNELS * sizeof(float);
        pipeline.channels[i].user_bytes_per_element = sizeof(float);
        pipeline.channels[i].user_data_type = EXR_PIXEL_FLOAT;
    }
    must(exr_encoding_choose_default_routines(context, part, &pipeline));
    must(exr_encoding_run(context, part, &pipeline));
    must(exr_encoding_destroy(context, &pipeline));
}

// The files that this writes, apart from their names of channels.
typedef struct {
    exr_compression_t compression;
    exr_pixel_type_t type;
    bool is_tiled;
} Type;

static const Type plain = {EXR_COMPRESSION_NONE, EXR_PIXEL_FLOAT, false};

// Opens a file of scan lines or tiles with its channels, one part for each item of `names`, and returns its
// context. A part's channels are separated by commas and in the order of EXR, which is that of the alphabet.
// A name of a part precedes them, ended by a colon.
static exr_context_t exr_open(const char *const *names, int part_count, Type type)
{
    exr_context_t context;
    must(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, NULL));
    for (int i = 0; i < part_count; i++) {
        char text[256], *rest = text;
        snprintf(text, sizeof text, "%s", names[i]);
        const char *part_name = strchr(text, ':') ? strsep(&rest, ":") : "";
        int part;
        must(exr_add_part(context, part_name, type.is_tiled ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE,
                          &part));
        must(exr_initialize_required_attr_simple(context, part, WIDTH, HEIGHT, type.compression));
        if (type.is_tiled)
            must(exr_set_tile_descriptor(context, part, TILE, TILE, EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN));
        for (const char *name; (name = strsep(&rest, ","));)
            must(exr_add_channel(context, part, name, type.type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
        if (part_count > 1) must(exr_set_version(context, part, 1));
    }
    return context;
}

// Writes the pixels of all parts and closes the file.
static void exr_close(exr_context_t context, int part_count, Type type)
{
    static float pixels[HEIGHT][WIDTH][CHANNELS];
    must(exr_write_header(context));
    for (int part = 0; part < part_count; part++) {
        for (uint32_t y = 0; y < HEIGHT; y++) {
            for (uint32_t x = 0; x < WIDTH; x++) {
                for (uint32_t i = 0; i < CHANNELS; i++)
                    pixels[y][x][i] = value_at(x, y, i + CHANNELS * (uint32_t)part);
            }
        }
        exr_chunk_info_t chunk;
        if (type.is_tiled) {
            for (int y = 0; y * TILE < HEIGHT; y++) {
                for (int x = 0; x * TILE < WIDTH; x++) {
                    must(exr_write_tile_chunk_info(context, part, x, y, 0, 0, &chunk));
                    chunk_write(context, part, &chunk, pixels[y * TILE][x * TILE]);
                }
            }
        } else {
            int32_t rows;
            must(exr_get_scanlines_per_chunk(context, part, &rows));
            for (int y = 0; y < HEIGHT; y += rows) {
                must(exr_write_scanline_chunk_info(context, part, y, &chunk));
                chunk_write(context, part, &chunk, pixels[y][0]);
            }
        }
    }
    must(exr_finish(&context));
}

static void exr_write(const char *names, Type type)
{
    exr_close(exr_open(&names, 1, type), 1, type);
}

static bool layer_read(Image *image, const char *layer, MessageList *messages)
{
    const bool done = image_read(image, path, &(ImageReadOptions){.layer = layer}, messages);
    assert_true(done == (message_count(messages, MESSAGE_ERROR) == 0));
    return done;
}

// Checks a layer's values. `expected` has the numbers of the channels that are read, in the image's order.
static void check_values(const char *layer, const char *expected, const char *what)
{
    MessageList messages = {0};
    OwnedImage image;
    if (!layer_read(&image, layer, &messages)) fail_msg("%s: %s", what, messages.items[0].text);
    assert_int_equal(messages.count, 0);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, HEIGHT);
    assert_int_equal(image.channels, strlen(expected));
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            for (uint32_t i = 0; i < image.channels; i++) {
                const float value = value_at(x, y, (uint32_t)(expected[i] - '0'));
                if (image.values[(y * WIDTH + x) * image.channels + i] != value)
                    fail_msg("%s: channel %u of pixel %u, %u", what, i, x, y);
            }
        }
    }
}

static void check_read(const char *names, const char *expected, Type type)
{
    exr_write(names, type);
    check_values(NULL, expected,
                 formatted("%s, compression %d, type %d, tiled %d", names, (int)type.compression,
                           (int)type.type, type.is_tiled));
}

static void check_refused(const char *layer, const char *reason)
{
    OwnedMessageList messages = {0};
    Image image;
    assert_false(layer_read(&image, layer, &messages));
    assert_int_equal(messages.count, 1);
    if (!strstr(messages.items[0].text, reason)) fail_msg("%s, not: %s", messages.items[0].text, reason);
}

TEST(compressions)
{
    const exr_compression_t compressions[] = {EXR_COMPRESSION_NONE, EXR_COMPRESSION_RLE, EXR_COMPRESSION_ZIPS,
                                              EXR_COMPRESSION_ZIP, EXR_COMPRESSION_PIZ};
    for (size_t i = 0; i < COUNT_OF(compressions); i++) {
        for (int is_tiled = 0; is_tiled < 2; is_tiled++) {
            check_read("A,B,G,R", "321", (Type){compressions[i], EXR_PIXEL_HALF, is_tiled});
            check_read("A,B,G,R", "321", (Type){compressions[i], EXR_PIXEL_FLOAT, is_tiled});
        }
    }
}

// Files may have any number of channels, of which some are not wanted.
TEST(choice_of_channels)
{
    static const char *const files[][2] = {
        {"Y", "0"},
        {"A,Y", "1"},
        {"B,G,Y", "2"},
        {"A,B,G,Y", "3"},
        {"B,G,R", "210"},
        {"B,G,R,Z", "210"},
        {"b,g,r", "210"},
        {"Blue,Green,Red", "210"},
        {"X,Y,Z", "012"},
        {"depth", "0"},
        {"A,Z", "1"},
        {"ViewLayer.Combined.A,ViewLayer.Combined.B,ViewLayer.Combined.G,ViewLayer.Combined.R", "321"},
        {"diffuse.B,diffuse.G,diffuse.R,normal.X,normal.Y,normal.Z", "210"},
        {"B,G,R,diffuse.B,diffuse.G,diffuse.R", "210"},
        {"Z,albedo.B,albedo.G,albedo.R", "321"},
    };
    for (size_t i = 0; i < COUNT_OF(files); i++) {
        for (int is_tiled = 0; is_tiled < 2; is_tiled++) {
            check_read(files[i][0], files[i][1], (Type){EXR_COMPRESSION_ZIPS, EXR_PIXEL_HALF, is_tiled});
            check_read(files[i][0], files[i][1], (Type){EXR_COMPRESSION_NONE, EXR_PIXEL_HALF, is_tiled});
            check_read(files[i][0], files[i][1], (Type){EXR_COMPRESSION_ZIPS, EXR_PIXEL_FLOAT, is_tiled});
            check_read(files[i][0], files[i][1], (Type){EXR_COMPRESSION_NONE, EXR_PIXEL_FLOAT, is_tiled});
        }
    }
}

TEST(layers_by_name)
{
    exr_write("a.B,a.G,a.R,b.c.X,b.c.Y,b.c.Z", plain);
    check_values("a", "210", "a");
    check_values("b.c", "345", "b.c");
    check_refused("c", "it has no layer 'c'; its channels are a.B, a.G, a.R, b.c.X, b.c.Y, b.c.Z");
    exr_write("a.B,a.G,a.R,b.B,b.G,b.R", plain);
    check_values("b", "543", "b");
    check_refused(NULL, "several layers, a, b; name one");
    exr_write("a.Z,b.Z", plain);
    check_refused(NULL, "several layers, a, b; name one");
    exr_write("G,R", plain);
    check_refused(NULL, "no layer has red, green and blue, or luminance; its channels are G, R");
    exr_write("T,U,V", plain);
    check_refused(NULL, "its channels are T, U, V");
    exr_write("B,G,R,d.G,d.R", plain);
    check_refused("d", "its layer 'd' has neither colors, luminance");
}

// value_at is below 1 everywhere, and only a layer's own alpha counts.
TEST(alpha_is_read)
{
    enum { NONE = CHANNELS };
    static const struct {
        const char *names, *layer;
        uint32_t alpha; // the number of its channel
    } files[] = {
        {"A,B,G,R", NULL, 0},          {"B,G,R", NULL, NONE},       {"A,Y", NULL, 0},
        {"A,a.B,a.G,a.R", "a", NONE},  {"a.A,a.B,a.G,a.R", "a", 0}, {"A,depth.Z", "depth", NONE},
        {"A,a.A,a.B,a.G,a.R", "a", 1},
    };
    for (size_t i = 0; i < COUNT_OF(files); i++) {
        exr_write(files[i].names, plain);
        MessageList messages = {0};
        OwnedImage image;
        assert_true(layer_read(&image, files[i].layer, &messages));
        assert_int_equal(messages.count, 0);
        if (!image.alpha != (files[i].alpha == NONE)) fail_msg("%s", files[i].names);
        for (uint32_t k = 0; image.alpha && k < WIDTH * HEIGHT; k++)
            if (image.alpha[k] != value_at(k % WIDTH, k / WIDTH, files[i].alpha))
                fail_msg("%s: pixel %u", files[i].names, k);
    }
}

TEST(parts_are_layers)
{
    static const char *const parts[] = {"depth:Z", "beauty:B,G,R", "other:B,G,R,a.X,a.Y,a.Z"};
    exr_close(exr_open(parts, 2, plain), 2, plain);
    check_values(NULL, "876", "the only part with colors");
    exr_close(exr_open(parts, 3, plain), 3, plain);
    check_values("other", "\x3e\x3d\x3c", "a part's name");
    check_values("a", "\x3f\x40\x41", "a layer of a part");
    check_values("depth", "0", "the first part's name");
    check_refused(NULL, "several layers, beauty, other; name one");
}

TEST(a_layer_precedes_a_part_of_its_name)
{
    exr_write("diffuse:AO,diffuse.B,diffuse.G,diffuse.R,mask", plain);
    check_values("diffuse", "321", "a layer in a part of its name");
    exr_write("diffuse:AO,diffuse.B,diffuse.G,diffuse.R", plain);
    check_values("diffuse", "321", "a layer next to one channel in a part of its name");
}

TEST(layers_are_bounded)
{
    enum { LAYERS_MAX = 4096 };
    for (int count = LAYERS_MAX; count <= LAYERS_MAX + 1; count++) {
        exr_context_t context;
        int part;
        must(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, NULL));
        must(exr_add_part(context, "", EXR_STORAGE_SCANLINE, &part));
        must(exr_initialize_required_attr_simple(context, 0, 1, 1, EXR_COMPRESSION_NONE));
        for (int i = 0; i < count; i++)
            must(exr_add_channel(context, 0, formatted("l%04d.Y", i), EXR_PIXEL_FLOAT,
                                 EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
        must(exr_write_header(context));
        static const float values[LAYERS_MAX + 1];
        must(exr_write_scanline_chunk(context, 0, 0, values, (uint64_t)count * sizeof *values));
        must(exr_finish(&context));
        check_refused(NULL, count == LAYERS_MAX ? "several layers, l0000, l0001" : "more than 4096 layers");
    }
}

// The image is black where the file has no pixels, and pixels outside of the image are not read.
TEST(windows)
{
    static const int shifts[][2] = {{3, 5}, {-4, -2}, {-30, 1}};
    for (size_t i = 0; i < COUNT_OF(shifts); i++) {
        const int left = shifts[i][0], top = shifts[i][1];
        const char *names = "Y";
        exr_context_t context = exr_open(&names, 1, plain);
        const exr_attr_box2i_t display = {.min.x = left, .min.y = top, .max.x = left + 19, .max.y = top + 9};
        must(exr_set_display_window(context, 0, &display));
        exr_close(context, 1, plain);
        MessageList messages = {0};
        OwnedImage image;
        assert_true(layer_read(&image, NULL, &messages));
        assert_int_equal(messages.count, 0);
        assert_int_equal(image.width, 20);
        assert_int_equal(image.height, 10);
        for (int y = 0; y < 10; y++) {
            for (int x = 0; x < 20; x++) {
                const int column = x + left, row = y + top;
                const bool is_there = column >= 0 && column < WIDTH && row >= 0 && row < HEIGHT;
                const float expected = is_there ? value_at((uint32_t)column, (uint32_t)row, 0) : 0;
                assert_true(image.values[y * 20 + x] == expected);
            }
        }
    }
}

// A color of luminance and chroma at half the resolution, as OpenEXR stores it: of (0.8, 0.2, 0.1) Y is
// 0.2126 R + 0.7152 G + 0.0722 B.
TEST(luminance_and_chroma)
{
    enum { SIDE = 4 };
    const float y = 0.32034F;
    exr_context_t context;
    int part;
    must(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, NULL));
    must(exr_add_part(context, "", EXR_STORAGE_SCANLINE, &part));
    must(exr_initialize_required_attr_simple(context, 0, SIDE, SIDE, EXR_COMPRESSION_NONE));
    must(exr_add_channel(context, 0, "BY", EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 2, 2));
    must(exr_add_channel(context, 0, "RY", EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 2, 2));
    must(exr_add_channel(context, 0, "Y", EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
    must(exr_write_header(context));
    for (int row = 0; row < SIDE; row++) {
        const float by = (0.1F - y) / y, ry = (0.8F - y) / y;
        const float both[] = {by, by, ry, ry, y, y, y, y};
        const float *values = row % 2 == 0 ? both : both + 4;
        must(exr_write_scanline_chunk(context, 0, row, values, row % 2 == 0 ? sizeof both : 4 * sizeof y));
    }
    must(exr_finish(&context));
    MessageList messages = {0};
    OwnedImage image;
    assert_true(layer_read(&image, NULL, &messages));
    assert_int_equal(messages.count, 0);
    assert_int_equal(image.channels, 3);
    assert_false(image.data);
    for (size_t i = 0; i < (size_t)SIDE * SIDE; i++) {
        const float expected[] = {0.8F, 0.2F, 0.1F};
        for (size_t channel = 0; channel < 3; channel++)
            assert_float_equal(image.values[3 * i + channel], expected[channel], 1e-6F);
    }
}

TEST(other_primaries_are_named)
{
    const char *names = "B,G,R";
    for (int is_wide = 0; is_wide < 2; is_wide++) {
        exr_context_t context = exr_open(&names, 1, plain);
        exr_attr_chromaticities_t rec_2020 = {0.708F, 0.292F, 0.17F, 0.797F, 0.131F, 0.046F, 0.3127F, 0.329F};
        exr_attr_chromaticities_t rec_709 = {0.64F, 0.33F, 0.3F, 0.6F, 0.15F, 0.06F, 0.3127F, 0.329F};
        must(exr_attr_set_chromaticities(context, 0, "chromaticities", is_wide ? &rec_2020 : &rec_709));
        exr_close(context, 1, plain);
        OwnedMessageList messages = {0};
        OwnedImage image;
        assert_true(layer_read(&image, NULL, &messages));
        assert_int_equal(messages.count, is_wide);
        if (is_wide)
            assert_string_equal(messages.items[0].text, "'a.exr': EXR: the chromaticities are ignored; the "
                                                        "colors are taken for Rec. 709's");
    }
}

// Among blocks of every size and compressibility are some whose compressed size is their full size, which
// glint must not spoil.
TEST(blocks_as_large_as_compressed)
{
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
            OwnedImage image;
            assert_true(image_read(&image, path, NULL, &messages));
            assert_memory_equal(image.values, values, width * sizeof *values);
        }
    }
}

// The file is the same however many rows come at once, be they parts of blocks, many blocks, or both.
TEST(rows_in_any_number)
{
    enum { ROWS = 611, COLUMNS = 7, LAYERS = 3 };
    const ImageLayer layers[] = {{"object", 1, 'u'}, {"position.X,position.Y", 2, 'f'}};
    const ImageHeader header = {.format = IMAGE_EXR,
                                .width = COLUMNS,
                                .height = ROWS,
                                .channels = 3,
                                .npy_type = 'f',
                                .layers = layers,
                                .layer_count = 2};
    static const size_t channels[LAYERS] = {3, 1, 2};
    static float values[LAYERS][ROWS * COLUMNS * 3];
    for (size_t i = 0; i < LAYERS; i++)
        for (size_t k = 0; k < ROWS * COLUMNS * 3; k++)
            values[i][k] = (float)(k * (k + i) % 1009);
    static const uint32_t steps[] = {ROWS, 1, 5, 15, 16, 17, 32, 100, 600};
    OwnedText whole = {0};
    for (size_t k = 0; k < COUNT_OF(steps); k++) {
        MessageList messages = {0};
        ImageWriter *writer = image_writer_open(path, &header, &messages);
        for (uint32_t row = 0; row < ROWS; row += steps[k]) {
            const void *arrays[LAYERS];
            for (size_t i = 0; i < LAYERS; i++)
                arrays[i] = values[i] + row * COLUMNS * channels[i];
            const uint32_t count = steps[k] < ROWS - row ? steps[k] : ROWS - row;
            if (!image_writer_layer_rows(writer, arrays, count, &messages))
                fail_msg("step %u row %u: %s", steps[k], row, messages.items[0].text);
        }
        assert_true(image_writer_commit(writer, &messages));
        Text text = file_text(path);
        if (k == 0) whole = text;
        assert_int_equal(text.count, whole.count);
        assert_memory_equal(text.items, whole.items, whole.count);
        if (k > 0) text_free(&text);
    }
    OwnedImage image;
    MessageList messages = {0};
    assert_true(image_read(&image, path, NULL, &messages));
    assert_memory_equal(image.values, values[0], sizeof values[0]);
}

TEST(integer_channels_are_refused)
{
    exr_context_t context;
    int part;
    must(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, NULL));
    must(exr_add_part(context, "", EXR_STORAGE_SCANLINE, &part));
    must(exr_initialize_required_attr_simple(context, 0, 1, 1, EXR_COMPRESSION_NONE));
    must(exr_add_channel(context, 0, "Y", EXR_PIXEL_UINT, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
    must(exr_write_header(context));
    must(exr_write_scanline_chunk(context, 0, 0, &(uint32_t){7}, 4));
    must(exr_finish(&context));
    check_refused(NULL, "EXR: channel Y is not of floats or not of full resolution");
}

TEST_MAIN(folder_open, folder_close)
