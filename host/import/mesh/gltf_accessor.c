// Reads glTF's buffers, buffer views and accessors. Whatever the file claims, nothing outside a buffer is
// read, and memory grows only with the size of the buffers.
#include "host/base/base64.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/import/mesh/gltf.h"

#include <stdlib.h>
#include <string.h>

// Bounds the lengths and offsets of a file. The sum of three fits a size_t.
static const size_t size_max = SIZE_MAX >> 2;

// Bounds the numbers of accessors beyond the bytes of the buffers. Accessors may overlap, have no buffer, or
// belong to a mesh that many nodes use.
enum { ELEMENTS_MAX = 1 << 26 };

static int hex_digit(char character)
{
    if (character >= '0' && character <= '9') return character - '0';
    const int letter = character | 0x20;
    return letter >= 'a' && letter <= 'f' ? letter - 'a' + 10 : -1;
}

// Decodes %xx (RFC 3986, Uniform Resource Identifier, 2005, section 2.1) and keeps other text.
static void percent_decode(Text *bytes, const char *text)
{
    for (const char *at = text; *at; at++) {
        char byte = *at;
        if (byte == '%' && hex_digit(at[1]) >= 0 && hex_digit(at[2]) >= 0) {
            byte = (char)(hex_digit(at[1]) << 4 | hex_digit(at[2]));
            at += 2;
        }
        text_append(bytes, &byte, 1);
    }
}

bool gltf_data_decode(Text *bytes, const char *uri)
{
    static const char scheme[] = "data:", encoding[] = ";base64";
    const size_t encoding_length = sizeof encoding - 1;
    const char *comma = strncmp(uri, scheme, sizeof scheme - 1) == 0 ? strchr(uri, ',') : NULL;
    if (!comma) return false;
    if ((size_t)(comma - uri) >= sizeof scheme - 1 + encoding_length &&
        strncmp(comma - encoding_length, encoding, encoding_length) == 0)
        return base64_decode(bytes, comma + 1, strlen(comma + 1));
    percent_decode(bytes, comma + 1);
    return true;
}

