// Writes and reads images: every format's round trip, notes, and failures that leave the old file unchanged.
#include "host/image/image.h"
#include "tests/check.h"
#include "tests/files.h"

#include <openexr.h>
#include <png.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <turbojpeg.h>

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
        ImageHeader header = {image_format_of(endings[i]), SIDE, SIDE, 3, TRANSFER_SRGB, 16, 'f', notes};
        header.format = (ImageFormat)i;
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

static const char colors_path[] = "colors.png";

// Writes a PNG of one pixel. `profile` and `primaries` may be NULL, and `gamma` may be 0, for none.
static void colors_write(const char *profile, double gamma, const double *primaries, bool is_srgb)
{
    FILE *file = fopen(colors_path, "wb");
    assert_non_null(file);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, file);
    png_set_IHDR(png, info, 1, 1, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    if (gamma > 0) png_set_gAMA(png, info, gamma);
    if (primaries)
        png_set_cHRM(png, info, primaries[0], primaries[1], primaries[2], primaries[3], primaries[4],
                     primaries[5], primaries[6], primaries[7]);
    if (is_srgb) png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    if (profile) { // as no reader would accept it, which glint does not notice
        char chunk[80] = {0};
        snprintf(chunk, sizeof chunk, "%s", profile);
        png_write_chunk(png, (const png_byte *)"iCCP", (const png_byte *)chunk, strlen(profile) + 8);
    }
    png_write_row(png, (const uint8_t[]){10, 20, 30});
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    assert_int_equal(fclose(file), 0);
}

