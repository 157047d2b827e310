// Reads and writes PNG through libpng (Portable Network Graphics, second edition, 2003).
#include "host/image/codec.h"
#include "host/image/display.h"
#include "host/image/transfer.h"

#include "host/base/fault.h"
#include "host/base/memory.h"

#include <errno.h>
#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

// State of reading and writing, which libpng passes to the error handler.
typedef struct {
    png_structp png;
    png_infop info;
    uint8_t *bytes; // the rows to write, or all rows read
    char problem[256];
} PngState;

static void png_fail(png_structp png, png_const_charp message)
{
    PngState *state = png_get_error_ptr(png);
    snprintf(state->problem, sizeof state->problem, "%s", message);
    png_longjmp(png, 1);
}

static void png_ignore(png_structp png, png_const_charp message)
{
    (void)png, (void)message;
}

static void png_write_bytes(png_structp png, png_bytep bytes, size_t size)
{
    if (fwrite(bytes, 1, size, png_get_io_ptr(png)) != size) png_error(png, strerror(errno));
}

static void png_flush_none(png_structp png)
{
    (void)png;
}

static bool png_write_failed(ImageWriter *writer, MessageList *messages)
{
    return message_error(messages, "cannot write '%s': %s", writer->output.target,
                         ((PngState *)writer->state)->problem);
}

// Adds a note as tEXt, which more programs show, if it is ASCII, else as iTXt, which is UTF-8.
static void png_note(PngState *state, const ImageNote *note)
{
    bool is_ascii = true;
    for (const char *at = note->value; *at; at++)
        is_ascii = is_ascii && (unsigned char)*at < 0x80;
    const png_text chunk = {.compression = is_ascii ? PNG_TEXT_COMPRESSION_NONE : PNG_ITXT_COMPRESSION_NONE,
                            .key = (char *)note->key,
                            .text = (char *)note->value};
    png_set_text(state->png, state->info, &chunk, 1); // copies both
}

