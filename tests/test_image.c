// Writes and reads images: every format's round trip, notes, and failures that leave the old file unchanged.
// test_image_read has what other programs write.
#include "host/image/image.h"
#include "tests/check.h"
#include "tests/files.h"

#include <openexr.h>
#include <png.h>

static const ImageNote notes[] = {{"Software", "glint 1"}, {"Scene", "caf\xC3\xA9.yaml"}, {NULL, NULL}};

// Returns values from below 0 to above 1, all different.
static float *values_make(uint32_t count)
{
    float *values = malloc(count * sizeof *values);
    assert_non_null(values);
    for (uint32_t i = 0; i < count; i++)
        values[i] = -0.1F + 1.2F * (float)((i * 7919U) % count) / (float)count;
    return values;
}

static void check_no_messages(MessageList *messages)
{
    if (messages->count) message_list_print(messages, stderr);
    assert_int_equal(messages->count, 0);
}

// Writes in uneven bands, so that a format's own blocks lie across them.
static void image_write_file(const char *path, const ImageHeader *header, const void *values,
                             size_t value_size)
{
    MessageList messages = {0};
    ImageWriter *writer = image_writer_open(path, header, &messages);
    assert_non_null(writer);
    uint32_t row = 0;
    for (uint32_t band = 1; row < header->height; row += band, band += 2) {
        if (band > header->height - row) band = header->height - row;
        const char *pixels =
            (const char *)values + (size_t)row * header->width * header->channels * value_size;
        assert_true(image_writer_rows(writer, pixels, band, &messages));
    }
    assert_true(image_writer_commit(writer, &messages));
    check_no_messages(&messages);
}

static Image image_read_file(const char *path)
{
    MessageList messages = {0};
    Image image;
    assert_true(image_read(&image, path, NULL, &messages));
    check_no_messages(&messages);
    return image;
}

static void check_display_round_trip(const char *path, uint32_t channels, Transfer transfer, unsigned bits)
{
    ImageHeader header = {image_format_of(path), 37, 41, channels, transfer, bits, 'f', notes};
    uint32_t count = 37 * 41 * channels;
    OWNED float *values = values_make(count);
    image_write_file(path, &header, values, sizeof *values);
    OwnedImage image = image_read_file(path);
    assert_int_equal(image.width, 37);
    assert_int_equal(image.height, 41);
    assert_int_equal(image.channels, channels);
    assert_true(image.display);
    assert_int_equal(image.transfer, header.format == IMAGE_PNG ? transfer : TRANSFER_NONE);
    float maximum = bits == 8 ? 255.0F : 65535.0F;
    for (uint32_t i = 0; i < count; i++)
        assert_true(image.values[i] == (float)image_quantize(values[i], transfer, bits) / maximum);
}

TEST(display_formats)
{
    const char *const paths[] = {"a.png", "a.ppm"};
    for (size_t i = 0; i < 2; i++) {
        for (uint32_t channels = 1; channels <= 3; channels += 2) {
            check_display_round_trip(paths[i], channels, TRANSFER_SRGB, 8);
            check_display_round_trip(paths[i], channels, TRANSFER_SRGB, 16);
            check_display_round_trip(paths[i], channels, TRANSFER_NONE, 8);
            check_display_round_trip(paths[i], channels, TRANSFER_NONE, 16);
        }
    }
}

static void check_float_round_trip(const char *path, uint32_t channels)
{
    ImageHeader header = {image_format_of(path), 37, 41, channels, TRANSFER_SRGB, 8, 'f', notes};
    uint32_t count = 37 * 41 * channels;
    OWNED float *values = values_make(count);
    values[3] = INFINITY;
    values[4] = NAN;
    values[5] = 1e30F;
    image_write_file(path, &header, values, sizeof *values);
    OwnedImage image = image_read_file(path);
    assert_int_equal(image.width, 37);
    assert_int_equal(image.height, 41);
    assert_int_equal(image.channels, channels);
    assert_false(image.display);
    assert_memory_equal(image.values, values, count * sizeof *values);
}

