// A PLY file's header (Turk, The PLY Polygon File Format, 1994).
#include "host/base/array.h"
#include "host/import/mesh/ply.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool format_line_read(PlyHeader *header, Line *line)
{
    static const char *const names[] = {
        [PLY_ASCII] = "ascii",
        [PLY_LITTLE_ENDIAN] = "binary_little_endian",
        [PLY_BIG_ENDIAN] = "binary_big_endian",
    };
    Word word = line_word(line);
    for (PlyFormat format = PLY_ASCII; format <= PLY_BIG_ENDIAN; format++)
        if (word_is(word, names[format])) header->format = format;
    return header->format != PLY_NO_FORMAT ||
           report_error(line->report, word.offset, "unknown PLY format '%.*s'", WORD_TEXT(word));
}

// Reads a count of at most 18 digits. No file has as many rows as a longer number.
static bool element_count_read(Word word, size_t *count)
{
    enum { DIGITS_MAX = 18 };
    *count = 0;
    for (size_t i = 0; i < word.length; i++) {
        if (word.text[i] < '0' || word.text[i] > '9' || i >= DIGITS_MAX) return false;
        *count = 10 * *count + (size_t)(word.text[i] - '0');
    }
    return word.length > 0;
}

static bool element_line_read(PlyHeader *header, Line *line)
{
    PlyElement element = {.name = line_word(line), .first_property = header->properties.count};
    Word count = line_word(line);
    if (!element_count_read(count, &element.count))
        return report_error(line->report, count.offset, "the number of '%.*s' must be whole, not '%.*s'",
                            WORD_TEXT(element.name), WORD_TEXT(count));
    array_push(header->elements, element);
    return true;
}

static const PlyType *ply_type_named(Word word)
{
    static const PlyType types[] = {
        {"char", 1, PLY_SIGNED},     {"uchar", 1, PLY_UNSIGNED},  {"short", 2, PLY_SIGNED},
        {"ushort", 2, PLY_UNSIGNED}, {"int", 4, PLY_SIGNED},      {"uint", 4, PLY_UNSIGNED},
        {"float", 4, PLY_REAL},      {"double", 8, PLY_REAL},     {"int8", 1, PLY_SIGNED},
        {"uint8", 1, PLY_UNSIGNED},  {"int16", 2, PLY_SIGNED},    {"uint16", 2, PLY_UNSIGNED},
        {"int32", 4, PLY_SIGNED},    {"uint32", 4, PLY_UNSIGNED}, {"float32", 4, PLY_REAL},
        {"float64", 8, PLY_REAL},
    };
    for (size_t i = 0; i < COUNT_OF(types); i++)
        if (word_is(word, types[i].name)) return &types[i];
    return NULL;
}

static bool type_read(Line *line, Word word, const PlyType **type)
{
    *type = ply_type_named(word);
    return *type || report_error(line->report, word.offset, "unknown PLY type '%.*s'", WORD_TEXT(word));
}

static bool property_line_read(PlyHeader *header, Line *line)
{
    if (header->elements.count == 0)
        return report_error(line->report, line_offset(line), "a property must follow an element");
    PlyProperty property = {0};
    Word word = line_word(line);
    if (word_is(word, "list")) {
        if (!type_read(line, line_word(line), &property.count_type)) return false;
        word = line_word(line);
    }
    if (!type_read(line, word, &property.type)) return false;
    property.name = line_word(line);
    if (property.name.length == 0)
        return report_error(line->report, line_offset(line), "the property has no name");
    array_push(header->properties, property);
    header->elements.items[header->elements.count - 1].property_count++;
    return true;
}

// Reads a line of the header. Ignores lines with unknown keywords and comments.
static bool header_line_read(PlyHeader *header, Line *line)
{
    Word keyword = line_word(line);
    if (word_is(keyword, "format")) return format_line_read(header, line);
    if (word_is(keyword, "element")) return element_line_read(header, line);
    if (word_is(keyword, "property")) return property_line_read(header, line);
    return true;
}

static bool is_end_of_header(Line line)
{
    return word_is(line_word(&line), "end_header") && line_word(&line).length == 0;
}

bool ply_header_read(PlyHeader *header, Line *line)
{
    const Source *source = line->report->source;
    if (source->length < 3 || strncasecmp(source->bytes, "ply", 3) != 0)
        return report_error(line->report, 0, "a PLY file must start with a line 'ply'");
    while (line_next(line)) {
        if (is_end_of_header(*line))
            return header->format != PLY_NO_FORMAT ||
                   report_error(line->report, line->start, "the header lacks a line 'format'");
        if (!header_line_read(header, line)) return false;
    }
    return report_error(line->report, source->length, "the header lacks a line 'end_header'");
}

void ply_header_free(PlyHeader *header)
{
    free(header->elements.items);
    free(header->properties.items);
}
