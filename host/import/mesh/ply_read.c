// A PLY file's vertices and faces (Turk, The PLY Polygon File Format, 1994), in text or binary.
#include "host/base/array.h"
#include "host/import/mesh/draft.h"
#include "host/import/mesh/ply.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

// The role of a property, which is a number of a vertex or a list of a face.
typedef enum {
    ROLE_X,
    ROLE_Y,
    ROLE_Z,
    ROLE_NX,
    ROLE_NY,
    ROLE_NZ,
    ROLE_U,
    ROLE_V,
    ROLE_NUMBER_COUNT,
    ROLE_CORNERS = ROLE_NUMBER_COUNT,
    ROLE_CORNER_UVS,
    ROLE_NONE,
} PlyRole;

typedef ARRAY_OF(double) Numbers;

typedef struct {
    PlyHeader header;
    MeshDraft *draft;
    Line line;                 // of the row, in text; a binary file is read from line.at on
    const PlyElement *element; // of the current row, and the row's index
    size_t row;
    ARRAY_OF(PlyRole) roles; // of the element's properties
    bool has_role[ROLE_NONE + 1];
    double numbers[ROLE_NONE + 1]; // of the current vertex
    size_t unread;                 // the offset of its first coordinate that is not a number in range, or 0
    Numbers corners, corner_uvs;   // of the current face
    bool has_more_words;           // whether words after a row's last property were warned of
} PlyReader;

static const PlyProperty *properties_of(const PlyReader *reader, const PlyElement *element)
{
    return reader->header.properties.items + element->first_property;
}

static bool is_wanted(const PlyElement *element)
{
    return element->property_count > 0 &&
           (word_is(element->name, "vertex") || word_is(element->name, "face"));
}

// The names of each role's properties.
static const char *const role_names[ROLE_NONE][4] = {
    [ROLE_X] = {"x"},
    [ROLE_Y] = {"y"},
    [ROLE_Z] = {"z"},
    [ROLE_NX] = {"nx"},
    [ROLE_NY] = {"ny"},
    [ROLE_NZ] = {"nz"},
    [ROLE_U] = {"u", "s", "texture_u", "tx"},
    [ROLE_V] = {"v", "t", "texture_v", "ty"},
    [ROLE_CORNERS] = {"vertex_indices", "vertex_index"},
    [ROLE_CORNER_UVS] = {"texcoord"},
};

static PlyRole role_of(const PlyElement *element, const PlyProperty *property)
{
    const bool is_list = property->count_type != NULL;
    if (!word_is(element->name, is_list ? "face" : "vertex")) return ROLE_NONE;
    const PlyRole end = is_list ? ROLE_NONE : ROLE_NUMBER_COUNT;
    for (PlyRole role = is_list ? ROLE_NUMBER_COUNT : ROLE_X; role < end; role++)
        for (size_t i = 0; i < 4 && role_names[role][i]; i++)
            if (word_is(property->name, role_names[role][i])) return role;
    return ROLE_NONE;
}

static bool elements_are_sound(PlyReader *reader)
{
    const PlyElement *elements = reader->header.elements.items;
    for (size_t i = 0; i < reader->header.elements.count; i++) {
        Word name = elements[i].name;
        if (word_is(name, "tristrips") && elements[i].count > 0)
            return draft_fails(
                reader->draft, name.offset,
                "strips of triangles (tristrips) are not supported; export the mesh with faces");
        for (size_t k = 0; k < i && is_wanted(&elements[i]); k++)
            if (words_equal(name, elements[k].name))
                return draft_fails(reader->draft, name.offset, "the header declares '%.*s' twice",
                                   WORD_TEXT(name));
    }
    return true;
}

// Warns of an element that is not used, or of the unused properties of one that is.
static void element_warn_of_unused(PlyReader *reader, const PlyElement *element)
{
    OwnedText unused = {0};
    const PlyProperty *first = NULL;
    for (size_t i = 0; i < element->property_count; i++) {
        const PlyProperty *property = &properties_of(reader, element)[i];
        if (reader->roles.items[i] != ROLE_NONE) continue;
        text_appendf(&unused, "%s '%.*s'", first ? "," : "", WORD_TEXT(property->name));
        if (!first) first = property;
    }
    const Word name = element->name;
    if (!is_wanted(element))
        report_warning(&reader->draft->report, name.offset, "the element '%.*s' is ignored", WORD_TEXT(name));
    else if (first)
        report_warning(&reader->draft->report, first->name.offset,
                       "these properties of '%.*s' are ignored:%s", WORD_TEXT(name), text_c(&unused));
}