TEST(float_formats)
{
    check_float_round_trip("a.exr", 1);
    check_float_round_trip("a.exr", 3);
    check_float_round_trip("a.npy", 1);
    check_float_round_trip("a.npy", 3);
    check_float_round_trip("a.npy", 5);
}

// The library reads ahead of a header, so a file shorter than that must be read as whole.
TEST(small_exr)
{
    const float value = 0.375F;
    ImageHeader header = {IMAGE_EXR, 1, 1, 1, TRANSFER_SRGB, 8, 'f', NULL};
    image_write_file("small.exr", &header, &value, sizeof value);
    OwnedImage image = image_read_file("small.exr");
    assert_true(image.width == 1 && image.height == 1 && image.channels == 1 && image.values[0] == value);
}

TEST(npy_types)
{
    const uint32_t integers[] = {0, 1, 7, 16777217, 4294967295U, 5};
    ImageHeader header = {IMAGE_NPY, 3, 2, 1, TRANSFER_NONE, 8, 'u', NULL};
    image_write_file("u.npy", &header, integers, sizeof *integers);
    Image image = image_read_file("u.npy");
    for (size_t i = 0; i < 6; i++) {
        assert_true(image.values[i] == (float)integers[i]);
        assert_true(image_value(&image, i) == (double)integers[i]);
    }
    image_free(&image);

    const double doubles[] = {0.1, -1e300, 3, 4, 5, 6};
    header.npy_type = 'd';
    image_write_file("d.npy", &header, doubles, sizeof *doubles);
    image = image_read_file("d.npy");
    assert_true(image.values[0] == 0.1F && image.values[1] == -INFINITY && image.values[5] == 6.0F);
    image_free(&image);
}

TEST(doubles_keep_their_bits)
{
    const double doubles[] = {1.0 / 3, 1 + 1e-15, 5e-324};
    const float floats[] = {1.0F / 3, 1, 0.5F};
    ImageHeader header = {IMAGE_NPY, 3, 1, 1, TRANSFER_NONE, 8, 'd', notes};
    image_write_file("d.npy", &header, doubles, sizeof *doubles);
    header.npy_type = 'f';
    image_write_file("f.npy", &header, floats, sizeof *floats);
    for (int i = 0; i < 2; i++) {
        OwnedImage image = image_read_file(i ? "f.npy" : "d.npy");
        for (size_t k = 0; k < 3; k++)
            assert_true(image_value(&image, k) == (i ? (double)floats[k] : doubles[k]));
    }
}

TEST(npy_bytes)
{
    const float value = 1.5F;
    ImageHeader header = {IMAGE_NPY, 1, 1, 1, TRANSFER_NONE, 8, 'f', NULL};
    image_write_file("b.npy", &header, &value, sizeof value);
    char bytes[256];
    FILE *file = fopen("b.npy", "rb");
    assert_non_null(file);
    assert_int_equal(fread(bytes, 1, sizeof bytes, file), 132);
    fclose(file);
    assert_memory_equal(
        bytes, "\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1), }",
        10 + 57);
    assert_int_equal(bytes[127], '\n');
    assert_memory_equal(bytes + 128, "\x00\x00\xC0\x3F", 4);
}

// The chunks in front of the pixels, as libpng sees them.
TEST(png_notes)
{
    ImageHeader header = {IMAGE_PNG, 5, 4, 3, TRANSFER_SRGB, 8, 'f', notes};
    OWNED float *values = values_make(60);
    image_write_file("notes.png", &header, values, sizeof *values);
    FILE *file = fopen("notes.png", "rb");
    assert_non_null(file);
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, file);
    png_read_info(png, info); // stops in front of IDAT
    png_textp texts;
    int count = 0;
    assert_int_equal(png_get_text(png, info, &texts, &count), 2);
    for (int i = 0; i < count; i++) {
        assert_string_equal(texts[i].key, notes[i].key);
        assert_string_equal(texts[i].text, notes[i].value);
    }
    assert_int_equal(texts[0].compression, PNG_TEXT_COMPRESSION_NONE);
    assert_int_equal(texts[1].compression, PNG_ITXT_COMPRESSION_NONE);
    assert_int_not_equal(png_get_valid(png, info, PNG_INFO_sRGB), 0);
    png_destroy_read_struct(&png, &info, NULL);
    fclose(file);
}

