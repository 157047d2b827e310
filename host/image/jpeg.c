// Reads JPEG through libjpeg-turbo, and its orientation through libexif.
#include "host/image/codec.h"

#include "host/base/memory.h"

#include <libexif/exif-data.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

// Bounds the declared size by the file's size. This is the expansion of a flat gray image.
enum { JPEG_EXPANSION = 1 << 14 };

// Finds the content of the first application segment with the number (T.81, 1992, annex B) that starts with
// `start`, `start_length` bytes. Returns NULL if there is none before the image.
static const uint8_t *segment_find(const ImageFile *file, uint8_t number, const char *start,
                                   size_t start_length, size_t *length)
{
    size_t at = 2;
    while (at + 4 <= file->length && file->bytes[at] == 0xFF && file->bytes[at + 1] != 0xDA) {
        const size_t size = (size_t)file->bytes[at + 2] << 8 | file->bytes[at + 3];
        if (size < 2 || size > file->length - at - 2) return NULL;
        *length = size - 2;
        if (file->bytes[at + 1] == 0xE0 + number && *length >= start_length &&
            memcmp(file->bytes + at + 4, start, start_length) == 0)
            return file->bytes + at + 4;
        at += 2 + size;
    }
    return NULL;
}

// Returns the orientation from 1, upright, to 8 (Exif 2.32, 2019, section 4.6.4, tag 274).
static unsigned orientation_of(const ImageFile *file)
{
    size_t length;
    const uint8_t *segment = segment_find(file, 1, "Exif\0", 6, &length);
    ExifData *data = segment ? exif_data_new_from_data(segment, (unsigned)length) : NULL;
    if (!data) return 1;
    unsigned orientation = 1;
    const ExifEntry *entry = exif_content_get_entry(data->ifd[EXIF_IFD_0], EXIF_TAG_ORIENTATION);
    if (entry && entry->format == EXIF_FORMAT_SHORT && entry->size >= 2)
        orientation = exif_get_short(entry->data, exif_data_get_byte_order(data));
    exif_data_unref(data);
    return orientation >= 1 && orientation <= 8 ? orientation : 1;
}

// Rotates and mirrors the image so that it is upright.
static void image_orient(Image *image, unsigned orientation)
{
    if (orientation == 1) return;
    const uint32_t width = image->width, height = image->height;
    const bool is_transposed = orientation >= 5;
    const bool from_right = orientation == 2 || orientation == 3 || orientation >= 7;
    const bool from_bottom = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
    float *stored = image->values;
    float *pixel = image->values = memory_allocate((size_t)width * height * 3, sizeof *stored);
    image->width = is_transposed ? height : width;
    image->height = is_transposed ? width : height;
    for (uint32_t y = 0; y < image->height; y++) {
        for (uint32_t x = 0; x < image->width; x++, pixel += 3) {
            uint32_t column = is_transposed ? y : x, row = is_transposed ? x : y;
            column = from_right ? width - 1 - column : column;
            row = from_bottom ? height - 1 - row : row;
            memcpy(pixel, stored + ((size_t)row * width + column) * 3, 3 * sizeof *pixel);
        }
    }
    free(stored);
}

static void profile_check(const ImageFile *file)
{
    size_t length;
    const uint8_t *profile = segment_find(file, 2, "ICC_PROFILE", 12, &length);
    if (profile && !memmem(profile, length, "sRGB", 4) && !memmem(profile, length, "s\0R\0G\0B", 7))
        image_warn(file, "JPEG: the color profile is ignored; the colors are taken for sRGB");
}

// Pixels that the decoder does not set keep their bytes.
static bool pixels_decode(tjhandle decoder, const ImageFile *file, const Image *image, uint8_t *bytes)
{
    return tjDecompress2(decoder, file->bytes, file->length, bytes, (int)image->width, 0, (int)image->height,
                         TJPF_RGB, TJFLAG_ACCURATEDCT) == 0;
}

// Returns whether the decoder only warned and set each pixel of `bytes`. Its code for a fatal error after a
// warning is that of the warning, so this decodes again over other bytes, which unset pixels keep.
static bool error_is_warning(tjhandle decoder, const ImageFile *file, const Image *image,
                             const uint8_t *bytes)
{
    const size_t count = (size_t)image->width * image->height * 3;
    OWNED uint8_t *others = tjGetErrorCode(decoder) == TJERR_WARNING ? malloc(count) : NULL;
    if (!others) return false;
    memset(others, 0xFF, count);
    pixels_decode(decoder, file, image, others);
    return memcmp(bytes, others, count) == 0;
}

static bool jpeg_pixels(tjhandle decoder, Image *image, const ImageFile *file)
{
    int width = 0, height = 0, sampling = 0, color_space = 0;
    const int status =
        tjDecompressHeader3(decoder, file->bytes, file->length, &width, &height, &sampling, &color_space);
    if (width == 0 || (status && tjGetErrorCode(decoder) != TJERR_WARNING)) // decompression repeats warnings
        return image_refuse(file, "JPEG: %s", tjGetErrorStr2(decoder));
    if (color_space == TJCS_CMYK || color_space == TJCS_YCCK)
        return image_refuse(file, "JPEG: CMYK colors are not supported; convert the image to RGB");
    if (!image_allocate(image, file, (uint64_t)width, (uint64_t)height, 3, JPEG_EXPANSION)) return false;
    const size_t count = (size_t)image->width * image->height * 3;
    OWNED uint8_t *bytes = calloc(count, 1);
    if (!bytes) return image_refuse(file, "the image does not fit into memory");
    if (!pixels_decode(decoder, file, image, bytes)) {
        if (!error_is_warning(decoder, file, image, bytes))
            return image_refuse(file, "JPEG: %s", tjGetErrorStr2(decoder));
        image_warn(file, "JPEG: %s; the image may be damaged", tjGetErrorStr2(decoder));
    }
    for (size_t i = 0; i < count; i++)
        image->values[i] = (float)bytes[i] / 255.0F;
    return true;
}

bool jpeg_decode(Image *image, const ImageFile *file)
{
    tjhandle decoder = tjInitDecompress();
    if (!decoder) return image_refuse(file, "JPEG: %s", tjGetErrorStr());
    const bool done = jpeg_pixels(decoder, image, file);
    tjDestroy(decoder);
    if (!done) return false;
    image_orient(image, orientation_of(file));
    profile_check(file);
    image->display = true;
    image->transfer = TRANSFER_SRGB;
    return true;
}
