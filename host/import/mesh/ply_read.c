// PLY files for assimp, whose reader allocates whatever length a list claims, repeats the last line of a file
// that is too short, misreads a last line without a newline, and misparses unknown elements, repeated blanks
// and empty lines. It gets the file rewritten without any of these, once the file is known to be complete.
#include "host/base/array.h"
#include "host/import/mesh/mesh_import.h"
#include "host/import/mesh/ply.h"
#include "host/import/number.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef struct {
    PlyHeader header;
    PlyReading reading;
    Text *clean;
    size_t header_size;        // of `clean`
    const PlyElement *element; // of the current row, and the row's index
    bool wanted;               // assimp uses the element
    PlySpan kept;              // consecutive lines not written yet
    size_t row;
    const PlyProperty *corners, *coordinates; // the element's lists; NULL: none
    double corner_count, coordinate_count;    // of the current row
} Body;

static const PlyProperty *properties_of(const Body *body, const PlyElement *element)
{
    return body->header.properties.items + element->first_property;
}

static bool is_one_of(PlySpan name, const char *const *names, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (ply_span_is(name, names[i])) return true;
    return false;
}

#define IS_ONE_OF(name, ...)                                                                                 \
    is_one_of(name, (const char *const[]){__VA_ARGS__},                                                      \
              sizeof((const char *const[]){__VA_ARGS__}) / sizeof(const char *))

static bool is_wanted(const PlyElement *element)
{
    return element->property_count > 0 && IS_ONE_OF(element->name, "vertex", "face", "material");
}

// assimp reads the first item of an optional list even if the list is empty.
static bool name_is_wanted(const PlyElement *element, const PlyProperty *property)
{
    if (property->count_type)
        return ply_span_is(element->name, "face") &&
               IS_ONE_OF(property->name, "vertex_index", "vertex_indices", "texcoord");
    for (const char *at = property->name.at; at < property->name.end; at++)
        if (*at <= ' ' || *at > '~') return false;
    return true;
}

static void element_write(Body *body, const PlyElement *element)
{
    text_appendf(body->clean, "element %.*s %zu\n", (int)(element->name.end - element->name.at),
                 element->name.at, element->count);
    for (size_t i = 0; i < element->property_count; i++) {
        const PlyProperty *property = &properties_of(body, element)[i];
        text_appendf(body->clean, "property ");
        if (property->count_type) text_appendf(body->clean, "list %s ", property->count_type->name);
        text_appendf(body->clean, "%s ", property->type->name);
        if (name_is_wanted(element, property))
            text_append(body->clean, property->name.at, (size_t)(property->name.end - property->name.at));
        else
            text_appendf(body->clean, "unknown");
        text_appendf(body->clean, "\n");
    }
}

static void header_write(Body *body)
{
    static const char *const formats[] = {
        [PLY_ASCII] = "ascii",
        [PLY_LITTLE_ENDIAN] = "binary_little_endian",
        [PLY_BIG_ENDIAN] = "binary_big_endian",
    };
    text_appendf(body->clean, "ply\nformat %s 1.0\n", formats[body->header.format]);
    for (size_t i = 0; i < body->header.elements.count; i++)
        if (is_wanted(&body->header.elements.items[i])) element_write(body, &body->header.elements.items[i]);
    text_appendf(body->clean, "end_header\n");
    body->header_size = body->clean->count;
}

// assimp takes a newline right after the header for part of it unless a carriage return precedes.
static void rows_write(Body *body, PlySpan rows)
{
    if (body->clean->count == body->header_size && rows.at < rows.end && *rows.at == '\n') {
        body->clean->count--;
        text_append(body->clean, "\r\n", 2);
    }
    text_append(body->clean, rows.at, (size_t)(rows.end - rows.at));
}

static bool names_agree(PlySpan a, PlySpan b)
{
    size_t length = (size_t)(a.end - a.at);
    return length == (size_t)(b.end - b.at) && !memcmp(a.at, b.at, length);
}

