// What a file format gives to image.c: an encoder of rows and a decoder of whole files.
#pragma once

#include "host/base/output.h"
#include "host/image/image.h"

// Encoders. `state` is the encoder's own; image.c opens and renames the file.
struct ImageWriter {
    ImageHeader header;
    OutputFile output;
    const struct Encoder *encoder;
    void *state;
    uint32_t rows_written;
    bool settled, failed;
};

// A function that fails adds a message and returns false; the writer is then only freed.
typedef struct Encoder {
    bool (*begin)(ImageWriter *writer, MessageList *messages);
    bool (*rows)(ImageWriter *writer, const void *pixels, uint32_t row_count, MessageList *messages);
    bool (*end)(ImageWriter *writer, MessageList *messages); // what follows the last row; NULL: nothing does
    void (*free)(ImageWriter *writer); // of `state`, also half made or NULL; may be NULL
} Encoder;

extern const Encoder png_encoder, ppm_encoder, exr_encoder, npy_encoder;

// Decoders work on a file's bytes in memory.
typedef struct {
    const char *path;
    const uint8_t *bytes;
    size_t length;
    MessageList *messages;
    double *
        *doubles; // NULL, or where the values of a file that holds doubles go as they are; the reader frees
} ImageFile;

// A decoder that fails says why with image_refuse; image.c frees what the image holds then.
bool png_decode(Image *image, const ImageFile *file);
bool ppm_decode(Image *image, const ImageFile *file);
bool exr_decode(Image *image, const ImageFile *file);
bool npy_decode(Image *image, const ImageFile *file);
bool jpeg_decode(Image *image, const ImageFile *file);

// Adds `cannot read 'path': …` and returns false.
bool image_refuse(const ImageFile *file, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Zeroed values for a picture of a declared size, which is refused where it is empty, or where the file would
// have to hold more than `expansion` bytes of values in each of its own bytes.
bool image_allocate(Image *image, const ImageFile *file, uint64_t width, uint64_t height, uint64_t channels,
                    uint64_t expansion);
