#include "host/image/codec.h"

#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/statvfs.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "NPY rows are written as they lie in memory");

static const struct {
    const char *ending;
    const Encoder *encoder;
} formats[IMAGE_UNKNOWN] = {
    [IMAGE_PNG] = {".png", &png_encoder},
    [IMAGE_PPM] = {".ppm", &ppm_encoder},
    [IMAGE_EXR] = {".exr", &exr_encoder},
    [IMAGE_NPY] = {".npy", &npy_encoder},
};

const char *const tone_names[TONE_COUNT] = {"none", "filmic"};

ImageFormat image_format_of(const char *path)
{
    const char *ending = strrchr(path, '.');
    ImageFormat format = 0;
    while (format < IMAGE_UNKNOWN && !(ending && strcasecmp(ending, formats[format].ending) == 0))
        format++;
    return format;
}

bool image_format_holds_floats(ImageFormat format)
{
    return format == IMAGE_EXR || format == IMAGE_NPY;
}

static const Encoder *encoder_of(ImageFormat format)
{
    if (format < IMAGE_UNKNOWN) return formats[format].encoder;
    fault("an image of unknown format");
}

uint64_t image_bytes(const ImageHeader *header)
{
    size_t channel_count = header->channels;
    for (size_t i = 0; i < header->layer_count; i++)
        channel_count += header->layers[i].channel_count;
    const uint64_t values = (uint64_t)header->width * header->height * channel_count;
    if (header->format == IMAGE_PNG || header->format == IMAGE_PPM) return values * (header->bits / 8);
    return values * (header->npy_type == 'd' ? sizeof(double) : sizeof(float));
}

static uint64_t bytes_min(const ImageHeader *header)
{
    const bool is_compressed = header->format == IMAGE_PNG || header->format == IMAGE_EXR;
    return image_bytes(header) / (is_compressed ? DEFLATE_RATIO_MAX : 1);
}

// Returns false with a message if the image does not fit on the disk, however well it is compressed.
static bool image_fits_on_disk(const ImageWriter *writer, MessageList *messages)
{
    struct statvfs disk;
    uint64_t bytes = bytes_min(&writer->header);
    if (!writer->output.has_folder || fstatvfs(writer->output.folder, &disk) != 0) return true;
    double room = (double)disk.f_bavail * (double)disk.f_frsize;
    if (disk.f_blocks == 0 || (double)bytes <= room) return true;
    return message_error(messages, "cannot write '%s': it has %s or more, and its disk has %s left",
                         writer->output.target, text_size((double)bytes).text, text_size(room).text);
}

ImageWriter *image_writer_open(const char *path, const ImageHeader *header, MessageList *messages)
{
    ImageWriter *writer = memory_allocate_zeroed(1, sizeof *writer);
    writer->header = *header;
    writer->encoder = encoder_of(header->format);
    if (output_open(&writer->output, path, messages) && image_fits_on_disk(writer, messages) &&
        writer->encoder->begin(writer, messages))
        return writer;
    image_writer_abandon(writer);
    return NULL;
}

bool image_writer_rows(ImageWriter *writer, const void *pixels, uint32_t row_count, MessageList *messages)
{
    return image_writer_layer_rows(writer, &pixels, row_count, messages);
}

bool image_writer_layer_rows(ImageWriter *writer, const void *const *arrays, uint32_t row_count,
                             MessageList *messages)
{
    if (row_count > writer->header.height - writer->rows_written)
        fault("more rows than the image has: %s", writer->output.target);
    if (writer->failed || !writer->encoder->rows(writer, arrays, row_count, messages)) {
        writer->failed = true;
        return false;
    }
    writer->rows_written += row_count;
    return true;
}

bool image_writer_note(ImageWriter *writer, const ImageNote *note, MessageList *messages)
{
    if (writer->failed || (writer->encoder->note && !writer->encoder->note(writer, note, messages)))
        writer->failed = true;
    return !writer->failed;
}

static void writer_free(ImageWriter *writer)
{
    if (writer->encoder->free) writer->encoder->free(writer);
    output_abandon(&writer->output);
    free(writer);
}

bool image_writer_finish(ImageWriter *writer, MessageList *messages)
{
    if (writer->failed || writer->finished) return !writer->failed;
    if (writer->rows_written < writer->header.height)
        fault("an image with missing rows: %s", writer->output.target);
    writer->finished = (!writer->encoder->end || writer->encoder->end(writer, messages)) &&
                       output_finish(&writer->output, messages);
    writer->failed = !writer->finished;
    return writer->finished;
}

bool image_writer_commit(ImageWriter *writer, MessageList *messages)
{
    bool done = image_writer_finish(writer, messages) && output_commit(&writer->output, messages);
    writer_free(writer);
    return done;
}

void image_writer_abandon(ImageWriter *writer)
{
    if (writer) writer_free(writer);
}