// If an element is declared twice, assimp writes the second's rows beyond the first's; of a triangle strip it
// keeps one triangle.
static bool elements_are_sound(Body *body)
{
    const PlyElement *elements = body->header.elements.items;
    for (size_t i = 0; i < body->header.elements.count; i++) {
        PlySpan name = elements[i].name;
        if (ply_span_is(name, "tristrips") && elements[i].count > 0)
            return ply_fails(&body->reading, "strips of triangles (tristrips) are not read, only faces");
        for (size_t k = 0; k < i && is_wanted(&elements[i]); k++)
            if (names_agree(name, elements[k].name))
                return ply_fails(&body->reading, "the header declares '%.*s' twice", ply_shown(name),
                                 name.at);
    }
    return true;
}

static bool is_digit(char character)
{
    return character >= '0' && character <= '9';
}

// More digits before the point or in an exponent overflow in assimp.
static const char *digits_skip(const char *at, const char *end)
{
    enum { DIGITS_MOST = 19 };
    const char *first = at;
    while (at < end && is_digit(*at) && at - first < DIGITS_MOST)
        at++;
    return at;
}

static const char *sign_skip(const char *at, const char *end)
{
    return at < end && (*at == '-' || *at == '+') ? at + 1 : at;
}

// The end of the number that starts at `at`; NULL if assimp would not read it as that number.
static const char *whole_skip(const char *at, const char *end, PlyNumberKind kind)
{
    const char *first = kind == PLY_SIGNED ? sign_skip(at, end) : at;
    uint64_t value = 0;
    for (at = first; at < end && is_digit(*at) && value <= UINT32_MAX; at++)
        value = 10 * value + (uint64_t)(*at - '0');
    return at > first && value <= UINT32_MAX ? at : NULL;
}

static const char *not_finite_skip(const char *at, const char *end)
{
    static const char *const names[] = {"infinity", "inf", "nan"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        size_t length = strlen(names[i]);
        if ((size_t)(end - at) >= length && !strncasecmp(at, names[i], length)) return at + length;
    }
    return NULL;
}

static const char *real_skip(const char *at, const char *end)
{
    at = sign_skip(at, end);
    const char *first = at;
    at = digits_skip(at, end);
    bool has_digits = at > first;
    if (at < end && *at == '.')
        for (at++; at < end && is_digit(*at); at++)
            has_digits = true;
    if (!has_digits) return not_finite_skip(first, end);
    if (at == end || (*at != 'e' && *at != 'E')) return at;
    first = sign_skip(at + 1, end);
    at = digits_skip(first, end);
    return at > first ? at : NULL;
}

static bool row_fails(Body *body, const PlyProperty *property, const char *what)
{
    PlySpan element = body->element->name;
    return ply_fails(&body->reading, "%.*s %zu (from 0) %s '%.*s'", ply_shown(element), element.at, body->row,
                     what, ply_shown(property->name), property->name.at);
}

// Reads the line's next word, if any.
static bool word_read(Body *body, const PlyType *type, PlySpan *line, PlySpan *word)
{
    const char *start = ply_word_start(line), *end = line->end;
    *word = (PlySpan){start, start};
    if (start == end) return true;
    const char *at = type->kind == PLY_REAL ? real_skip(start, end) : whole_skip(start, end, type->kind);
    if (at && (at == end || ply_is_blank(*at))) {
        line->at = word->end = at;
        return true;
    }
    *word = ply_word(line);
    return ply_fails(&body->reading, "'%.*s' is no number of type %s", ply_shown(*word), word->at,
                     type->name);
}

static bool line_number_read(Body *body, const PlyProperty *property, const PlyType *type, PlySpan *line,
                             PlySpan *word)
{
    if (!word_read(body, type, line, word)) return false;
    return word->at < word->end || row_fails(body, property, "lacks its");
}