// Reads the PNG, and expects one warning that starts so, or none.
static void check_warning(const char *path, const char *expected)
{
    OwnedMessageList messages = {0};
    OwnedImage image;
    assert_true(image_read(&image, path, NULL, &messages));
    assert_int_equal(messages.count, expected ? 1 : 0);
    if (expected && !strstr(messages.items[0].text, expected)) fail_msg("%s", messages.items[0].text);
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

TEST(png_of_other_colors)
{
    static const double rec_709[] = {0.3127, 0.329, 0.64, 0.33, 0.3, 0.6, 0.15, 0.06};
    static const double adobe[] = {0.3127, 0.329, 0.64, 0.33, 0.21, 0.71, 0.15, 0.06};
    colors_write(NULL, 1 / 2.2, rec_709, false);
    check_warning(colors_path, NULL);
    colors_write(NULL, 1, NULL, false);
    check_warning(colors_path,
                  "'colors.png': PNG: the gamma of 1/1 is ignored; the colors are taken for sRGB");
    colors_write(NULL, 1 / 2.2, adobe, false);
    check_warning(colors_path, "PNG: the choice of primaries is ignored");
    colors_write("Display P3", 0, NULL, false);
    check_warning(colors_path, "PNG: the color profile 'Display P3' is ignored");
    colors_write("sRGB IEC61966-2.1", 1 / 2.2, adobe, false);
    check_warning(colors_path, NULL);
    colors_write(NULL, 0, NULL, true);
    check_warning(colors_path, NULL);
}

// Writes a JPEG of 32 x 16 pixels, whose quarters have the gray levels 0, 80, 160 and 240 in reading order,
// with application segments before its image.
static void jpeg_write(const char *path, const char *segments, size_t length, int pixel_format)
{
    enum { WIDTH = 32, HEIGHT = 16 };
    uint8_t pixels[HEIGHT][WIDTH][4];
    for (size_t y = 0; y < HEIGHT; y++) {
        for (size_t x = 0; x < WIDTH; x++)
            memset(pixels[y][x], (int)(80 * (2 * (y / (HEIGHT / 2)) + x / (WIDTH / 2))), 4);
    }
    unsigned char *bytes = NULL;
    unsigned long count = 0;
    tjhandle encoder = tjInitCompress();
    assert_int_equal(tjCompress2(encoder, pixels[0][0], WIDTH, 4 * WIDTH, HEIGHT, pixel_format, &bytes,
                                 &count, TJSAMP_444, 95, 0),
                     0);
    OwnedText text = {0};
    text_append(&text, (const char *)bytes, 2); // start of image
    text_append(&text, segments, length);
    text_append(&text, (const char *)bytes + 2, count - 2);
    file_write_bytes(path, text.items, text.count);
    tjFree(bytes);
    tjDestroy(encoder);
}

TEST(jpeg_is_turned_upright)
{
    // quarters in reading order, as the orientation's place of row 0 and column 0 has them
    static const int quarters[9][4] = {{0},          {0, 1, 2, 3}, {1, 0, 3, 2}, {3, 2, 1, 0}, {2, 3, 0, 1},
                                       {0, 2, 1, 3}, {2, 0, 3, 1}, {3, 1, 2, 0}, {1, 3, 0, 2}};
    for (int orientation = 0; orientation <= 9; orientation++) {
        char segment[] = "\xFF\xE1\0\x22"
                         "Exif\0\0MM\0\x2A\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\0\0\0\0\0\0\0";
        segment[29] = (char)orientation;
        jpeg_write("turned.jpg", segment, sizeof segment - 1, TJPF_RGBX);
        MessageList messages = {0};
        OwnedImage image;
        assert_true(image_read(&image, "turned.jpg", NULL, &messages));
        check_no_messages(&messages);
        const bool is_upright = orientation < 5 || orientation > 8;
        assert_int_equal(image.width, is_upright ? 32 : 16);
        assert_int_equal(image.height, is_upright ? 16 : 32);
        const int *expected = quarters[orientation >= 1 && orientation <= 8 ? orientation : 1];
        for (size_t i = 0; i < 4; i++) {
            const size_t x = (1 + 2 * (i % 2)) * image.width / 4, y = (1 + 2 * (i / 2)) * image.height / 4;
            const float value = image.values[(y * image.width + x) * 3];
            assert_float_equal(value, (float)(80 * expected[i]) / 255, 0.02F);
        }
    }
}

TEST(jpeg_of_other_colors)
{
    static const char p3[] = "\xFF\xE2\0\x1A"
                             "ICC_PROFILE\0\1\1Display P3",
                      srgb[] = "\xFF\xE2\0\x14"
                               "ICC_PROFILE\0\1\1sRGB";
    jpeg_write("a.jpg", p3, sizeof p3 - 1, TJPF_RGBX);
    check_warning("a.jpg", "'a.jpg': JPEG: the color profile is ignored; the colors are taken for sRGB");
    jpeg_write("a.jpg", srgb, sizeof srgb - 1, TJPF_RGBX);
    check_warning("a.jpg", NULL);
    jpeg_write("a.jpg", "", 0, TJPF_CMYK);
    MessageList messages = {0};
    Image image;
    assert_false(image_read(&image, "a.jpg", NULL, &messages));
    check_only_message(&messages, "cannot read 'a.jpg': JPEG: CMYK colors are not supported; "
                                  "convert the image to RGB");
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

static void check_refused(const char *bytes, size_t length, const char *reason)
{
    file_write_bytes("bad", bytes, length);
    MessageList messages = {0};
    Image image;
    assert_false(image_read(&image, "bad", NULL, &messages));
    assert_null(image.values);
    check_only_message(&messages, formatted("cannot read 'bad': %s", reason));
}

#define CHECK_REFUSED(bytes, reason) check_refused(bytes, sizeof(bytes) - 1, reason)

TEST(bad_files)
{
    CHECK_REFUSED("", "neither PNG, JPEG, PPM, EXR nor NPY");
    CHECK_REFUSED("hello", "neither PNG, JPEG, PPM, EXR nor NPY");
    CHECK_REFUSED("P6\n1 x\n255\n", "PPM: the header is damaged");
    CHECK_REFUSED("P6\n1 1\n70000\nabc", "PPM: the maximum must be 1 to 65535, not 70000");
    CHECK_REFUSED("P6\n0 1\n255\n", "the image is empty");
    CHECK_REFUSED("P6\n2 2\n255\n12345678901", "PPM: the file ends too early");
    CHECK_REFUSED("P6\n2000000000 2000000000\n255\n123", "the file is too short for its image");
    CHECK_REFUSED("P3 1 1 9 1 2 x", "PPM: value 3 of 3 is missing or not a number");
    CHECK_REFUSED("P3 1 1 9 1 12 3", "PPM: value 2, 12, is above the maximum, 9");
    CHECK_REFUSED("\x93NUMPY\x04\0\0\0", "NPY: the header is damaged");
    CHECK_REFUSED("\x93NUMPY\x01\0\xFF\0{}", "NPY: the header is damaged");
    CHECK_REFUSED("\x93NUMPY\x01\0\x02\0{}", "NPY: the type must be <f4, <f8, <u4 or |u1");
    CHECK_REFUSED("\x93NUMPY\x01\0\x27\0{'descr': '<f4', 'fortran_order': True}",
                  "NPY: the array must be in C order");
    CHECK_REFUSED("\x93NUMPY\x01\0\x38\0{'descr':'<f4','fortran_order':False,'shape':(2000, 2)}  ",
                  "the file is too short for its image");
    CHECK_REFUSED("\x93NUMPY\x01\0\x38\0{'descr':'<f4','fortran_order':False,'shape':(5,)}       ",
                  "NPY: the array must have 2 or 3 dimensions");
    CHECK_REFUSED("\x89PNG", "PNG: the file ends too early");
    CHECK_REFUSED("\x89PNGxxxxxxxxxxxxxxx", "PNG: PNG file corrupted by ASCII conversion");
    CHECK_REFUSED("\x76\x2F\x31\x01", "EXR: Unable to read magic and version flags");
}

static long peak_kibibytes(void)
{
    struct rusage usage;
    assert_int_equal(getrusage(RUSAGE_SELF, &usage), 0);
    return usage.ru_maxrss;
}

// The file is refused before anything of the declared size is allocated. One of its rows alone would be 300
// MB.
TEST(png_that_declares_too_much)
{
    long before = peak_kibibytes();
    CHECK_REFUSED("\x89PNG\r\n\x1A\n\0\0\0\x0D"
                  "\x49\x48\x44\x52\x02\xFA\xF0\x80\x7F\xFF\xFF\xFF\x10\x02\x00\x00\x00"
                  "\x3A\xFA\x01\x4B"
                  "\0\0\0\0IDAT\x35\xAF\x06\x1E",
                  "the file is too short for its image");
    assert_true(peak_kibibytes() - before < 64 * 1024);
}

// The size that a note declares, here 1.8 GB, is never allocated.
TEST(png_with_a_large_note)
{
    long before = peak_kibibytes();
    CHECK_REFUSED("\x89PNG\r\n\x1A\n\0\0\0\x0D"
                  "IHDR\0\0\0\1\0\0\0\1\x08\x02\0\0\0"
                  "\x90\x77\x53\xDE"
                  "\x70\0\0\0tEXtabc",
                  "PNG: the file ends too early");
    assert_true(peak_kibibytes() - before < 64 * 1024);
}

// 2 x 2 pixels are fewer than 5, 3 x 2 are not.
TEST(pixels_are_limited)
{
    const ImageReadOptions options = {.max_pixels = 5};
    file_write_bytes("small.ppm", "P6 2 2 255 123456789abc", 23);
    MessageList messages = {0};
    Image image;
    assert_true(image_read(&image, "small.ppm", &options, &messages));
    image_free(&image);
    file_write_bytes("large.ppm", "P6 3 2 255 123456789abcdefghi", 29);
    assert_false(image_read(&image, "large.ppm", &options, &messages));
    check_only_message(&messages, "cannot read 'large.ppm': the image has 3 x 2 pixels; max-pixels allows 5");
    image = image_read_file("large.ppm");
    image_free(&image);
    unlink("small.ppm");
    unlink("large.ppm");
}

TEST(text_pixmap)
{
    const char bytes[] = "P3 # colors\n# more\n2 1\n4\n0 1 2\n3 4 # last\n1";
    file_write_bytes("text.ppm", bytes, sizeof bytes - 1);
    OwnedImage image = image_read_file("text.ppm");
    assert_int_equal(image.width, 2);
    assert_int_equal(image.channels, 3);
    const float expected[] = {0, 0.25F, 0.5F, 0.75F, 1, 0.25F};
    assert_memory_equal(image.values, expected, sizeof expected);
}

TEST_MAIN(folder_open, folder_close)