TEST(exr_notes)
{
    ImageHeader header = {IMAGE_EXR, 5, 4, 3, TRANSFER_SRGB, 8, 'f', notes};
    OWNED float *values = values_make(60);
    image_write_file("notes.exr", &header, values, sizeof *values);
    exr_context_t context;
    assert_int_equal(exr_start_read(&context, "notes.exr", NULL), EXR_ERR_SUCCESS);
    for (const ImageNote *note = notes; note->key; note++) {
        char key[64];
        const char *value;
        snprintf(key, sizeof key, "glint.%s", note->key);
        assert_int_equal(exr_attr_get_string(context, 0, key, NULL, &value), EXR_ERR_SUCCESS);
        assert_string_equal(value, note->value);
    }
    exr_compression_t compression;
    assert_int_equal(exr_get_compression(context, 0, &compression), EXR_ERR_SUCCESS);
    assert_int_equal(compression, EXR_COMPRESSION_ZIP);
    assert_int_equal(exr_finish(&context), EXR_ERR_SUCCESS);
}

static const char *const endings[] = {"png", "ppm", "exr", "npy"};

static void old_file_make(char *path, size_t size, const char *ending)
{
    snprintf(path, size, "old.%s", ending);
    file_write(path, "old");
}

static ImageWriter *writer_of_8_by_40(const char *path, MessageList *messages)
{
    ImageHeader header = {image_format_of(path), 8, 40, 3, TRANSFER_SRGB, 8, 'f', notes};
    ImageWriter *writer = image_writer_open(path, &header, messages);
    assert_non_null(writer);
    return writer;
}

TEST(abandoned_leaves_the_old_file)
{
    OWNED float *values = values_make(8 * 40 * 3);
    for (size_t i = 0; i < 4; i++) {
        char path[16];
        old_file_make(path, sizeof path, endings[i]);
        unsigned before = folder_count("");
        MessageList messages = {0};
        ImageWriter *writer = writer_of_8_by_40(path, &messages);
        assert_true(image_writer_rows(writer, values, 20, &messages));
        image_writer_abandon(writer);
        assert_int_equal(folder_count(""), before);
        check_content(path, "old");
        check_no_messages(&messages);
    }
}

// Every write to /dev/full fails as on a full disk; enough rows that no buffer holds them all.
TEST(disk_full)
{
    enum { SIDE = 256 };
    OWNED float *values = values_make(SIDE * SIDE * 3);
    for (size_t i = 0; i < 4; i++) {
        OwnedMessageList messages = {0};
        const ImageHeader header = {(ImageFormat)i, SIDE, SIDE, 3, TRANSFER_SRGB, 16, 'f', notes};
        ImageWriter *writer = image_writer_open("/dev/full", &header, &messages);
        if (writer) {
            image_writer_rows(writer, values, SIDE, &messages);
            if (i % 2) assert_false(image_writer_finish(writer, &messages));
            assert_false(image_writer_commit(writer, &messages));
        }
        assert_int_equal(messages.count, 1);
        assert_string_equal(messages.items[0].text, "cannot write '/dev/full': No space left on device");
    }
}

TEST(finished_is_yet_to_be_renamed)
{
    OWNED float *values = values_make(8 * 40 * 3);
    for (size_t i = 0; i < 4; i++) {
        char path[16];
        old_file_make(path, sizeof path, endings[i]);
        unsigned before = folder_count("");
        MessageList messages = {0};
        for (int commits = 0; commits < 2; commits++) {
            ImageWriter *writer = writer_of_8_by_40(path, &messages);
            assert_true(image_writer_rows(writer, values, 40, &messages));
            assert_true(image_writer_finish(writer, &messages));
            check_content(path, "old");
            if (commits)
                assert_true(image_writer_commit(writer, &messages));
            else
                image_writer_abandon(writer);
            assert_int_equal(folder_count(""), before);
        }
        OwnedImage image;
        assert_true(image_read(&image, path, NULL, &messages));
        assert_int_equal(image.height, 40);
        check_no_messages(&messages);
    }
}