char *gltf_path(Gltf *gltf, const GltfItem *uri)
{
    static const char file_scheme[] = "file://";
    const char *text = json_string_value(uri->json);
    const bool is_file = strncmp(text, file_scheme, sizeof file_scheme - 1) == 0;
    if (is_file) text += sizeof file_scheme - 1;
    const size_t scheme = strspn(text, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789+-.");
    // a scheme of one letter is a drive
    if (text[0] == '\0' || (scheme != 1 && text[scheme] == ':')) return NULL;
    OwnedText name = {0};
    percent_decode(&name, text);
    bool is_moved = false;
    // a NUL would end the name early
    char *path = strlen(name.items) == name.count
                     ? draft_find_file(gltf->draft->import->path, name.items, name.count, &is_moved)
                     : NULL;
    if (is_moved)
        gltf_warn(gltf, uri, "names '%.100s', which does not exist; '%.100s' is used", name.items, path);
    return path;
}

// Reads the buffer's file, or shares the bytes of another buffer with the same file.
static bool buffer_read_file(Gltf *gltf, GltfBuffer *buffer, const GltfItem *uri)
{
    OWNED char *path = gltf_path(gltf, uri);
    if (!path) return gltf_fails(gltf, uri, "must be a relative path or base64 data");
    scene_file_named(gltf->draft->import->options, path);
    const char *obstacle = file_obstacle(path);
    if (obstacle) return gltf_fails(gltf, uri, "names '%.100s', which cannot be read: %s", path, obstacle);
    const FileId file = file_id(path);
    for (size_t i = 0; i < gltf->buffer_count; i++)
        if (gltf->buffers[i].bytes && file_is_same(gltf->buffers[i].file, file))
            *buffer = (GltfBuffer){.bytes = gltf->buffers[i].bytes, .length = gltf->buffers[i].length};
    buffer->file = file;
    OwnedMessageList problems = {0};
    return buffer->bytes || text_read_file(&buffer->owned, path, &problems) ||
           gltf_fails(gltf, uri, "names an unreadable file; %s", problems.items[0].text);
}

static bool gltf_buffer_read(Gltf *gltf, const GltfItem *item, GltfBuffer *buffer, bool is_first)
{
    const GltfItem uri = gltf_string(gltf, item, "uri");
    const char *text = json_string_value(uri.json);
    size_t length = 0;
    if (!gltf_integer(gltf, item, "byteLength", 1, size_max, &length)) return false;
    if (!uri.json && is_first && gltf->binary.bytes)
        *buffer = gltf->binary;
    else if (!text)
        return gltf_fails(gltf, &uri, "is missing, so the file lacks the buffer's bytes");
    else if (strncmp(text, "data:", 5) == 0 && !gltf_data_decode(&buffer->owned, text))
        return gltf_fails(gltf, &uri, "is not base64");
    else if (strncmp(text, "data:", 5) != 0 && !buffer_read_file(gltf, buffer, &uri))
        return false;
    if (!buffer->bytes) buffer->length = buffer->owned.count;
    if (length > buffer->length)
        return gltf_fails(gltf, item, "has only %zu bytes, but its byteLength is %zu", buffer->length,
                          length);
    if (!buffer->bytes || buffer->bytes == gltf->binary.bytes) gltf->byte_count += buffer->length;
    if (!buffer->bytes) buffer->bytes = text_c(&buffer->owned);
    return true;
}

// Returns the buffer, or NULL with an error. Reads it on its first use.
static const GltfBuffer *buffer_open(Gltf *gltf, size_t index)
{
    GltfBuffer *buffer = &gltf->buffers[index], read = {0};
    const GltfItem item = gltf_entry(gltf, "buffers", index);
    if (buffer->bytes) return buffer;
    if (gltf_buffer_read(gltf, &item, &read, index == 0)) {
        *buffer = read;
        return buffer;
    }
    text_free(&read.owned);
    return NULL;
}

bool gltf_view_read(Gltf *gltf, const GltfItem *item, const char *key, Source *bytes, size_t *stride)
{
    enum { STRIDE_MIN = 4, STRIDE_MAX = 252 };
    size_t index = SIZE_MAX, buffer_index = SIZE_MAX, offset = 0, length = 0;
    if (!gltf_index(gltf, item, key, "bufferViews", &index)) return false;
    const GltfItem view = gltf_entry(gltf, "bufferViews", index);
    if (!gltf_index(gltf, &view, "buffer", "buffers", &buffer_index) ||
        !gltf_integer(gltf, &view, "byteOffset", 0, size_max, &offset) ||
        !gltf_integer(gltf, &view, "byteLength", 1, size_max, &length) ||
        !gltf_integer(gltf, &view, "byteStride", STRIDE_MIN, STRIDE_MAX, stride))
        return false;
    if (buffer_index == SIZE_MAX || length == 0)
        return gltf_fails(gltf, &view, "lacks 'buffer' or 'byteLength'");
    const GltfBuffer *buffer = buffer_open(gltf, buffer_index);
    if (!buffer) return false;
    if (offset + length > buffer->length)
        return gltf_fails(gltf, &view, "ends at byte %zu of a buffer of %zu bytes", offset + length,
                          buffer->length);
    *bytes = (Source){.bytes = buffer->bytes + offset, .length = length};
    return true;
}

typedef enum {
    GLTF_INT8 = 5120,
    GLTF_UINT8,
    GLTF_INT16,
    GLTF_UINT16,
    GLTF_UINT32 = 5125,
    GLTF_FLOAT
} ComponentType;

static size_t component_size(size_t type)
{
    static const size_t sizes[] = {1, 1, 2, 2, 0, 4, 4};
    return type >= GLTF_INT8 && type <= GLTF_FLOAT ? sizes[type - GLTF_INT8] : 0;
}

// Reads a component. A normalized integer becomes a value from -1 or 0 to 1.
static double component_read(const char *bytes, size_t type, bool is_normalized)
{
    union {
        int8_t int8;
        uint8_t uint8;
        int16_t int16;
        uint16_t uint16;
        uint32_t uint32;
        float real;
    } value;
    memcpy(&value, bytes, component_size(type));
    switch (type) {
    case GLTF_INT8:
        return is_normalized ? fmax(value.int8 / 127.0, -1) : value.int8;
    case GLTF_UINT8:
        return is_normalized ? value.uint8 / 255.0 : value.uint8;
    case GLTF_INT16:
        return is_normalized ? fmax(value.int16 / 32767.0, -1) : value.int16;
    case GLTF_UINT16:
        return is_normalized ? value.uint16 / 65535.0 : value.uint16;
    case GLTF_UINT32:
        return value.uint32;
    default:
        return (double)value.real;
    }
}

// `count` elements of `width` components, a stride apart from the offset on in a buffer view.
typedef struct {
    size_t type, width, count, stride, offset;
    bool is_normalized;
    const char *bytes; // of the first element, NULL before elements_find
} Elements;

// Finds the elements in a buffer view. Returns false with an error if the view is too short.
static bool elements_find(Gltf *gltf, const GltfItem *item, Elements *elements)
{
    Source view = {.bytes = ""};
    const size_t size = elements->width * component_size(elements->type);
    elements->stride = size;
    if (!gltf_view_read(gltf, item, "bufferView", &view, &elements->stride)) return false;
    const uint64_t end = elements->offset + (uint64_t)(elements->count - 1) * elements->stride + size;
    if (end > view.length)
        return gltf_fails(gltf, item, "ends at byte %ju of a buffer view of %zu bytes", (uintmax_t)end,
                          view.length);
    elements->bytes = view.bytes + elements->offset;
    return true;
}

static void accessor_element_read(const Elements *elements, size_t row, double *values)
{
    const char *bytes = elements->bytes + row * elements->stride;
    const size_t size = component_size(elements->type);
    for (size_t i = 0; i < elements->width; i++)
        values[i] = component_read(bytes + i * size, elements->type, elements->is_normalized);
}

// Replaces the elements that a sparse accessor names.
static bool sparse_read(Gltf *gltf, const GltfItem *accessor, const Elements *elements, GltfNumbers *numbers)
{
    const GltfItem sparse = gltf_object(gltf, accessor, "sparse");
    if (!sparse.json) return true;
    const GltfItem indices = gltf_object(gltf, &sparse, "indices"),
                   values = gltf_object(gltf, &sparse, "values");
    Elements of_indices = {.width = 1}, of_values = *elements;
    of_values.offset = 0;
    if (!gltf_integer(gltf, &sparse, "count", 1, elements->count, &of_indices.count) ||
        !gltf_integer(gltf, &indices, "componentType", GLTF_UINT8, GLTF_UINT32, &of_indices.type) ||
        !gltf_integer(gltf, &indices, "byteOffset", 0, size_max, &of_indices.offset) ||
        !gltf_integer(gltf, &values, "byteOffset", 0, size_max, &of_values.offset))
        return false;
    of_values.count = of_indices.count;
    if (of_indices.count == 0 || component_size(of_indices.type) == 0 ||
        !gltf_member(&indices, "bufferView").json || !gltf_member(&values, "bufferView").json)
        return !indices.is_wrong && !values.is_wrong &&
               gltf_fails(gltf, &sparse, "lacks 'count', 'indices' or 'values'");
    if (!elements_find(gltf, &indices, &of_indices) || !elements_find(gltf, &values, &of_values))
        return false;
    for (size_t i = 0; i < of_indices.count; i++) {
        double row = 0;
        accessor_element_read(&of_indices, i, &row);
        if (!(row >= 0 && row < (double)elements->count))
            return gltf_fails(gltf, &indices,
                              "names element %.0f (counted from 0) in row %zu, but the accessor has only %zu",
                              row, i, elements->count);
        accessor_element_read(&of_values, i, numbers->items + (size_t)row * numbers->width);
    }
    return true;
}

// Returns whether indices, of width 1, or an attribute may have the type.
static bool component_fits(size_t type, size_t width)
{
    const bool fits_both = type == GLTF_UINT8 || type == GLTF_UINT16;
    return fits_both ||
           (width == 1 ? type == GLTF_UINT32 : type == GLTF_INT8 || type == GLTF_INT16 || type == GLTF_FLOAT);
}

static bool elements_read(Gltf *gltf, const GltfItem *accessor, const char *key, size_t width,
                          Elements *elements)
{
    static const char *const types[] = {NULL, "SCALAR", "VEC2", "VEC3"};
    const GltfItem type = gltf_member(accessor, "type"), normalized = gltf_member(accessor, "normalized"),
                   component = gltf_member(accessor, "componentType");
    const char *name = json_string_value(type.json);
    *elements = (Elements){.width = width, .is_normalized = json_is_true(normalized.json)};
    if (normalized.json && !json_is_boolean(normalized.json))
        return gltf_fails(gltf, &normalized, "must be true or false");
    if (!name || strcmp(name, types[width]) != 0)
        return gltf_fails(gltf, &type, "must be '%s' for %s, not '%.20s'", types[width], key,
                          name ? name : "");
    if (!gltf_integer(gltf, accessor, "componentType", GLTF_INT8, GLTF_FLOAT, &elements->type) ||
        !gltf_integer(gltf, accessor, "byteOffset", 0, size_max, &elements->offset) ||
        !gltf_integer(gltf, accessor, "count", 1, DRAFT_NONE - 1, &elements->count))
        return false;
    if (elements->count == 0 || !component.json)
        return gltf_fails(gltf, accessor, "lacks 'count' or 'componentType'");
    return component_fits(elements->type, width) ||
           gltf_fails(gltf, &component, "must be %s for %s, not %zu",
                      width == 1 ? "5121, 5123 or 5125" : "5120 to 5123 or 5126", key, elements->type);
}

bool gltf_accessor_read(Gltf *gltf, const GltfItem *item, const char *key, size_t width, GltfNumbers *numbers)
{
    size_t index = SIZE_MAX;
    Elements elements;
    *numbers = (GltfNumbers){.width = width};
    if (!gltf_index(gltf, item, key, "accessors", &index)) return false;
    if (index == SIZE_MAX) return true;
    const GltfItem accessor = gltf_entry(gltf, "accessors", index);
    if (!elements_read(gltf, &accessor, key, width, &elements)) return false;
    if (gltf_member(&accessor, "bufferView").json && !elements_find(gltf, &accessor, &elements)) return false;
    gltf->element_count += elements.count;
    if (gltf->element_count > gltf->byte_count + ELEMENTS_MAX)
        return gltf_fails(gltf, &accessor,
                          "brings the accessors to %zu elements in total; at most %zu are supported",
                          gltf->element_count, gltf->byte_count + ELEMENTS_MAX);
    numbers->count = elements.count;
    numbers->items = memory_allocate_zeroed(elements.count, width * sizeof *numbers->items);
    for (size_t i = 0; i < elements.count && elements.bytes; i++)
        accessor_element_read(&elements, i, numbers->items + i * width);
    return sparse_read(gltf, &accessor, &elements, numbers);
}