static bool is_binary(const PlyReader *reader)
{
    return reader->header.format != PLY_ASCII;
}

static bool value_missing(PlyReader *reader, const PlyProperty *property)
{
    Word element = reader->element->name;
    return draft_fails(reader->draft, line_offset(&reader->line),
                       "%.*s %zu (counted from 0) lacks its '%.*s'", WORD_TEXT(element), reader->row,
                       WORD_TEXT(property->name));
}

// Reads a whole number of 32 bits.
static bool whole_read(const char **text, const char *end, PlyNumberType type, double *value)
{
    const char *at = *text;
    const bool is_negative = type == PLY_SIGNED && at < end && *at == '-';
    if (type == PLY_SIGNED && at < end && (*at == '-' || *at == '+')) at++;
    const char *first = at;
    uint64_t number = 0;
    for (; at < end && (unsigned char)(*at - '0') < 10 && number <= UINT32_MAX; at++)
        number = 10 * number + (uint64_t)(*at - '0');
    if (at == first || number > UINT32_MAX) return false;
    *text = at;
    *value = is_negative ? -(double)number : (double)number;
    return true;
}

// Reads a number. Replaces values that are not finite or too large with NAN.
static bool real_read(const char **text, const char *end, double *value)
{
    static const char *const not_finite[] = {"infinity", "inf", "nan"};
    const NumberStatus status = number_scan(text, end, value);
    if (status != NUMBER_READ) *value = NAN;
    if (status != NUMBER_MALFORMED) return true;
    const char *at = *text;
    if (at < end && (*at == '-' || *at == '+')) at++;
    for (size_t i = 0; i < COUNT_OF(not_finite); i++) {
        const size_t length = strlen(not_finite[i]);
        if ((size_t)(end - at) < length || strncasecmp(at, not_finite[i], length) != 0) continue;
        *text = at + length;
        return true;
    }
    return false;
}

// Reads the line's next word as a number of the type. Sets *is_there to whether the line has one.
static bool word_read(PlyReader *reader, const PlyType *type, double *value, bool *is_there)
{
    *is_there = line_has_word(&reader->line);
    if (!*is_there) return true;
    const char *at = reader->line.at, *end = reader->line.end;
    const bool read = type->number_type == PLY_REAL ? real_read(&at, end, value)
                                                    : whole_read(&at, end, type->number_type, value);
    if (read && word_ends_at(&reader->line, at)) {
        reader->line.at = at;
        return true;
    }
    const Word word = line_word(&reader->line);
    return draft_fails(reader->draft, word.offset, "'%.*s' is not a number of type %s", WORD_TEXT(word),
                       type->name);
}

static size_t bytes_left(const PlyReader *reader)
{
    return (size_t)(reader->line.end - reader->line.at);
}

static double binary_number(const PlyReader *reader, const PlyType *type)
{
    const unsigned char *bytes = (const unsigned char *)reader->line.at;
    uint64_t bits = 0, end = 1; // of whole numbers' bits
    for (size_t i = 0; i < type->size; i++, end <<= 8)
        bits = bits << 8 | bytes[reader->header.format == PLY_BIG_ENDIAN ? i : type->size - 1 - i];
    if (type->number_type == PLY_UNSIGNED) return (double)bits;
    if (type->number_type == PLY_SIGNED) return (double)bits - (bits >= end / 2 ? (double)end : 0);
    double number;
    float single;
    uint32_t single_bits = (uint32_t)bits;
    memcpy(&number, &bits, sizeof number);
    memcpy(&single, &single_bits, sizeof single);
    return type->size == sizeof single ? single : number;
}

// Reads the next number of the line or the file. Sets *is_there to whether it has one.
static bool ply_value_read(PlyReader *reader, const PlyType *type, double *value, bool *is_there)
{
    if (!is_binary(reader)) return word_read(reader, type, value, is_there);
    *is_there = bytes_left(reader) >= type->size;
    if (!*is_there) return true;
    *value = binary_number(reader, type);
    reader->line.at += type->size;
    return true;
}

// Reads the row's next number, which must exist.
static bool number_next(PlyReader *reader, const PlyProperty *property, const PlyType *type, double *value)
{
    bool is_there;
    return ply_value_read(reader, type, value, &is_there) && (is_there || value_missing(reader, property));
}

