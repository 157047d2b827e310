// STL (3D Systems, StereoLithography Interface Specification, 1989), in text or binary. Facet normals are
// not read, since the triangles determine them.
#include "host/base/array.h"
#include "host/import/line.h"
#include "host/import/mesh/draft.h"

#include <string.h>
#include <strings.h>

enum { HEADER_SIZE = 84, FACET_SIZE = 50, FACET_VERTICES = 12, FACET_ATTRIBUTE = 48 };

typedef struct {
    MeshDraft *draft;
    Line line;
    UnusedWords unused;
    size_t corner_count; // of the current facet
} StlReader;

static bool vertex_read(StlReader *reader)
{
    MeshDraft *draft = reader->draft;
    double numbers[3] = {0};
    const bool is_read = line_try_numbers(&reader->line, numbers, 3) == 3;
    array_push(draft->corners[DRAFT_POSITION], (uint32_t)draft->positions.count);
    reader->corner_count++;
    return draft_add_vertex(draft, (Vector3){numbers[0], numbers[1], numbers[2]},
                            is_read ? 0 : line_offset(&reader->line));
}

static bool facet_end(StlReader *reader, size_t offset)
{
    const size_t count = reader->corner_count;
    reader->corner_count = 0;
    if (count > 0 && count < 3)
        return draft_fails(reader->draft, offset, "a facet has %zu corner%s instead of 3", count,
                           text_plural(count));
    return draft_end_face(reader->draft, offset);
}

static bool stl_line_read(StlReader *reader)
{
    static const char *const known[] = {"facet", "outer", "solid", "endsolid"};
    const Word word = line_word(&reader->line);
    if (word.length == 0) return true;
    if (word_is_in_any_case(word, "vertex")) return vertex_read(reader);
    if (word_is_in_any_case(word, "endloop") || word_is_in_any_case(word, "endfacet"))
        return facet_end(reader, word.offset);
    for (size_t i = 0; i < COUNT_OF(known); i++)
        if (word_is_in_any_case(word, known[i])) return true;
    unused_record(&reader->unused, &reader->draft->report, word, "is not a keyword of STL and is ignored");
    return true;
}

static bool text_read(MeshDraft *draft)
{
    StlReader reader = {.draft = draft, .line = line_first_of_mesh(&draft->report)};
    if (!line_is_text(&reader.line)) return false;
    do {
        stage_set(draft->stage, line_offset(&reader.line));
        if (!stl_line_read(&reader)) return false;
    } while (line_next(&reader.line));
    return reader.corner_count == 0 ||
           draft_fails(draft, draft->source.length, "the file ends within a facet");
}

static float float_at(const char *bytes)
{
    const uint32_t bits = little_endian_at(bytes);
    float number;
    memcpy(&number, &bits, sizeof number);
    return number;
}

static size_t facet_count(const Source *source)
{
    return little_endian_at(source->bytes + HEADER_SIZE - 4);
}

static bool binary_read(MeshDraft *draft)
{
    const Source *source = &draft->source;
    draft->places = DRAFT_BYTES;
    if (source->length < HEADER_SIZE)
        return draft_fails(draft, source->length,
                           "an STL file must start with 'solid' or have %d bytes before its facets",
                           HEADER_SIZE);
    const size_t count = facet_count(source);
    const size_t held = (source->length - HEADER_SIZE) / FACET_SIZE;
    if (count > DRAFT_VERTICES_MAX / 3)
        return draft_fails(draft, HEADER_SIZE - 4,
                           "%zu facets are declared; at most %u are supported (a text file must start with "
                           "'solid')",
                           count, DRAFT_VERTICES_MAX / 3);
    if (count > held)
        return draft_fails(draft, HEADER_SIZE - 4, "%zu facet%s %s declared, but the file has only %zu",
                           count, text_plural(count), text_is_are(count), held);
    bool has_attributes = false;
    for (size_t i = 0; i < count; i++) {
        const size_t offset = HEADER_SIZE + i * FACET_SIZE;
        stage_set(draft->stage, offset);
        const char *facet = source->bytes + offset;
        for (size_t corner = 0; corner < 3; corner++) {
            const char *bytes = facet + FACET_VERTICES + 12 * corner;
            array_push(draft->corners[DRAFT_POSITION], (uint32_t)draft->positions.count);
            array_push(draft->positions,
                       ((Vector3){float_at(bytes), float_at(bytes + 4), float_at(bytes + 8)}));
        }
        has_attributes |= facet[FACET_ATTRIBUTE] != 0 || facet[FACET_ATTRIBUTE + 1] != 0;
        if (!draft_end_face(draft, offset)) return false;
    }
    if (has_attributes) draft_warn(draft, "attributes of facets, such as colors, are ignored");
    const size_t rest = source->length - HEADER_SIZE - count * FACET_SIZE;
    if (rest > 0)
        draft_warn(draft, "%zu byte%s after the last facet %s ignored", rest, text_plural(rest),
                   text_is_are(rest));
    return true;
}

// Returns whether a line before the first NUL starts with `solid`. Comments, blanks and a byte order mark may
// precede it.
static bool is_text(MeshDraft *draft)
{
    Line line = line_first_of_mesh(&draft->report);
    line.end = line.at + strnlen(line.at, (size_t)(line.end - line.at));
    do
        if (line_has_word(&line) && strncasecmp(line.at, "solid", strlen("solid")) == 0) return true;
    while (line_next(&line));
    return false;
}

// Reads an STL file. A binary file may start with `solid`, but only a binary file has exactly the size of
// its facets.
bool stl_read(MeshDraft *draft)
{
    const Source *source = &draft->source;
    const bool is_exact =
        source->length >= HEADER_SIZE && source->length == HEADER_SIZE + facet_count(source) * FACET_SIZE;
    return !is_exact && is_text(draft) ? text_read(draft) : binary_read(draft);
}
