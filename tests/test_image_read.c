// Reads images as other programs write them, with other colors or orientations, and files that are damaged,
// too large or not images.
#include "host/image/image.h"
#include "tests/check.h"
#include "tests/files.h"

#include <png.h>
#include <sys/resource.h>
#include <turbojpeg.h>

static Image image_read_file(const char *path)
{
    MessageList messages = {0};
    Image image;
    assert_true(image_read(&image, path, NULL, &messages));
    assert_int_equal(messages.count, 0);
    return image;
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
// with application segments or other bytes before its image.
static void jpeg_write(const char *path, const char *segments, size_t length, int pixel_format, int flags)
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
                                 &count, TJSAMP_444, 95, flags),
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
        jpeg_write("turned.jpg", segment, sizeof segment - 1, TJPF_RGBX, 0);
        OwnedImage image = image_read_file("turned.jpg");
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

static void check_refused(const char *bytes, size_t length, const char *reason)
{
    file_write_bytes("bad", bytes, length);
    MessageList messages = {0};
    Image image;
    assert_false(image_read(&image, "bad", NULL, &messages));
    assert_null(image.values);
    check_only_message(&messages, formatted("cannot read 'bad': %s", reason));
}

// Bytes between segments are skipped, and the rows that a file lacks are gray. A file that ends before its
// image is refused.
TEST(damaged_jpeg)
{
    jpeg_write("a.jpg", "", 0, TJPF_RGBX, 0);
    OwnedImage expected = image_read_file("a.jpg");
    OwnedMessageList messages = {0};
    OwnedText text = {0};
    assert_true(text_read_file(&text, "a.jpg", &messages));
    jpeg_write("a.jpg", "\xFF\xFE\0\2xy", 6, TJPF_RGBX, 0);
    check_warning("a.jpg",
                  "'a.jpg': JPEG: Corrupt JPEG data: 2 extraneous bytes before marker 0xe0; the image "
                  "may be damaged");
    OwnedImage image;
    assert_true(image_read(&image, "a.jpg", NULL, &messages));
    assert_memory_equal(image.values, expected.values, sizeof *image.values * 32 * 16 * 3);
    file_write_bytes("a.jpg", text.items, text.count - 20);
    check_warning("a.jpg", "the image may be damaged");
    check_refused(text.items, 100, "JPEG: Premature end of JPEG file");
}

// An error that ends the image is refused, though the decoder warned before.
TEST(jpeg_that_ends_after_a_warning)
{
    jpeg_write("a.jpg", "\xFF\xFE\0\2xy", 6, TJPF_RGBX, TJFLAG_PROGRESSIVE);
    OwnedMessageList messages = {0};
    OwnedText text = {0};
    assert_true(text_read_file(&text, "a.jpg", &messages));
    char *scan = memmem(text.items, text.count, "\xFF\xDA", 2);
    assert_non_null(scan);
    const size_t left = text.count - (size_t)(scan - text.items);
    char *codes = memmem(scan, left, "\xFF\xC4", 2);
    assert_non_null(codes);
    memset(codes + 5, 0xFF, 16); // the numbers of Huffman codes
    check_refused(text.items, text.count, "JPEG: Bogus Huffman table definition");
}

TEST(jpeg_of_other_colors)
{
    static const char p3[] = "\xFF\xE2\0\x1A"
                             "ICC_PROFILE\0\1\1Display P3",
                      srgb[] = "\xFF\xE2\0\x14"
                               "ICC_PROFILE\0\1\1sRGB";
    jpeg_write("a.jpg", p3, sizeof p3 - 1, TJPF_RGBX, 0);
    check_warning("a.jpg", "'a.jpg': JPEG: the color profile is ignored; the colors are taken for sRGB");
    jpeg_write("a.jpg", srgb, sizeof srgb - 1, TJPF_RGBX, 0);
    check_warning("a.jpg", NULL);
    jpeg_write("a.jpg", "", 0, TJPF_CMYK, 0);
    MessageList messages = {0};
    Image image;
    assert_false(image_read(&image, "a.jpg", NULL, &messages));
    check_only_message(&messages, "cannot read 'a.jpg': JPEG: CMYK colors are not supported; "
                                  "convert the image to RGB");
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