static bool list_fails(PlyReader *reader, const PlyProperty *property, size_t offset, double promised,
                       size_t held)
{
    Word element = reader->element->name;
    return draft_fails(reader->draft, offset,
                       "%.*s %zu (counted from 0) declares %.15g numbers of '%.*s', but the %s has only %zu",
                       WORD_TEXT(element), reader->row, promised, WORD_TEXT(property->name),
                       is_binary(reader) ? "file" : "line", held);
}

static bool is_count(double number)
{
    return number >= 0 && floor(number) == number;
}

static bool list_read(PlyReader *reader, const PlyProperty *property, Numbers *numbers)
{
    double count;
    const size_t start = is_binary(reader) ? line_offset(&reader->line) : line_word_offset(&reader->line);
    if (!number_next(reader, property, property->count_type, &count)) return false;
    if (is_binary(reader)) {
        const size_t most = bytes_left(reader) / property->type->size;
        if (!is_count(count) || count > (double)most) return list_fails(reader, property, start, count, most);
    } else if (!is_count(count)) {
        return draft_fails(reader->draft, start, "the length of a list must be whole, not %.15g", count);
    }
    for (size_t i = 0; (double)i < count; i++) {
        double value;
        bool is_there;
        if (!ply_value_read(reader, property->type, &value, &is_there)) return false;
        if (!is_there) return list_fails(reader, property, start, count, i);
        if (numbers) array_push(*numbers, value);
    }
    return true;
}

static bool ply_property_read(PlyReader *reader, size_t index)
{
    const PlyProperty *property = &properties_of(reader, reader->element)[index];
    const PlyRole role = reader->roles.items[index];
    if (property->count_type)
        return list_read(reader, property,
                         role == ROLE_CORNERS      ? &reader->corners
                         : role == ROLE_CORNER_UVS ? &reader->corner_uvs
                                                   : NULL);
    if (role <= ROLE_Z && !is_binary(reader) && !reader->unread) {
        const size_t start = line_word_offset(&reader->line);
        if (!number_next(reader, property, property->type, &reader->numbers[role])) return false;
        if (isnan(reader->numbers[role])) reader->unread = start;
        return true;
    }
    return number_next(reader, property, property->type, &reader->numbers[role]);
}

// Starts a row. In text a row is a nonempty line.
static bool row_start(PlyReader *reader)
{
    return line_next_filled(&reader->line) ||
           draft_fails(reader->draft, reader->draft->source.length,
                       "the file ends before %.*s %zu (counted from 0) of %zu",
                       WORD_TEXT(reader->element->name), reader->row, reader->element->count);
}

static bool ply_vertex_add(PlyReader *reader)
{
    MeshDraft *draft = reader->draft;
    const double *numbers = reader->numbers;
    if (draft->is_shared[DRAFT_NORMAL])
        array_push(draft->normals, ((Vector3){numbers[ROLE_NX], numbers[ROLE_NY], numbers[ROLE_NZ]}));
    if (draft->is_shared[DRAFT_UV]) draft_add_uv(draft, numbers[ROLE_U], numbers[ROLE_V]);
    return draft_add_vertex(draft, (Vector3){numbers[ROLE_X], numbers[ROLE_Y], numbers[ROLE_Z]},
                            reader->unread);
}

static bool ply_face_add(PlyReader *reader)
{
    MeshDraft *draft = reader->draft;
    const size_t offset = line_offset(&reader->line), count = reader->corners.count;
    if (reader->corner_uvs.count > 2 * count)
        return draft_fails(reader->draft, offset,
                           "face %zu (counted from 0) has %zu corner%s, but %zu texture coordinate%s",
                           reader->row, count, text_plural(count), reader->corner_uvs.count / 2,
                           text_plural(reader->corner_uvs.count / 2));
    for (size_t i = 0; i < count; i++) {
        const double index = reader->corners.items[i];
        if (!(index >= 0 && index <= UINT32_MAX && floor(index) == index))
            return draft_fails(reader->draft, offset,
                               "face %zu (counted from 0) names vertex %.15g, which cannot exist",
                               reader->row, index);
        draft_add_index(draft, DRAFT_POSITION, (uint32_t)index, offset);
        if (!reader->has_role[ROLE_CORNER_UVS]) continue;
        const bool has_uv = 2 * i + 1 < reader->corner_uvs.count;
        array_push(draft->corners[DRAFT_UV], has_uv ? (uint32_t)draft->uvs.count : DRAFT_NONE);
        if (has_uv) draft_add_uv(draft, reader->corner_uvs.items[2 * i], reader->corner_uvs.items[2 * i + 1]);
    }
    return draft_end_face(draft, offset);
}