static bool list_fails(Body *body, const PlyProperty *property, double promised, size_t held,
                       const char *holder)
{
    PlySpan element = body->element->name;
    return ply_fails(&body->reading, "%.*s %zu (from 0) declares %.15g numbers of '%.*s', %s has %zu more",
                     ply_shown(element), element.at, body->row, promised, ply_shown(property->name),
                     property->name.at, holder, held);
}

static bool is_count(double number)
{
    return number >= 0 && floor(number) == number;
}

static void list_note(Body *body, const PlyProperty *property, double count)
{
    if (property == body->corners) body->corner_count = count;
    if (property == body->coordinates) body->coordinate_count = count;
}

// assimp also reads texture coordinates for corners that do not exist.
static bool row_is_sound(Body *body)
{
    if (body->coordinate_count <= 2 * body->corner_count) return true;
    return ply_fails(&body->reading, "face %zu (from 0) has %.15g corners, but %.15g texture coordinates",
                     body->row, body->corner_count, body->coordinate_count / 2);
}

static bool line_count_read(Body *body, const PlyProperty *property, PlySpan *line, double *count)
{
    PlySpan word;
    if (!line_number_read(body, property, property->count_type, line, &word)) return false;
    size_t length = (size_t)(word.end - word.at);
    if (length == 1 && is_digit(*word.at)) {
        *count = *word.at - '0';
        return true;
    }
    return (number_read(word.at, length, count) == NUMBER_READ && is_count(*count)) ||
           ply_fails(&body->reading, "'%.*s' is no length of a list", ply_shown(word), word.at);
}

static bool line_list_read(Body *body, const PlyProperty *property, PlySpan *line)
{
    double count;
    if (!line_count_read(body, property, line, &count)) return false;
    list_note(body, property, count);
    for (size_t i = 0; (double)i < count; i++) {
        PlySpan word;
        if (!word_read(body, property->type, line, &word)) return false;
        if (word.at == word.end) return list_fails(body, property, count, i, "the line");
    }
    return true;
}

// The next nonempty line.
static bool line_row_start(Body *body, PlySpan *line)
{
    PlySpan name = body->element->name;
    do {
        if (!ply_line(&body->reading, line))
            return ply_fails(&body->reading, "the file ends before %.*s %zu (from 0) of %zu", ply_shown(name),
                             name.at, body->row, body->element->count);
    } while (ply_word_start(line) == line->end);
    return true;
}

static void kept_write(Body *body)
{
    if (!body->kept.at) return;
    text_append(body->clean, body->kept.at, (size_t)(body->kept.end - body->kept.at));
    text_append(body->clean, "\n", 1);
    body->kept = (PlySpan){0};
}

// Well-formed input is copied in one piece.
static void line_keep(Body *body, PlySpan line)
{
    PlySpan *kept = &body->kept;
    if (kept->at && line.at == kept->end + 1 && *kept->end == '\n') {
        kept->end = line.end;
        return;
    }
    kept_write(body);
    *kept = line;
}

// A row is a line; what follows the last property is ignored.
static bool line_row_read(Body *body)
{
    PlySpan line, word;
    if (!line_row_start(body, &line)) return false;
    const char *start = line.at;
    for (size_t i = 0; i < body->element->property_count; i++) {
        const PlyProperty *property = &properties_of(body, body->element)[i];
        if (property->count_type ? !line_list_read(body, property, &line)
                                 : !line_number_read(body, property, property->type, &line, &word))
            return false;
    }
    if (body->wanted) line_keep(body, (PlySpan){start, line.at});
    return true;
}

static size_t bytes_left(const Body *body)
{
    return (size_t)(body->reading.left.end - body->reading.left.at);
}

