// A PLY file's header (Turk, The PLY Polygon File Format, 1994).
#include "host/base/array.h"
#include "host/import/mesh/ply.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { SHOWN_MAX = 40 };

bool ply_line(PlyReading *reading, PlySpan *line)
{
    PlySpan *left = &reading->left;
    if (left->at == left->end) return false;
    const char *at = left->at, *end = left->end;
    while (at < end && *at != '\n' && *at != '\r')
        at++;
    *line = (PlySpan){left->at, at};
    left->at = at;
    if (left->at < left->end && *left->at == '\r') left->at++;
    if (left->at < left->end && *left->at == '\n') left->at++;
    return true;
}

PlySpan ply_word(PlySpan *line)
{
    PlySpan word = {ply_word_start(line), line->at};
    while (word.end < line->end && !ply_is_blank(*word.end))
        word.end++;
    line->at = word.end;
    return word;
}

bool ply_span_is(PlySpan span, const char *text)
{
    size_t length = (size_t)(span.end - span.at);
    return strlen(text) == length && !memcmp(span.at, text, length);
}

int ply_shown(PlySpan span)
{
    return span.end - span.at < SHOWN_MAX ? (int)(span.end - span.at) : SHOWN_MAX;
}

bool ply_fails(PlyReading *reading, const char *at, const char *format, ...)
{
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return draft_fails(reading->draft, (size_t)(at - reading->draft->source.bytes), "%s", text);
}

static bool format_read(PlyHeader *header, PlyReading *reading, PlySpan line)
{
    static const char *const names[] = {
        [PLY_ASCII] = "ascii",
        [PLY_LITTLE_ENDIAN] = "binary_little_endian",
        [PLY_BIG_ENDIAN] = "binary_big_endian",
    };
    PlySpan word = ply_word(&line);
    for (PlyFormat format = PLY_ASCII; format <= PLY_BIG_ENDIAN; format++)
        if (ply_span_is(word, names[format])) header->format = format;
    return header->format != PLY_NO_FORMAT ||
           ply_fails(reading, word.at, "'%.*s' is no format of PLY", ply_shown(word), word.at);
}

// No file holds as many rows as a longer number says.
static bool count_read(PlySpan word, size_t *count)
{
    enum { DIGITS_MAX = 18 };
    *count = 0;
    for (const char *at = word.at; at < word.end; at++) {
        if (*at < '0' || *at > '9' || at - word.at >= DIGITS_MAX) return false;
        *count = 10 * *count + (size_t)(*at - '0');
    }
    return word.end > word.at;
}

static bool element_read(PlyHeader *header, PlyReading *reading, PlySpan line)
{
    PlyElement element = {.name = ply_word(&line), .first_property = header->properties.count};
    PlySpan count = ply_word(&line);
    if (!count_read(count, &element.count))
        return ply_fails(reading, count.at, "'%.*s' is no number of '%.*s'", ply_shown(count), count.at,
                         ply_shown(element.name), element.name.at);
    array_push(header->elements, element);
    return true;
}

static const PlyType *type_of(PlySpan word)
{
    static const PlyType types[] = {
        {"char", 1, PLY_SIGNED},     {"uchar", 1, PLY_UNSIGNED},  {"short", 2, PLY_SIGNED},
        {"ushort", 2, PLY_UNSIGNED}, {"int", 4, PLY_SIGNED},      {"uint", 4, PLY_UNSIGNED},
        {"float", 4, PLY_REAL},      {"double", 8, PLY_REAL},     {"int8", 1, PLY_SIGNED},
        {"uint8", 1, PLY_UNSIGNED},  {"int16", 2, PLY_SIGNED},    {"uint16", 2, PLY_UNSIGNED},
        {"int32", 4, PLY_SIGNED},    {"uint32", 4, PLY_UNSIGNED}, {"float32", 4, PLY_REAL},
        {"float64", 8, PLY_REAL},
    };
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (ply_span_is(word, types[i].name)) return &types[i];
    return NULL;
}

static bool type_read(PlyReading *reading, PlySpan word, const PlyType **type)
{
    *type = type_of(word);
    return *type || ply_fails(reading, word.at, "'%.*s' is no type of PLY", ply_shown(word), word.at);
}

static bool property_read(PlyHeader *header, PlyReading *reading, PlySpan line)
{
    if (header->elements.count == 0)
        return ply_fails(reading, line.at, "a property before the first element");
    PlyProperty property = {0};
    PlySpan word = ply_word(&line);
    if (ply_span_is(word, "list")) {
        if (!type_read(reading, ply_word(&line), &property.count_type)) return false;
        word = ply_word(&line);
    }
    if (!type_read(reading, word, &property.type)) return false;
    property.name = ply_word(&line);
    if (property.name.at == property.name.end)
        return ply_fails(reading, line.at, "a property without a name");
    array_push(header->properties, property);
    header->elements.items[header->elements.count - 1].property_count++;
    return true;
}

// Lines with unknown keywords are ignored, like comments.
static bool header_line_read(PlyHeader *header, PlyReading *reading, PlySpan line)
{
    PlySpan keyword = ply_word(&line);
    if (ply_span_is(keyword, "format")) return format_read(header, reading, line);
    if (ply_span_is(keyword, "element")) return element_read(header, reading, line);
    if (ply_span_is(keyword, "property")) return property_read(header, reading, line);
    return true;
}

static bool is_end_of_header(PlySpan line)
{
    if (!ply_span_is(ply_word(&line), "end_header")) return false;
    PlySpan more = ply_word(&line);
    return more.at == more.end;
}

bool ply_header_read(PlyHeader *header, PlyReading *reading)
{
    PlySpan line;
    if (!ply_line(reading, &line) || line.end - line.at < 3 || strncasecmp(line.at, "ply", 3) != 0)
        return ply_fails(reading, reading->draft->source.bytes,
                         "no PLY file, which starts with a line 'ply'");
    while (ply_line(reading, &line)) {
        if (is_end_of_header(line))
            return header->format != PLY_NO_FORMAT ||
                   ply_fails(reading, line.at, "the header lacks its format");
        if (!header_line_read(header, reading, line)) return false;
    }
    return ply_fails(reading, reading->left.at, "the header lacks its end, a line 'end_header'");
}

void ply_header_free(PlyHeader *header)
{
    free(header->elements.items);
    free(header->properties.items);
}