static void check_layer(const char *layer, const void *expected, uint32_t channels, bool is_integer)
{
    MessageList messages = {0};
    OwnedImage image;
    assert_true(image_read(&image, "layers.exr", &(ImageReadOptions){.layer = layer}, &messages));
    check_no_messages(&messages);
    assert_int_equal(image.width, 4);
    assert_int_equal(image.height, 33);
    assert_int_equal(image.channels, channels);
    assert_int_equal(image.integers, is_integer);
    for (size_t i = 0; i < (size_t)4 * 33 * channels; i++) {
        const uint32_t *integers = expected;
        const float *floats = expected;
        assert_true(image_value(&image, i) == (is_integer ? integers[i] : (double)floats[i]));
    }
}

TEST(exr_layers)
{
    enum { PIXELS = 4 * 33 };
    OWNED float *color = values_make(3 * PIXELS), *vectors = values_make(3 * PIXELS),
                *alpha = values_make(PIXELS);
    uint32_t numbers[PIXELS], masks[2 * PIXELS];
    for (uint32_t i = 0; i < PIXELS; i++) {
        numbers[i] = UINT32_MAX - i * i * i;
        masks[2 * i] = i;
        masks[2 * i + 1] = 1000 + i;
        vectors[3 * i] += 7;
    }
    numbers[0] = 0x7F800001; // the bits of a signaling NaN
    const ImageLayer layers[] = {{"vector.X,vector.Y,vector.Z", 3, 'f'},
                                 {"A", 1, 'f'},
                                 {"number.id", 1, 'u'},
                                 {"mask.0,mask.1", 2, 'u'}};
    ImageHeader header = {IMAGE_EXR, 4, 33, 3, TRANSFER_NONE, 8, 'f', NULL};
    header.layers = layers;
    header.layer_count = COUNT_OF(layers);
    OwnedMessageList messages = {0};
    ImageWriter *writer = image_writer_open("layers.exr", &header, &messages);
    assert_non_null(writer);
    for (uint32_t row = 0; row < 33; row += 11) { // blocks have 16 rows
        const size_t first = (size_t)4 * row;
        const void *const arrays[] = {color + 3 * first, vectors + 3 * first, alpha + first, numbers + first,
                                      masks + 2 * first};
        assert_true(image_writer_layer_rows(writer, arrays, 11, &messages));
    }
    assert_true(image_writer_commit(writer, &messages));
    check_no_messages(&messages);
    check_layer(NULL, color, 3, false);
    check_layer("vector", vectors, 3, false);
    check_layer("number", numbers, 1, true);
    Image image;
    assert_false(image_read(&image, "layers.exr", &(ImageReadOptions){.layer = "mask"}, &messages));
}

TEST(folder_that_is_not_there)
{
    MessageList messages = {0};
    ImageHeader header = {IMAGE_PNG, 8, 8, 3, TRANSFER_SRGB, 8, 'f', NULL};
    assert_null(image_writer_open("nowhere/a.png", &header, &messages));
    check_only_message(&messages, "cannot create 'nowhere/a.png': No such file or directory");
}

TEST(format_by_ending)
{
    assert_int_equal(image_format_of("a.b/c.PNG"), IMAGE_PNG);
    assert_int_equal(image_format_of("c.ppm"), IMAGE_PPM);
    assert_int_equal(image_format_of("c.Exr"), IMAGE_EXR);
    assert_int_equal(image_format_of("c.npy"), IMAGE_NPY);
    assert_int_equal(image_format_of("png"), IMAGE_UNKNOWN);
    assert_int_equal(image_format_of("c.png.bak"), IMAGE_UNKNOWN);
}

TEST_MAIN(folder_open, folder_close)
