// The interface between image.c and a file format: an encoder of rows and a decoder of whole files.
#pragma once

#include "host/base/output.h"
#include "host/image/image.h"

// Deflate, in PNG and EXR, expands a byte to at most 1032 (zlib's technical details).
enum { DEFLATE_RATIO_MAX = 1032 };

// Encoders. `state` belongs to the encoder; image.c opens and renames the file.
struct ImageWriter {
    ImageHeader header;
    OutputFile output;
    const struct Encoder *encoder;
    void *state;
    uint32_t rows_written;
    bool finished, failed;
};

// Functions return false with a message on failure. After a failure only `free` is called.
typedef struct Encoder {
    bool (*begin)(ImageWriter *writer, MessageList *messages);
    // arrays[0] has the pixels, and the following ones those of the header's layers
    bool (*rows)(ImageWriter *writer, const void *const *arrays, uint32_t row_count, MessageList *messages);
    bool (*end)(ImageWriter *writer, MessageList *messages); // after the last row; may be NULL
    void (*free)(ImageWriter *writer); // frees `state`, which may be incomplete or NULL; may be NULL
    // Called after any row. If it is NULL, notes are lost.
    bool (*note)(ImageWriter *writer, const ImageNote *note, MessageList *messages);
} Encoder;

extern const Encoder png_encoder, ppm_encoder, exr_encoder, npy_encoder;

// Decoders read a file's bytes from memory.
typedef struct {
    const char *path;
    ImageReadOptions options;
    const uint8_t *bytes;
    size_t length;
    MessageList *messages;
} ImageFile;

// A decoder reports a failure with image_refuse, and image.c frees the image.
bool png_decode(Image *image, const ImageFile *file);
bool ppm_decode(Image *image, const ImageFile *file);
bool exr_decode(Image *image, const ImageFile *file);
bool npy_decode(Image *image, const ImageFile *file);
bool jpeg_decode(Image *image, const ImageFile *file);

// Adds `cannot read 'path': …` and returns false.
bool image_refuse(const ImageFile *file, const char *format, ...) __attribute__((format(printf, 2, 3)));
// Adds the warning `'path': …`, which states what the image loses.
void image_warn(const ImageFile *file, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Allocates zeroed values for an image of the declared size. Fails if it is empty or has more than
// `expansion` bytes of values per byte of the file.
bool image_allocate(Image *image, const ImageFile *file, uint64_t width, uint64_t height, uint64_t channels,
                    uint64_t expansion);
