// Writes version 1.0 and reads 1.0 to 3.0 of NumPy's array format (NumPy reference, numpy.lib.format).
#include "host/image/codec.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"

#include <stdlib.h>
#include <string.h>

typedef enum { NPY_FLOAT, NPY_DOUBLE, NPY_UINT32, NPY_UINT8, NPY_TYPE_COUNT } NpyType;

static const struct {
    const char *descriptor;
    size_t size;
    char name; // as in ImageHeader
} npy_types[NPY_TYPE_COUNT] = {{"<f4", 4, 'f'}, {"<f8", 8, 'd'}, {"<u4", 4, 'u'}, {"|u1", 1, '\0'}};

static NpyType npy_type_of(char name)
{
    for (int type = 0; type < NPY_TYPE_COUNT; type++) {
        if (npy_types[type].name == name && name) return (NpyType)type;
    }
    fault("NPY has no type '%c'", name);
}

static bool npy_begin(ImageWriter *writer, MessageList *messages)
{
    const ImageHeader *header = &writer->header;
    OwnedText text = {0};
    text_append(&text, "\x93NUMPY\x01\x00\x00\x00", 10);
    text_appendf(&text, "{'descr': '%s', 'fortran_order': False, 'shape': (%u, %u",
                 npy_types[npy_type_of(header->npy_type)].descriptor, header->height, header->width);
    if (header->channels > 1) text_appendf(&text, ", %u", header->channels);
    text_appendf(&text, "), }");
    while ((text.count + 1) % 64)
        text_append(&text, " ", 1);
    text_append(&text, "\n", 1);
    size_t length = text.count - 10;
    text.items[8] = (char)(length & 0xFF);
    text.items[9] = (char)(length >> 8);
    return output_write(&writer->output, text.items, text.count, messages);
}

static bool npy_rows(ImageWriter *writer, const void *const *arrays, uint32_t row_count,
                     MessageList *messages)
{
    const void *pixels = arrays[0];
    const ImageHeader *header = &writer->header;
    size_t row_size =
        (size_t)header->width * header->channels * npy_types[npy_type_of(header->npy_type)].size;
    return output_write(&writer->output, pixels, row_size * row_count, messages);
}

const Encoder npy_encoder = {npy_begin, npy_rows, NULL, NULL, NULL};

// Returns the value of `'key':` in the header's dictionary, or NULL.
static const char *npy_entry(const char *dictionary, const char *key)
{
    const char *at = strstr(dictionary, key);
    if (!at) return NULL;
    at += strlen(key);
    at += strspn(at, " ");
    return *at == ':' ? at + 1 + strspn(at + 1, " ") : NULL;
}

static bool npy_type_read(const char *dictionary, NpyType *found)
{
    const char *at = npy_entry(dictionary, "'descr'");
    for (int type = 0; at && type < NPY_TYPE_COUNT; type++) {
        if (*at == '\'' && strncmp(at + 1, npy_types[type].descriptor, 3) == 0 && at[4] == '\'') {
            *found = (NpyType)type;
            return true;
        }
    }
    return false;
}

static bool npy_shape_read(const char *dictionary, uint64_t shape[3])
{
    const char *at = npy_entry(dictionary, "'shape'");
    if (!at || *at != '(') return false;
    at++;
    size_t count = 0;
    for (at += strspn(at, " "); *at != ')'; at += strspn(at, " ,")) {
        char *end;
        if (count == 3 || *at < '0' || *at > '9') return false;
        shape[count++] = strtoull(at, &end, 10);
        at = end;
    }
    if (count == 2) shape[2] = 1;
    return count >= 2;
}

static double npy_value(const uint8_t *bytes, NpyType type)
{
    float float32;
    double float64;
    uint32_t integer;
    switch (type) {
    case NPY_FLOAT:
        memcpy(&float32, bytes, sizeof float32);
        return (double)float32;
    case NPY_DOUBLE:
        memcpy(&float64, bytes, sizeof float64);
        return float64;
    case NPY_UINT32:
        memcpy(&integer, bytes, sizeof integer);
        return (double)integer;
    default:
        return (double)*bytes;
    }
}

static bool npy_dictionary_decode(Image *image, const ImageFile *file, const char *dictionary, size_t data)
{
    NpyType type;
    uint64_t shape[3];
    const char *order = npy_entry(dictionary, "'fortran_order'");
    if (!npy_type_read(dictionary, &type))
        return image_refuse(file, "NPY: the type must be <f4, <f8, <u4 or |u1");
    if (!order || strncmp(order, "False", 5) != 0)
        return image_refuse(file, "NPY: the array must be in C order");
    if (!npy_shape_read(dictionary, shape))
        return image_refuse(file, "NPY: the array must have 2 or 3 dimensions");
    size_t size = npy_types[type].size;
    if (!image_allocate(image, file, shape[1], shape[0], shape[2], type == NPY_UINT8 ? 4 : 1)) return false;
    size_t count = (size_t)image->width * image->height * image->channels;
    if (count > (file->length - data) / size) return image_refuse(file, "NPY: the file ends too early");
    if (type == NPY_DOUBLE || type == NPY_UINT32)
        image->doubles = memory_allocate(count, sizeof *image->doubles);
    for (size_t i = 0; i < count; i++) {
        double value = npy_value(file->bytes + data + i * size, type);
        if (image->doubles) image->doubles[i] = value;
        image->values[i] = (float)value;
    }
    image->integers = type == NPY_UINT32 || type == NPY_UINT8;
    image->data = image->integers || image->channels != 3;
    return true;
}

bool npy_decode(Image *image, const ImageFile *file)
{
    const uint8_t *bytes = file->bytes;
    size_t start = file->length > 6 && bytes[6] >= 2 ? 12 : 10;
    if (file->length < start || bytes[6] < 1 || bytes[6] > 3)
        return image_refuse(file, "NPY: the header is damaged");
    size_t length = (size_t)bytes[8] | (size_t)bytes[9] << 8;
    if (start == 12) length |= (size_t)bytes[10] << 16 | (size_t)bytes[11] << 24;
    if (length > file->length - start) return image_refuse(file, "NPY: the header is damaged");
    OWNED char *dictionary = memory_copy_part((const char *)bytes + start, length);
    return npy_dictionary_decode(image, file, dictionary, start + length);
}
