// Writes P5 and P6 and reads P2, P3, P5 and P6 portable anymaps (Netpbm, the formats ppm and pgm).
#include "host/image/codec.h"
#include "host/image/display.h"

#include "host/base/memory.h"

#include <ctype.h>
#include <stdlib.h>

static bool ppm_begin(ImageWriter *writer, MessageList *messages)
{
    const ImageHeader *header = &writer->header;
    char start[64];
    int length = snprintf(start, sizeof start, "P%c\n%u %u\n%u\n", header->channels == 1 ? '5' : '6',
                          header->width, header->height, (1U << header->bits) - 1);
    return output_write(&writer->output, start, (size_t)length, messages);
}

static bool ppm_rows(ImageWriter *writer, const void *const *arrays, uint32_t row_count,
                     MessageList *messages)
{
    const size_t size = row_count * display_row_size(&writer->header);
    OWNED uint8_t *bytes = memory_allocate(size, 1);
    display_rows(bytes, arrays[0], &writer->header, writer->rows_written, row_count);
    return output_write(&writer->output, bytes, size, messages);
}

const Encoder ppm_encoder = {ppm_begin, ppm_rows, NULL, NULL, NULL};

// Reads the number at `*at` after white space and comments. Returns false unless it is below 2^31.
static bool ppm_number_read(const ImageFile *file, size_t *at, uint32_t *number)
{
    while (*at < file->length && (isspace(file->bytes[*at]) || file->bytes[*at] == '#')) {
        if (file->bytes[*at] == '#') {
            while (*at < file->length && file->bytes[*at] != '\n')
                ++*at;
        } else {
            ++*at;
        }
    }
    size_t start = *at;
    uint64_t value = 0;
    while (*at < file->length && isdigit(file->bytes[*at]) && value <= INT32_MAX)
        value = 10 * value + (uint64_t)(file->bytes[(*at)++] - '0');
    *number = (uint32_t)value;
    return *at > start && value <= INT32_MAX;
}

bool ppm_decode(Image *image, const ImageFile *file)
{
    char type = (char)file->bytes[1];
    bool is_text = type == '2' || type == '3';
    size_t at = 2;
    uint32_t width, height, maximum;
    if (!ppm_number_read(file, &at, &width) || !ppm_number_read(file, &at, &height) ||
        !ppm_number_read(file, &at, &maximum))
        return image_refuse(file, "PPM: the header is damaged");
    if (maximum == 0 || maximum > 65535)
        return image_refuse(file, "PPM: the maximum must be 1 to 65535, not %u", maximum);
    // A value is a digit and a space, or its bytes.
    size_t value_size = is_text ? 2 : maximum > 255 ? 2 : 1;
    if (!image_allocate(image, file, width, height, type == '3' || type == '6' ? 3 : 1,
                        sizeof *image->values / value_size))
        return false;
    image->display = true;
    at++; // the single white space after the maximum
    size_t count = (size_t)image->width * image->height * image->channels;
    if (!is_text && (at > file->length || count > (file->length - at) / value_size))
        return image_refuse(file, "PPM: the file ends too early");
    for (size_t i = 0; i < count; i++) {
        uint32_t value;
        if (is_text) {
            if (!ppm_number_read(file, &at, &value))
                return image_refuse(file, "PPM: value %zu of %zu is missing or not a number", i + 1, count);
        } else {
            value = file->bytes[at++];
            if (value_size == 2) value = value << 8 | file->bytes[at++];
        }
        if (value > maximum)
            return image_refuse(file, "PPM: value %zu, %u, is above the maximum, %u", i + 1, value, maximum);
        image->values[i] = (float)value / (float)maximum;
    }
    return true;
}
