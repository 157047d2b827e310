#include "host/image/display.h"
#include "host/base/parallel.h"
#include "host/image/transfer.h"

#include <float.h>
#include <math.h>
#include <string.h>

// The number of values converted at once, and the fewest per thread.
enum { CHUNK = 768, VALUES_OF_THREAD_MIN = 1 << 16 };

// Applies a rational fit of the Academy's reference transforms per channel (Krzysztof Narkowicz, "ACES
// Filmic Tone Mapping Curve", 2016). It reaches 1 at 7.24.
static double filmic(double value)
{
    if (!(value > 0)) return 0;
    if (value >= 8) return 1;
    const double shown = value * (2.51 * value + 0.03) / (value * (2.43 * value + 0.59) + 0.14);
    return shown < 1 ? shown : 1;
}

double tone_apply(double value, Tone tone)
{
    return tone == TONE_FILMIC ? filmic(value) : value;
}

// Returns the rank of a pixel, 0 to 63, in the order of B. E. Bayer, "An optimum method for two-level
// rendition of continuous-tone pictures", ICC 1973, for 8 by 8 pixels.
static uint32_t bayer(uint32_t x, uint32_t y)
{
    uint32_t order = 0;
    for (unsigned bit = 0; bit < 3; bit++)
        order = order << 2 | ((x ^ y) >> bit & 1) << 1 | (y >> bit & 1);
    return order;
}

// Returns a dithered 8-bit display value. A value of 16 bits is 257 times one of 8 bits and a remainder,
// which the pixel's rank rounds up or down. Multiples of 257 are exact.
static uint8_t dithered(float value, Transfer transfer, uint32_t x, uint32_t y)
{
    return (uint8_t)((image_quantize(value, transfer, 16) + ((2 * bayer(x, y) + 1) * 257 >> 7)) / 257);
}

static void row_convert(uint8_t *bytes, const float *values, const ImageHeader *header, uint32_t row)
{
    const size_t count = (size_t)header->width * header->channels, value_size = header->bits / 8;
    // rounded to float, because exp2() of different hosts differs in the last bits of a double
    const double gain = (float)exp2(header->exposure);
    const bool is_toned = gain != 1 || header->tone != TONE_NONE;
    float toned[CHUNK];
    for (size_t start = 0, length; start < count; start += length) {
        length = count - start < CHUNK ? count - start : CHUNK;
        const float *chunk = values + start;
        for (size_t i = 0; i < length && is_toned; i++) {
            const double shown = tone_apply(chunk[i] * gain, header->tone);
            toned[i] = shown > FLT_MAX ? FLT_MAX : (float)shown; // keeps NaN, unlike fmin()
        }
        if (is_toned) chunk = toned;
        if (!header->dither) {
            transfer_quantize(bytes + start * value_size, chunk, length, header->transfer, header->bits);
            continue;
        }
        for (size_t i = 0; i < length; i++)
            bytes[start + i] =
                dithered(chunk[i], header->transfer,
                         header->left + (uint32_t)((start + i) / header->channels), header->top + row);
    }
}

size_t display_row_size(const ImageHeader *header)
{
    return (size_t)header->width * header->channels * (header->bits / 8);
}

typedef struct {
    uint8_t *bytes;
    const float *values;
    const ImageHeader *header;
    uint32_t first_row;
} DisplayRows;

static void rows_convert(void *context, size_t begin, size_t end)
{
    const DisplayRows *rows = context;
    const ImageHeader *header = rows->header;
    for (size_t row = begin; row < end; row++)
        row_convert(rows->bytes + row * display_row_size(header),
                    rows->values + row * header->width * header->channels, header,
                    rows->first_row + (uint32_t)row);
}

void display_rows(uint8_t *bytes, const float *values, const ImageHeader *header, uint32_t first_row,
                  uint32_t row_count)
{
    DisplayRows rows = {.values = values, .header = header, .first_row = first_row};
    rows.bytes = bytes; // in the initializer, clang-tidy would take it to be const
    const size_t row_values = (size_t)header->width * header->channels;
    parallel_run(row_count, (VALUES_OF_THREAD_MIN + row_values - 1) / row_values, rows_convert, &rows);
}