static double binary_number(const Body *body, const PlyType *type)
{
    const unsigned char *bytes = (const unsigned char *)body->reading.left.at;
    uint64_t bits = 0;
    for (size_t i = 0; i < type->size; i++)
        bits = bits << 8 | bytes[body->header.format == PLY_BIG_ENDIAN ? i : type->size - 1 - i];
    if (type->kind == PLY_UNSIGNED) return (double)bits;
    if (type->kind == PLY_SIGNED) {
        const uint64_t sign = type->size == 1 ? 0x80 : type->size == 2 ? 0x8000 : 0x80000000;
        return (double)(bits & (sign - 1)) - (double)(bits & sign);
    }
    double number;
    float narrow;
    uint32_t narrow_bits = (uint32_t)bits;
    memcpy(&number, &bits, sizeof number);
    memcpy(&narrow, &narrow_bits, sizeof narrow);
    return type->size == sizeof narrow ? narrow : number;
}

static bool bytes_skip(Body *body, const PlyProperty *property, size_t size)
{
    if (size > bytes_left(body)) return row_fails(body, property, "lacks its");
    body->reading.left.at += size;
    return true;
}

static bool binary_list_read(Body *body, const PlyProperty *property)
{
    const char *start = body->reading.left.at;
    if (!bytes_skip(body, property, property->count_type->size)) return false;
    body->reading.left.at = start;
    double count = binary_number(body, property->count_type);
    body->reading.left.at += property->count_type->size;
    size_t most = bytes_left(body) / property->type->size;
    if (!is_count(count) || count > (double)most) {
        body->reading.left.at = start;
        return list_fails(body, property, count, most, "the file");
    }
    list_note(body, property, count);
    return bytes_skip(body, property, (size_t)count * property->type->size);
}

static bool binary_row_read(Body *body)
{
    for (size_t i = 0; i < body->element->property_count; i++) {
        const PlyProperty *property = &properties_of(body, body->element)[i];
        if (property->count_type ? !binary_list_read(body, property)
                                 : !bytes_skip(body, property, property->type->size))
            return false;
    }
    return true;
}

static void element_start(Body *body, const PlyElement *element)
{
    body->element = element;
    body->wanted = is_wanted(element);
    body->corners = body->coordinates = NULL;
    for (size_t i = 0; i < element->property_count && body->wanted; i++) {
        const PlyProperty *property = &properties_of(body, element)[i];
        if (!property->count_type || !name_is_wanted(element, property)) continue;
        *(ply_span_is(property->name, "texcoord") ? &body->coordinates : &body->corners) = property;
    }
}

static bool element_read(Body *body, const PlyElement *element)
{
    bool (*row_read)(Body *) = body->reading.by_bytes ? binary_row_read : line_row_read;
    element_start(body, element);
    const char *start = body->reading.left.at;
    // without properties there are no rows, whatever their number
    size_t count = element->property_count > 0 ? element->count : 0;
    for (body->row = 0; body->row < count; body->row++) {
        body->corner_count = body->coordinate_count = 0;
        if (!row_read(body) || !row_is_sound(body)) return false;
    }
    if (body->reading.by_bytes && body->wanted) rows_write(body, (PlySpan){start, body->reading.left.at});
    return true;
}

static bool body_read(Body *body)
{
    if (!ply_header_read(&body->header, &body->reading) || !elements_are_sound(body)) return false;
    header_write(body);
    body->reading.by_bytes = body->header.format != PLY_ASCII;
    for (size_t i = 0; i < body->header.elements.count; i++)
        if (!element_read(body, &body->header.elements.items[i])) return false;
    kept_write(body);
    return true;
}

bool ply_read(Text *clean, const char *path, char *fault, size_t size)
{
    MessageList messages = {0};
    Text file = {0};
    bool read = text_read_file(&file, path, &messages);
    if (read) {
        const char *start = text_c(&file);
        Body body = {.reading = {.start = start, .left = {start, start + file.count}}, .clean = clean};
        body.reading.fault = fault;
        body.reading.fault_size = size;
        array_reserve(*clean, file.count + 1);
        read = body_read(&body);
        ply_header_free(&body.header);
    } else {
        snprintf(fault, size, "the file cannot be read");
    }
    text_free(&file);
    message_list_free(&messages);
    return read;
}
