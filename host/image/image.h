// Pictures: float colors in, files out. Rows run from the top.
#pragma once

#include "host/base/message.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum { TRANSFER_SRGB, TRANSFER_NONE } Transfer;
typedef enum { IMAGE_PNG, IMAGE_PPM, IMAGE_EXR, IMAGE_NPY, IMAGE_UNKNOWN } ImageFormat;

typedef struct {
    const char *key, *value;
} ImageNote; // written into PNG text chunks and EXR string attributes

typedef struct {
    ImageFormat format;
    uint32_t width, height, channels; // channels: 3 (color), 1 for other arrays of NPY
    Transfer transfer;                // PNG, PPM; ignored by EXR and NPY, which hold linear floats
    unsigned bits;                    // 8 or 16: PNG, PPM
    char npy_type;                    // 'f': float32, 'd': float64, 'u': uint32
    const ImageNote *notes;           // ended by a NULL key
} ImageHeader;

ImageFormat image_format_of(const char *path); // by its ending, any case

// Written row by row, so that a large picture needs memory for its bands only; nothing is at the target until
// image_writer_commit has renamed it.
typedef struct ImageWriter ImageWriter;
// NULL with an error message where the file cannot be written. The header's notes are read here alone.
ImageWriter *image_writer_open(const char *path, const ImageHeader *header, MessageList *messages);
// `pixels`: row_count x width x channels values of npy_type ('f' for PNG, PPM, EXR), from the top down. False
// with an error message where they cannot be written; no more rows are taken then, and the writer is still to
// be committed, which fails without another message, or abandoned. More rows than the picture has are a
// program's fault.
bool image_writer_rows(ImageWriter *writer, const void *pixels, uint32_t row_count, MessageList *messages);
// Completes the file, so that only the renaming is left: of several files none is put in place before all are
// whole. False with an error message where that fails; the writer is still to be committed or abandoned.
bool image_writer_settle(ImageWriter *writer, MessageList *messages);
// Completes the file unless it is settled, and renames it to its target; false with an error message where
// that fails, and the target is as it was. Frees the writer either way. Missing rows are a program's fault.
bool image_writer_commit(ImageWriter *writer, MessageList *messages);
void image_writer_abandon(ImageWriter *writer); // removes the file and frees the writer; NULL is accepted

// One linear value to a display value of 2^bits - 1 steps: clipped to 0..1, curve, rounded to nearest.
// NaN gives 0. sRGB: IEC 61966-2-1:1999.
uint32_t image_quantize(float value, Transfer transfer, unsigned bits);

// A whole picture in memory; what `image_read` gives is linear unless the file holds display values, which
// are then value / maximum with `transfer` telling the curve they were written with (PNG: from its sRGB
// chunk).
typedef struct {
    uint32_t width, height, channels;
    float *values;
    Transfer transfer;
    bool display; // 8 or 16 bit display values, scaled to 0..1, curve not undone
} Image;
// Reads PNG, JPEG, PPM, EXR or NPY, as its first bytes say. False with an error message; `image` is then
// empty and need not be freed.
bool image_read(Image *image, const char *path, MessageList *messages);
// The same, and returns its values in double: as the file has them where it holds doubles. Caller frees both.
// NULL with an error message where it fails; `image` is then empty.
double *image_read_doubles(Image *image, const char *path, MessageList *messages);
void image_free(Image *image);
