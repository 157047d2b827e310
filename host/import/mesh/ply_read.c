// Checks that a PLY file is complete, and rewrites it for assimp, whose reader allocates whatever length a
// list claims, repeats the last line of a file that is too short, misreads a last line without a newline, and
// misparses unknown elements, repeated blanks and empty lines.
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
} PlyRewriter;

static const PlyProperty *properties_of(const PlyRewriter *rewriter, const PlyElement *element)
{
    return rewriter->header.properties.items + element->first_property;
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

static void element_write(PlyRewriter *rewriter, const PlyElement *element)
{
    text_appendf(rewriter->clean, "element %.*s %zu\n", (int)(element->name.end - element->name.at),
                 element->name.at, element->count);
    for (size_t i = 0; i < element->property_count; i++) {
        const PlyProperty *property = &properties_of(rewriter, element)[i];
        text_appendf(rewriter->clean, "property ");
        if (property->count_type) text_appendf(rewriter->clean, "list %s ", property->count_type->name);
        text_appendf(rewriter->clean, "%s ", property->type->name);
        if (name_is_wanted(element, property))
            text_append(rewriter->clean, property->name.at, (size_t)(property->name.end - property->name.at));
        else
            text_appendf(rewriter->clean, "unknown");
        text_appendf(rewriter->clean, "\n");
    }
}

static void header_write(PlyRewriter *rewriter)
{
    static const char *const formats[] = {
        [PLY_ASCII] = "ascii",
        [PLY_LITTLE_ENDIAN] = "binary_little_endian",
        [PLY_BIG_ENDIAN] = "binary_big_endian",
    };
    text_appendf(rewriter->clean, "ply\nformat %s 1.0\n", formats[rewriter->header.format]);
    for (size_t i = 0; i < rewriter->header.elements.count; i++)
        if (is_wanted(&rewriter->header.elements.items[i]))
            element_write(rewriter, &rewriter->header.elements.items[i]);
    text_appendf(rewriter->clean, "end_header\n");
    rewriter->header_size = rewriter->clean->count;
}

// assimp takes a newline right after the header for part of it unless a carriage return precedes.
static void rows_write(PlyRewriter *rewriter, PlySpan rows)
{
    if (rewriter->clean->count == rewriter->header_size && rows.at < rows.end && *rows.at == '\n') {
        rewriter->clean->count--;
        text_append(rewriter->clean, "\r\n", 2);
    }
    text_append(rewriter->clean, rows.at, (size_t)(rows.end - rows.at));
}

static bool names_agree(PlySpan a, PlySpan b)
{
    size_t length = (size_t)(a.end - a.at);
    return length == (size_t)(b.end - b.at) && !memcmp(a.at, b.at, length);
}

// If an element is declared twice, assimp writes the second's rows beyond the first's; of a triangle strip it
// keeps one triangle.
static bool elements_are_sound(PlyRewriter *rewriter)
{
    const PlyElement *elements = rewriter->header.elements.items;
    for (size_t i = 0; i < rewriter->header.elements.count; i++) {
        PlySpan name = elements[i].name;
        if (ply_span_is(name, "tristrips") && elements[i].count > 0)
            return ply_fails(&rewriter->reading, "strips of triangles (tristrips) are not read, only faces");
        for (size_t k = 0; k < i && is_wanted(&elements[i]); k++)
            if (names_agree(name, elements[k].name))
                return ply_fails(&rewriter->reading, "the header declares '%.*s' twice", ply_shown(name),
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
    enum { DIGITS_MAX = 19 };
    const char *first = at;
    while (at < end && is_digit(*at) && at - first < DIGITS_MAX)
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

// Reports that the row lacks the property's value; always false.
static bool value_missing(PlyRewriter *rewriter, const PlyProperty *property)
{
    PlySpan element = rewriter->element->name;
    return ply_fails(&rewriter->reading, "%.*s %zu (from 0) lacks its '%.*s'", ply_shown(element), element.at,
                     rewriter->row, ply_shown(property->name), property->name.at);
}

// Reads the line's next word, if any.
static bool word_read(PlyRewriter *rewriter, const PlyType *type, PlySpan *line, PlySpan *word)
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
    return ply_fails(&rewriter->reading, "'%.*s' is no number of type %s", ply_shown(*word), word->at,
                     type->name);
}

static bool line_number_read(PlyRewriter *rewriter, const PlyProperty *property, const PlyType *type,
                             PlySpan *line, PlySpan *word)
{
    if (!word_read(rewriter, type, line, word)) return false;
    return word->at < word->end || value_missing(rewriter, property);
}

static bool list_fails(PlyRewriter *rewriter, const PlyProperty *property, double promised, size_t held,
                       const char *holder)
{
    PlySpan element = rewriter->element->name;
    return ply_fails(&rewriter->reading,
                     "%.*s %zu (from 0) declares %.15g numbers of '%.*s', %s has %zu more",
                     ply_shown(element), element.at, rewriter->row, promised, ply_shown(property->name),
                     property->name.at, holder, held);
}

static bool is_count(double number)
{
    return number >= 0 && floor(number) == number;
}

static void list_note(PlyRewriter *rewriter, const PlyProperty *property, double count)
{
    if (property == rewriter->corners) rewriter->corner_count = count;
    if (property == rewriter->coordinates) rewriter->coordinate_count = count;
}

// assimp also reads texture coordinates for corners that do not exist.
static bool row_is_sound(PlyRewriter *rewriter)
{
    if (rewriter->coordinate_count <= 2 * rewriter->corner_count) return true;
    return ply_fails(&rewriter->reading, "face %zu (from 0) has %.15g corners, but %.15g texture coordinates",
                     rewriter->row, rewriter->corner_count, rewriter->coordinate_count / 2);
}

static bool line_count_read(PlyRewriter *rewriter, const PlyProperty *property, PlySpan *line, double *count)
{
    PlySpan word;
    if (!line_number_read(rewriter, property, property->count_type, line, &word)) return false;
    size_t length = (size_t)(word.end - word.at);
    if (length == 1 && is_digit(*word.at)) {
        *count = *word.at - '0';
        return true;
    }
    return (number_read(word.at, length, count) == NUMBER_READ && is_count(*count)) ||
           ply_fails(&rewriter->reading, "'%.*s' is no length of a list", ply_shown(word), word.at);
}

static bool line_list_read(PlyRewriter *rewriter, const PlyProperty *property, PlySpan *line)
{
    double count;
    if (!line_count_read(rewriter, property, line, &count)) return false;
    list_note(rewriter, property, count);
    for (size_t i = 0; (double)i < count; i++) {
        PlySpan word;
        if (!word_read(rewriter, property->type, line, &word)) return false;
        if (word.at == word.end) return list_fails(rewriter, property, count, i, "the line");
    }
    return true;
}

// The next nonempty line.
static bool line_row_start(PlyRewriter *rewriter, PlySpan *line)
{
    PlySpan name = rewriter->element->name;
    do {
        if (!ply_line(&rewriter->reading, line))
            return ply_fails(&rewriter->reading, "the file ends before %.*s %zu (from 0) of %zu",
                             ply_shown(name), name.at, rewriter->row, rewriter->element->count);
    } while (ply_word_start(line) == line->end);
    return true;
}

static void kept_write(PlyRewriter *rewriter)
{
    if (!rewriter->kept.at) return;
    text_append(rewriter->clean, rewriter->kept.at, (size_t)(rewriter->kept.end - rewriter->kept.at));
    text_append(rewriter->clean, "\n", 1);
    rewriter->kept = (PlySpan){0};
}

// Well-formed input is copied in one piece.
static void line_keep(PlyRewriter *rewriter, PlySpan line)
{
    PlySpan *kept = &rewriter->kept;
    if (kept->at && line.at == kept->end + 1 && *kept->end == '\n') {
        kept->end = line.end;
        return;
    }
    kept_write(rewriter);
    *kept = line;
}

// A row is a line; what follows the last property is ignored.
static bool line_row_read(PlyRewriter *rewriter)
{
    PlySpan line, word;
    if (!line_row_start(rewriter, &line)) return false;
    const char *start = line.at;
    for (size_t i = 0; i < rewriter->element->property_count; i++) {
        const PlyProperty *property = &properties_of(rewriter, rewriter->element)[i];
        if (property->count_type ? !line_list_read(rewriter, property, &line)
                                 : !line_number_read(rewriter, property, property->type, &line, &word))
            return false;
    }
    if (rewriter->wanted) line_keep(rewriter, (PlySpan){start, line.at});
    return true;
}

static size_t bytes_left(const PlyRewriter *rewriter)
{
    return (size_t)(rewriter->reading.left.end - rewriter->reading.left.at);
}

static double binary_number(const PlyRewriter *rewriter, const PlyType *type)
{
    const unsigned char *bytes = (const unsigned char *)rewriter->reading.left.at;
    uint64_t bits = 0;
    for (size_t i = 0; i < type->size; i++)
        bits = bits << 8 | bytes[rewriter->header.format == PLY_BIG_ENDIAN ? i : type->size - 1 - i];
    if (type->kind == PLY_UNSIGNED) return (double)bits;
    if (type->kind == PLY_SIGNED) {
        const uint64_t sign = type->size == 1 ? 0x80 : type->size == 2 ? 0x8000 : 0x80000000;
        return (double)(bits & (sign - 1)) - (double)(bits & sign);
    }
    double number;
    float single;
    uint32_t single_bits = (uint32_t)bits;
    memcpy(&number, &bits, sizeof number);
    memcpy(&single, &single_bits, sizeof single);
    return type->size == sizeof single ? single : number;
}

static bool bytes_skip(PlyRewriter *rewriter, const PlyProperty *property, size_t size)
{
    if (size > bytes_left(rewriter)) return value_missing(rewriter, property);
    rewriter->reading.left.at += size;
    return true;
}

static bool binary_list_read(PlyRewriter *rewriter, const PlyProperty *property)
{
    const char *start = rewriter->reading.left.at;
    if (!bytes_skip(rewriter, property, property->count_type->size)) return false;
    rewriter->reading.left.at = start;
    double count = binary_number(rewriter, property->count_type);
    rewriter->reading.left.at += property->count_type->size;
    size_t most = bytes_left(rewriter) / property->type->size;
    if (!is_count(count) || count > (double)most) {
        rewriter->reading.left.at = start;
        return list_fails(rewriter, property, count, most, "the file");
    }
    list_note(rewriter, property, count);
    return bytes_skip(rewriter, property, (size_t)count * property->type->size);
}

static bool binary_row_read(PlyRewriter *rewriter)
{
    for (size_t i = 0; i < rewriter->element->property_count; i++) {
        const PlyProperty *property = &properties_of(rewriter, rewriter->element)[i];
        if (property->count_type ? !binary_list_read(rewriter, property)
                                 : !bytes_skip(rewriter, property, property->type->size))
            return false;
    }
    return true;
}

static void element_start(PlyRewriter *rewriter, const PlyElement *element)
{
    rewriter->element = element;
    rewriter->wanted = is_wanted(element);
    rewriter->corners = rewriter->coordinates = NULL;
    for (size_t i = 0; i < element->property_count && rewriter->wanted; i++) {
        const PlyProperty *property = &properties_of(rewriter, element)[i];
        if (!property->count_type || !name_is_wanted(element, property)) continue;
        *(ply_span_is(property->name, "texcoord") ? &rewriter->coordinates : &rewriter->corners) = property;
    }
}

static bool element_read(PlyRewriter *rewriter, const PlyElement *element)
{
    bool (*row_read)(PlyRewriter *) = rewriter->reading.by_bytes ? binary_row_read : line_row_read;
    element_start(rewriter, element);
    const char *start = rewriter->reading.left.at;
    // without properties there are no rows, whatever their number
    size_t count = element->property_count > 0 ? element->count : 0;
    for (rewriter->row = 0; rewriter->row < count; rewriter->row++) {
        rewriter->corner_count = rewriter->coordinate_count = 0;
        if (!row_read(rewriter) || !row_is_sound(rewriter)) return false;
    }
    if (rewriter->reading.by_bytes && rewriter->wanted)
        rows_write(rewriter, (PlySpan){start, rewriter->reading.left.at});
    return true;
}

static bool file_rewrite(PlyRewriter *rewriter)
{
    if (!ply_header_read(&rewriter->header, &rewriter->reading) || !elements_are_sound(rewriter))
        return false;
    header_write(rewriter);
    rewriter->reading.by_bytes = rewriter->header.format != PLY_ASCII;
    for (size_t i = 0; i < rewriter->header.elements.count; i++)
        if (!element_read(rewriter, &rewriter->header.elements.items[i])) return false;
    kept_write(rewriter);
    return true;
}

bool ply_rewrite(Text *clean, const char *path, char *fault, size_t size)
{
    MessageList messages = {0};
    Text file = {0};
    bool read = text_read_file(&file, path, &messages);
    if (read) {
        const char *start = text_c(&file);
        PlyRewriter rewriter = {.reading = {.start = start, .left = {start, start + file.count}},
                                .clean = clean};
        rewriter.reading.fault = fault;
        rewriter.reading.fault_size = size;
        array_reserve(*clean, file.count + 1);
        read = file_rewrite(&rewriter);
        ply_header_free(&rewriter.header);
    } else {
        snprintf(fault, size, "the file cannot be read");
    }
    text_free(&file);
    message_list_free(&messages);
    return read;
}