static bool png_begin(ImageWriter *writer, MessageList *messages)
{
    const ImageHeader *header = &writer->header;
    PngState *state = writer->state = memory_allocate_zeroed(1, sizeof *state);
    state->png = png_create_write_struct(PNG_LIBPNG_VER_STRING, state, png_fail, png_ignore);
    state->info = state->png ? png_create_info_struct(state->png) : NULL;
    if (!state->info) fault("libpng cannot write");
    if (setjmp(png_jmpbuf(state->png))) return png_write_failed(writer, messages);

    png_set_write_fn(state->png, writer->output.file, png_write_bytes, png_flush_none);
    png_set_user_limits(state->png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_IHDR(state->png, state->info, header->width, header->height, (int)header->bits,
                 (header->channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB) |
                     (header->layer_count > 0 ? PNG_COLOR_MASK_ALPHA : 0),
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (header->transfer == TRANSFER_SRGB) png_set_sRGB(state->png, state->info, PNG_sRGB_INTENT_PERCEPTUAL);
    for (const ImageNote *note = header->notes; note && note->key; note++)
        png_note(state, note);
    png_set_filter(state->png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_compression_level(state->png, 1);
    // filtered rows repeat mostly in runs: RLE is as fast as a longer match search, and its files are smaller
    png_set_compression_strategy(state->png, Z_RLE);
    png_write_info(state->png, state->info);
    return true;
}

// Inserts alpha, whose values are linear, after the bytes of each pixel's color. `bytes` can hold both.
static void alpha_interleave(uint8_t *bytes, const float *alpha, const ImageHeader *header,
                             size_t pixel_count)
{
    const size_t value_size = header->bits / 8, color_size = header->channels * value_size,
                 pixel_size = color_size + value_size;
    for (size_t i = pixel_count; i-- > 0;) {
        memmove(bytes + i * pixel_size, bytes + i * color_size, color_size);
        transfer_quantize(bytes + i * pixel_size + color_size, &alpha[i], 1, TRANSFER_NONE, header->bits);
    }
}

static bool png_rows(ImageWriter *writer, const void *const *arrays, uint32_t row_count,
                     MessageList *messages)
{
    const ImageHeader *header = &writer->header;
    PngState *state = writer->state;
    const size_t alpha_size = header->layer_count > 0 ? (size_t)header->width * (header->bits / 8) : 0,
                 row_size = display_row_size(header) + alpha_size;
    state->bytes = memory_resize(state->bytes, row_count, row_size);
    display_rows(state->bytes, arrays[0], header, writer->rows_written, row_count);
    if (alpha_size > 0) alpha_interleave(state->bytes, arrays[1], header, (size_t)header->width * row_count);
    if (setjmp(png_jmpbuf(state->png))) return png_write_failed(writer, messages);
    for (uint32_t row = 0; row < row_count; row++)
        png_write_row(state->png, state->bytes + row * row_size);
    return true;
}

static bool png_end(ImageWriter *writer, MessageList *messages)
{
    PngState *state = writer->state;
    if (setjmp(png_jmpbuf(state->png))) return png_write_failed(writer, messages);
    png_write_end(state->png, state->info); // with the notes that are not written yet
    return true;
}

static bool png_late_note(ImageWriter *writer, const ImageNote *note, MessageList *messages)
{
    PngState *state = writer->state;
    if (setjmp(png_jmpbuf(state->png))) return png_write_failed(writer, messages);
    png_note(state, note);
    return true;
}

static void png_free_writer(ImageWriter *writer)
{
    PngState *state = writer->state;
    if (!state) return;
    png_destroy_write_struct(&state->png, &state->info);
    free(state->bytes);
    free(state);
}

const Encoder png_encoder = {png_begin, png_rows, png_end, png_free_writer, png_late_note};

typedef struct {
    PngState state;
    const ImageFile *file;
    size_t at;
    int passes; // over all rows: 7 if they are interlaced
} PngReader;

static void png_read_bytes(png_structp png, png_bytep bytes, size_t size)
{
    PngReader *reader = png_get_io_ptr(png);
    if (size > reader->file->length - reader->at) png_error(png, "the file ends too early");
    memcpy(bytes, reader->file->bytes + reader->at, size);
    reader->at += size;
}

// Sets up the reader for gray or RGB of 8 or 16 bits and allocates all rows.
static bool png_prepare(PngReader *reader, Image *image)
{
    png_structp png = reader->state.png;
    png_infop info = reader->state.info;
    png_set_read_fn(png, reader, png_read_bytes);
    png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    // Notes and the like are skipped, because libpng allocates what they declare, up to 2 GB each. A color
    // profile is kept as it is stored.
    png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, NULL, -1);
    png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_AS_DEFAULT, (const png_byte *)"sRGB\0gAMA\0cHRM", 3);
    png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_ALWAYS, (const png_byte *)"iCCP", 1);
    png_read_info(png, info);
    if (png_get_color_type(png, info) == PNG_COLOR_TYPE_PALETTE)
        png_set_palette_to_rgb(png);
    else if (png_get_bit_depth(png, info) < 8)
        png_set_expand_gray_1_2_4_to_8(png);
    if (png_get_valid(png, info, PNG_INFO_tRNS)) png_set_tRNS_to_alpha(png);
    reader->passes = png_set_interlace_handling(png);

    // A byte holds at most 8 palette pixels. Checked before libpng allocates a row of the declared width.
    if (!image_allocate(image, reader->file, png_get_image_width(png, info), png_get_image_height(png, info),
                        png_get_color_type(png, info) & PNG_COLOR_MASK_COLOR ? 3 : 1,
                        UINT64_C(8) * DEFLATE_RATIO_MAX * 3 * sizeof *image->values))
        return false;
    png_read_update_info(png, info);
    reader->state.bytes = calloc(image->height, png_get_rowbytes(png, info));
    return reader->state.bytes || image_refuse(reader->file, "the image does not fit into memory");
}

static unsigned png_sample(const uint8_t *bytes, size_t i, bool is_wide)
{
    return is_wide ? (unsigned)(bytes[2 * i] << 8 | bytes[2 * i + 1]) : bytes[i];
}