static bool row_read(PlyReader *reader)
{
    reader->unread = 0;
    reader->corners.count = reader->corner_uvs.count = 0;
    if (!is_binary(reader) && !row_start(reader)) return false;
    for (size_t i = 0; i < reader->element->property_count; i++)
        if (!ply_property_read(reader, i)) return false;
    if (!is_wanted(reader->element)) return true;
    if (!is_binary(reader) && !reader->has_more_words && line_peek(&reader->line).length > 0) {
        report_warning(&reader->draft->report, line_peek(&reader->line).offset,
                       "words after the last property of a row are ignored");
        reader->has_more_words = true;
    }
    return word_is(reader->element->name, "face") ? ply_face_add(reader) : ply_vertex_add(reader);
}

static void roles_find(PlyReader *reader, const PlyElement *element)
{
    reader->roles.count = 0;
    memset(reader->has_role, 0, sizeof reader->has_role);
    for (size_t i = 0; i < element->property_count; i++) {
        PlyRole role = role_of(element, &properties_of(reader, element)[i]);
        if (reader->has_role[role]) role = ROLE_NONE;
        array_push(reader->roles, role);
        reader->has_role[role] = true;
    }
}

// Returns whether a face's list has texture coordinates, which take precedence over the vertices'.
static bool corners_have_uvs(const PlyReader *reader)
{
    for (size_t i = 0; i < reader->header.elements.count; i++) {
        const PlyElement *element = &reader->header.elements.items[i];
        for (size_t k = 0; k < element->property_count; k++)
            if (role_of(element, &properties_of(reader, element)[k]) == ROLE_CORNER_UVS) return true;
    }
    return false;
}

static bool element_start(PlyReader *reader, const PlyElement *element)
{
    MeshDraft *draft = reader->draft;
    reader->element = element;
    roles_find(reader, element);
    if (element->property_count == 0) return true;
    element_warn_of_unused(reader, element);
    if (!word_is(element->name, "vertex")) return true;
    for (PlyRole role = ROLE_X; role <= ROLE_Z; role++)
        if (!reader->has_role[role])
            return draft_fails(reader->draft, element->name.offset, "the vertices have no '%s'",
                               role_names[role][0]);
    draft->is_shared[DRAFT_NORMAL] =
        reader->has_role[ROLE_NX] && reader->has_role[ROLE_NY] && reader->has_role[ROLE_NZ];
    draft->is_shared[DRAFT_UV] =
        reader->has_role[ROLE_U] && reader->has_role[ROLE_V] && !corners_have_uvs(reader);
    return true;
}

static bool element_rows_read(PlyReader *reader, const PlyElement *element)
{
    MeshDraft *draft = reader->draft;
    draft->places = DRAFT_LINES; // of the header
    if (!element_start(reader, element)) return false;
    if (is_binary(reader)) draft->places = DRAFT_BYTES;
    // an element without properties has no rows, whatever its count
    const size_t count = element->property_count > 0 ? element->count : 0;
    for (reader->row = 0; reader->row < count; reader->row++) {
        stage_set(draft->stage, line_offset(&reader->line));
        if (!row_read(reader)) return false;
    }
    return true;
}

static void warn_of_rest(PlyReader *reader)
{
    const size_t rest = bytes_left(reader);
    if (is_binary(reader) && rest > 0)
        draft_warn(reader->draft, "%zu byte%s after the last element %s ignored", rest, text_plural(rest),
                   text_is_are(rest));
    else if (!is_binary(reader) && line_next_filled(&reader->line))
        report_warning(&reader->draft->report, line_peek(&reader->line).offset,
                       "lines after the last element are ignored");
}

bool ply_read(MeshDraft *draft)
{
    PlyReader reader = {.draft = draft, .line = line_first(&draft->report, '\n')};
    bool read = ply_header_read(&reader.header, &reader.line) && elements_are_sound(&reader);
    if (is_binary(&reader) && !line_next(&reader.line)) reader.line.at = reader.line.end; // no body
    for (size_t i = 0; read && i < reader.header.elements.count; i++)
        read = element_rows_read(&reader, &reader.header.elements.items[i]);
    if (read) warn_of_rest(&reader);
    ply_header_free(&reader.header);
    free(reader.roles.items);
    free(reader.corners.items);
    free(reader.corner_uvs.items);
    return read;
}