bool image_write(const char *path, const ImageHeader *header, const void *pixels, MessageList *messages)
{
    ImageWriter *writer = image_writer_open(path, header, messages);
    if (!writer) return false;
    if (image_writer_rows(writer, pixels, header->height, messages))
        return image_writer_commit(writer, messages);
    image_writer_abandon(writer);
    return false;
}

bool image_refuse(const ImageFile *file, const char *format, ...)
{
    OWNED char *reason = NULL;
    ARGUMENTS_FORMAT(reason, format);
    return message_error(file->messages, "cannot read '%s': %s", file->path, reason);
}

void image_warn(const ImageFile *file, const char *format, ...)
{
    OWNED char *loss = NULL;
    ARGUMENTS_FORMAT(loss, format);
    message_warning(file->messages, "'%s': %s", file->path, loss);
}

bool image_allocate(Image *image, const ImageFile *file, uint64_t width, uint64_t height, uint64_t channels,
                    uint64_t expansion)
{
    if (width == 0 || height == 0 || channels == 0) return image_refuse(file, "the image is empty");
    uint64_t values, bytes, bytes_max;
    if (__builtin_mul_overflow(file->length, expansion, &bytes_max)) bytes_max = UINT64_MAX;
    if (width > UINT32_MAX || height > UINT32_MAX || channels > UINT32_MAX ||
        __builtin_mul_overflow(width * height, channels, &values) ||
        __builtin_mul_overflow(values, sizeof *image->values, &bytes) || bytes > bytes_max)
        return image_refuse(file, "the file is too short for its image");
    const uint32_t max_pixels = file->options.max_pixels ? file->options.max_pixels : IMAGE_PIXELS_MAX;
    if (width * height > max_pixels)
        return image_refuse(file, "the image has %ju x %ju pixels; max-pixels allows %u", (uintmax_t)width,
                            (uintmax_t)height, max_pixels);
    if (values > SIZE_MAX / sizeof *image->values ||
        !(image->values = calloc((size_t)values, sizeof *image->values)))
        return image_refuse(file, "the image does not fit into memory");
    image->width = (uint32_t)width;
    image->height = (uint32_t)height;
    image->channels = (uint32_t)channels;
    return true;
}

static const struct {
    const char *start;
    bool (*decode)(Image *image, const ImageFile *file);
} decoders[] = {
    {"\x89PNG", png_decode},   {"P2", ppm_decode},
    {"P3", ppm_decode},        {"P5", ppm_decode},
    {"P6", ppm_decode},        {"\x76\x2F\x31\x01", exr_decode},
    {"\x93NUMPY", npy_decode}, {"\xFF\xD8\xFF", jpeg_decode},
};

static bool (*decoder_of(const void *bytes, size_t length))(Image *image, const ImageFile *file)
{
    for (size_t i = 0; i < COUNT_OF(decoders); i++) {
        const size_t start_length = strlen(decoders[i].start);
        if (length >= start_length && memcmp(bytes, decoders[i].start, start_length) == 0)
            return decoders[i].decode;
    }
    return NULL;
}

static bool image_decode(Image *image, const ImageFile *file)
{
    bool (*decode)(Image *, const ImageFile *) = decoder_of(file->bytes, file->length);
    if (file->options.layer && decode && decode != exr_decode)
        return image_refuse(file, "it has no layer '%.40s': only EXR files have layers", file->options.layer);
    return decode ? decode(image, file) : image_refuse(file, "neither PNG, JPEG, PPM, EXR nor NPY");
}

bool image_bytes_are_known(const void *bytes, size_t length)
{
    return decoder_of(bytes, length) != NULL;
}

bool image_is_known(const char *path)
{
    char bytes[8];
    FILE *file = fopen(path, "rbe");
    const size_t length = file ? fread(bytes, 1, sizeof bytes, file) : 0;
    if (file) fclose(file);
    return image_bytes_are_known(bytes, length);
}

bool image_read_bytes(Image *image, const Source *source, const ImageReadOptions *options,
                      MessageList *messages)
{
    *image = (Image){.transfer = TRANSFER_NONE};
    const ImageFile file = {source->file, options ? *options : (ImageReadOptions){0},
                            (const uint8_t *)source->bytes, source->length, messages};
    const bool done = image_decode(image, &file);
    if (!done) image_free(image);
    return done;
}

bool image_read(Image *image, const char *path, const ImageReadOptions *options, MessageList *messages)
{
    *image = (Image){.transfer = TRANSFER_NONE};
    OwnedText text = {0};
    return text_read_file(&text, path, messages) &&
           image_read_bytes(image, &(Source){path, text_c(&text), text.count}, options, messages);
}

double image_value(const Image *image, size_t i)
{
    return image->doubles ? image->doubles[i] : (double)image->values[i];
}

void image_free(Image *image)
{
    free(image->values);
    free(image->alpha);
    free(image->doubles);
    *image = (Image){0};
}