static void png_values(const PngReader *reader, Image *image)
{
    const size_t count = (size_t)image->width * image->height;
    const size_t channels = image->channels,
                 samples = png_get_channels(reader->state.png, reader->state.info);
    const uint8_t *bytes = reader->state.bytes;
    const bool is_wide = png_get_bit_depth(reader->state.png, reader->state.info) == 16;
    const unsigned largest = is_wide ? UINT16_MAX : UINT8_MAX;
    bool is_transparent = false;
    for (size_t i = 0; i < count; i++) {
        for (size_t channel = 0; channel < channels; channel++)
            image->values[i * channels + channel] =
                (float)png_sample(bytes, i * samples + channel, is_wide) / (float)largest;
        is_transparent |= samples > channels && png_sample(bytes, i * samples + channels, is_wide) < largest;
    }
    if (!is_transparent) return;
    image->alpha = memory_allocate(count, sizeof *image->alpha);
    for (size_t i = 0; i < count; i++)
        image->alpha[i] = (float)png_sample(bytes, i * samples + channels, is_wide) / (float)largest;
}

static bool png_read_all(PngReader *reader, Image *image)
{
    png_structp png = reader->state.png;
    if (setjmp(png_jmpbuf(png))) return image_refuse(reader->file, "PNG: %s", reader->state.problem);
    if (!png_prepare(reader, image)) return false;
    size_t row_size = png_get_rowbytes(png, reader->state.info);
    for (int pass = 0; pass < reader->passes; pass++)
        for (uint32_t row = 0; row < image->height; row++)
            png_read_row(png, reader->state.bytes + row * row_size, NULL);
    png_read_end(png, NULL);
    return true;
}

// Warns of colors that are not sRGB, unless the file declares them to be.
static void png_check_colors(const PngReader *reader)
{
    png_structp png = reader->state.png;
    png_infop info = reader->state.info;
    static const char meaning[] = "is ignored; the colors are taken for sRGB";
    if (png_get_valid(png, info, PNG_INFO_sRGB)) return;
    png_unknown_chunkp chunks;
    const int chunk_count = png_get_unknown_chunks(png, info, &chunks);
    for (int i = 0; i < chunk_count; i++) {
        const char *name = (const char *)chunks[i].data; // ended by a null
        const int length = (int)strnlen(name, chunks[i].size < 79 ? chunks[i].size : 79);
        if (!memmem(name, (size_t)length, "sRGB", 4))
            image_warn(reader->file, "PNG: the color profile '%.*s' %s", length, name, meaning);
        return; // it overrides gamma and primaries
    }
    double gamma;
    if (png_get_gAMA(png, info, &gamma) && fabs(gamma * 2.2 - 1) > 0.05)
        image_warn(reader->file, "PNG: the gamma of 1/%.3g %s", 1 / gamma, meaning);
    static const double rec_709[] = {0.3127, 0.329, 0.64, 0.33, 0.3, 0.6, 0.15, 0.06};
    double c[8];
    if (!png_get_cHRM(png, info, &c[0], &c[1], &c[2], &c[3], &c[4], &c[5], &c[6], &c[7])) return;
    for (size_t i = 0; i < 8; i++) {
        if (fabs(c[i] - rec_709[i]) < 0.005) continue;
        image_warn(reader->file, "PNG: the choice of primaries %s", meaning);
        return;
    }
}

bool png_decode(Image *image, const ImageFile *file)
{
    PngReader reader = {.file = file};
    PngState *state = &reader.state;
    state->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, state, png_fail, png_ignore);
    state->info = state->png ? png_create_info_struct(state->png) : NULL;
    if (!state->info) fault("libpng cannot read");
    bool done = png_read_all(&reader, image);
    if (done) {
        png_values(&reader, image);
        png_check_colors(&reader);
        image->display = true;
        image->transfer =
            png_get_valid(state->png, state->info, PNG_INFO_sRGB) ? TRANSFER_SRGB : TRANSFER_NONE;
    }
    png_destroy_read_struct(&state->png, &state->info, NULL);
    free(state->bytes);
    return done;
}
