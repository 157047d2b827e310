// Reads and writes images of float colors. Rows run from the top.
#pragma once

#include "host/base/message.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum { TRANSFER_SRGB, TRANSFER_NONE } Transfer;
typedef enum { TONE_NONE, TONE_FILMIC, TONE_COUNT } Tone; // curves from linear values to displayed light
extern const char *const tone_names[TONE_COUNT];
typedef enum { IMAGE_PNG, IMAGE_PPM, IMAGE_EXR, IMAGE_NPY, IMAGE_UNKNOWN } ImageFormat;

typedef struct {
    const char *key, *value;
} ImageNote; // written into PNG text chunks and EXR string attributes

// Additional values per pixel, in an EXR only.
typedef struct {
    const char *channels; // their names in turn, separated by commas, such as "normal.X,normal.Y,normal.Z"
    size_t channel_count;
    char type; // 'f': float32, 'u': uint32
} ImageLayer;

typedef struct {
    ImageFormat format;
    uint32_t width, height, channels; // channels: 3 (color), 1 for other arrays of NPY
    Transfer transfer;                // PNG, PPM; ignored by EXR and NPY, which hold linear floats
    unsigned bits;                    // 8 or 16: PNG, PPM
    char npy_type;                    // 'f': float32, 'd': float64, 'u': uint32
    const ImageNote *notes;           // ended by a NULL key
    // The image's place in a larger one, whose size is 0 if there is none, for EXR. It also offsets dither.
    uint32_t full_width, full_height, left, top;
    const ImageLayer *layers; // after the color, of an EXR; a PNG can have only alpha
    size_t layer_count;       // at most IMAGE_LAYERS_MAX
    double exposure;          // in stops, before the tone curve: PNG, PPM
    Tone tone;                // before the transfer: PNG, PPM
    bool dither;              // ordered, of 8 bits: PNG, PPM
} ImageHeader;

enum { IMAGE_LAYERS_MAX = 16 };

ImageFormat image_format_of(const char *path); // by its ending, in any case
// Returns whether the format holds linear floats, not display values.
bool image_format_holds_floats(ImageFormat format);

uint64_t image_bytes(const ImageHeader *header); // of its pixels, uncompressed

// Writes an image row by row, so that a large one needs memory for one band only. The target path stays
// unchanged until image_writer_commit renames the file.
typedef struct ImageWriter ImageWriter;
// Opens a file. Returns NULL with an error message if it cannot be written or cannot fit on its disk. The
// header's notes and layers need not outlive the writer.
ImageWriter *image_writer_open(const char *path, const ImageHeader *header, MessageList *messages);
// Writes rows from the top. `pixels` has row_count x width x channels values of npy_type ('f' for PNG, PPM,
// EXR). Returns false with an error message if they cannot be written. The writer must then be abandoned, or
// committed, which fails silently. More rows than the image has are a bug.
bool image_writer_rows(ImageWriter *writer, const void *pixels, uint32_t row_count, MessageList *messages);
// Writes rows of an image with layers. `arrays` are the pixels and then the values of each layer, row_count x
// width x its channels.
bool image_writer_layer_rows(ImageWriter *writer, const void *const *arrays, uint32_t row_count,
                             MessageList *messages);
// Adds a note after rows were written. Only PNG keeps it, since its text chunks may follow its rows. Returns
// false with an error message on failure.
bool image_writer_note(ImageWriter *writer, const ImageNote *note, MessageList *messages);
// Completes the file up to its rename, so that several files can all be complete before the first is
// renamed. Returns false with an error message on failure. The writer must still be committed or abandoned.
bool image_writer_finish(ImageWriter *writer, MessageList *messages);
// Completes the file unless finished and renames it to its target. On failure returns false with an error
// message and leaves the target unchanged, unless syncing its folder or closing fails after the rename. Frees
// the writer in either case. Missing rows are a bug.
bool image_writer_commit(ImageWriter *writer, MessageList *messages);
// Writes a whole image, of the header's height. On failure adds a message and returns false.
bool image_write(const char *path, const ImageHeader *header, const void *pixels, MessageList *messages);
void image_writer_abandon(ImageWriter *writer); // removes the file and frees the writer; NULL is accepted

// Converts a linear value to a display value of 2^bits - 1 steps. Clips it to 0..1, applies the curve and
// rounds to nearest. NaN becomes 0. sRGB is IEC 61966-2-1:1999.
uint32_t image_quantize(float value, Transfer transfer, unsigned bits);

// An image in memory. Values are linear, except that display values of a file become value / maximum and
// `transfer` is their curve (PNG: from its sRGB chunk).
typedef struct {
    uint32_t width, height, channels;
    float *values;
    float *alpha; // PNG, EXR: of each pixel, which its values do not show; NULL: all are opaque
    Transfer transfer;
    bool display;    // 8 or 16 bit display values, scaled to 0..1, curve not undone
    bool data;       // not light, in an NPY of other than 3 channels or an EXR without colors or luminance
    bool integers;   // NPY of <u4 or |u1 and EXR of uint, such as numbers of objects
    double *doubles; // the values whose type floats cannot hold (NPY of <f8 or <u4, EXR of uint), or NULL
} Image;
enum { IMAGE_PIXELS_MAX = 1 << 27 }; // 1.6 GB of floats
typedef struct {
    const char *layer; // of an EXR file; NULL stands for the default layer or the only one with colors
    // An image whose header declares more pixels is refused before anything is decoded, because a small file
    // may expand to many. 0 stands for IMAGE_PIXELS_MAX.
    uint32_t max_pixels;
} ImageReadOptions;
// Reads PNG, JPEG, PPM, EXR or NPY, chosen by the first bytes. `options` may be NULL. On failure returns
// false with an error message and an empty image that need not be freed.
bool image_read(Image *image, const char *path, const ImageReadOptions *options, MessageList *messages);
// Reads an image from memory; `source->file` names it in messages.
bool image_read_bytes(Image *image, const Source *source, const ImageReadOptions *options,
                      MessageList *messages);
// Return whether a file, or its bytes, start like one that image_read reads.
bool image_is_known(const char *path);
bool image_bytes_are_known(const void *bytes, size_t length);
double image_value(const Image *image, size_t i); // values[i] at the precision of the file
void image_free(Image *image);
#define OwnedImage __attribute__((cleanup(image_free))) Image
