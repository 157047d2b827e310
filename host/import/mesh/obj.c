// Wavefront OBJ (Alias|Wavefront, Advanced Visualizer manual, appendix B, 1995): polygons, and the materials
// of its MTL files.
#include "host/base/array.h"
#include "host/import/line.h"
#include "host/import/mesh/draft.h"
#include "host/import/mesh/mtl.h"

#include <stdlib.h>

typedef struct {
    MeshDraft *draft;
    Line line;
    UnusedWords unused;
    bool has_colors, has_more_words; // whether a warning of them was given
    bool lacks[DRAFT_PART_COUNT];    // whether a missing index was warned of
    ObjMaterials materials;
} ObjReader;

// Warns once of words after the numbers of a row.
static void end_expect(ObjReader *reader)
{
    if (reader->has_more_words || !line_has_word(&reader->line)) return;
    report_warning(&reader->draft->report, line_offset(&reader->line),
                   "words after the last number of a row are ignored");
    reader->has_more_words = true;
}

// Reads a position. A fourth number is homogeneous, and further ones are a color.
static bool position_read(ObjReader *reader)
{
    MeshDraft *draft = reader->draft;
    double numbers[4] = {0};
    const int count = line_try_numbers(&reader->line, numbers, 4);
    const bool at_end = !line_has_word(&reader->line);
    const size_t offset = line_offset(&reader->line);
    Vector3 position = {numbers[0], numbers[1], numbers[2]};
    if (count == 4 && at_end) {
        if (numbers[3] == 0)
            return draft_fails(draft, offset, "the fourth number of a vertex must not be zero");
        position = (Vector3){position.x / numbers[3], position.y / numbers[3], position.z / numbers[3]};
    } else if (count == 4 && !reader->has_colors) {
        report_warning(&draft->report, offset, "%s", draft_colors);
        reader->has_colors = true;
    } else if (count == 3) {
        end_expect(reader);
    }
    return draft_add_vertex(draft, position, count < 3 ? offset : 0);
}

static bool uv_read(ObjReader *reader)
{
    double numbers[3] = {NAN, 0, 0};
    const int count = line_try_numbers(&reader->line, numbers, 3);
    if (count < 2 && line_has_word(&reader->line)) numbers[count] = NAN;
    if (count >= 2) end_expect(reader);
    draft_add_uv(reader->draft, numbers[0], numbers[1]);
    return true;
}

static bool normal_read(ObjReader *reader)
{
    double numbers[3] = {0};
    const int count = line_try_numbers(&reader->line, numbers, 3);
    const Vector3 normal = {numbers[0], numbers[1], numbers[2]};
    if (count == 3) end_expect(reader);
    array_push(reader->draft->normals, count == 3 ? normal : vector_all(NAN));
    return true;
}

static bool corner_fails(ObjReader *reader, const char *start)
{
    reader->line.at = start;
    const Word word = line_word(&reader->line);
    return draft_fails(reader->draft, word.offset, "'%.*s' is not a corner of a face", WORD_TEXT(word));
}

// Handles an index of a missing element. Returns false with an error for a vertex. For other parts, warns
// once and leaves the part out of the corner.
static bool index_fails(ObjReader *reader, DraftPart part, int64_t index, size_t offset)
{
    MeshDraft *draft = reader->draft;
    const size_t count = draft_part_count(draft, part);
    if (part == DRAFT_POSITION && index == 0)
        return draft_fails(draft, offset, "a face names vertex 0; indices count from 1, or backward from -1");
    if (part == DRAFT_POSITION)
        return draft_fails(draft, offset,
                           "a face names vertex %lld, but the file has only %zu before the face",
                           (long long)index, count);
    if (!reader->lacks[part])
        report_warning(&draft->report, offset,
                       "a face names %s %lld, but the file has only %zu before the face; it is ignored",
                       draft_part_names[part], (long long)index, count);
    reader->lacks[part] = true;
    array_push(draft->corners[part], DRAFT_NONE);
    return true;
}

// Reads the next index, of a vertex or after a slash. Indices count from 1, or backward from the latest
// element if they are below 0.
static bool obj_index_read(ObjReader *reader, DraftPart part, const char *corner)
{
    enum { DIGITS_MAX = 18 };
    const char *at = reader->line.at, *start = at;
    const bool is_negative = *at == '-';
    if (*at == '-' || *at == '+') at++;
    const char *first = at;
    int64_t index = 0;
    for (; (unsigned char)(*at - '0') < 10 && at - first < DIGITS_MAX; at++)
        index = 10 * index + (*at - '0');
    if (at == first || (unsigned char)(*at - '0') < 10) return corner_fails(reader, corner);
    reader->line.at = at;
    const size_t offset = (size_t)(start - reader->line.text);
    const int64_t count = (int64_t)draft_part_count(reader->draft, part);
    const int64_t from_0 = is_negative ? count - index : index - 1;
    if (from_0 < 0 || from_0 >= DRAFT_NONE || (is_negative && index == 0))
        return index_fails(reader, part, is_negative ? -index : index, offset);
    draft_add_index(reader->draft, part, (uint32_t)from_0, offset);
    return true;
}

// Reads a corner: `v`, `v/vt`, `v//vn` or `v/vt/vn`.
static bool corner_read(ObjReader *reader)
{
    static const DraftPart parts[] = {DRAFT_UV, DRAFT_NORMAL};
    const char *start = reader->line.at;
    const size_t corner = reader->draft->corners[DRAFT_POSITION].count;
    if (!obj_index_read(reader, DRAFT_POSITION, start)) return false;
    for (int i = 0; i < 2; i++) {
        DraftIndices *indices = &reader->draft->corners[parts[i]];
        const bool has_slash = *reader->line.at == '/';
        if (has_slash) reader->line.at++;
        if (has_slash && *reader->line.at != '/' && !word_ends_at(&reader->line, reader->line.at)) {
            if (indices->count == 0) draft_begin_part(reader->draft, parts[i], corner);
            if (!obj_index_read(reader, parts[i], start)) return false;
        } else if (indices->count > 0) {
            array_push(*indices, DRAFT_NONE);
        }
    }
    return word_ends_at(&reader->line, reader->line.at) || corner_fails(reader, start);
}

static bool face_read(ObjReader *reader)
{
    const size_t offset = line_offset(&reader->line);
    while (line_has_word(&reader->line))
        if (!corner_read(reader)) return false;
    return draft_end_face(reader->draft, offset);
}

static bool used_material_read(ObjReader *reader)
{
    const ObjMaterial material = {line_rest(&reader->line), reader->draft->face_start};
    array_push(reader->materials.used, material);
    return true;
}

static bool library_name_read(ObjReader *reader)
{
    array_push(reader->materials.libraries, line_rest(&reader->line));
    return true;
}

// Each `read` reads the words after its keyword. NULL ignores them: the names of groups and objects, and
// smoothing, which the scene controls.
static const struct {
    const char *word;
    bool (*read)(ObjReader *reader);
} statements[] = {
    {"v", position_read},
    {"vt", uv_read},
    {"vn", normal_read},
    {"f", face_read},
    {"fo", face_read},
    {"usemtl", used_material_read},
    {"mtllib", library_name_read},
    {"g", NULL},
    {"o", NULL},
    {"s", NULL},
};

static bool obj_line_read(ObjReader *reader)
{
    const Word word = line_word(&reader->line);
    if (word.length == 0) return true;
    for (size_t i = 0; i < COUNT_OF(statements); i++)
        if (word_is(word, statements[i].word)) return !statements[i].read || statements[i].read(reader);
    unused_record(&reader->unused, &reader->draft->report, word, "is not supported and is ignored");
    return true;
}

bool obj_read(MeshDraft *draft)
{
    ObjReader reader = {.draft = draft, .line = line_first_of_mesh(&draft->report)};
    draft->first_index = 1;
    bool read = line_is_text(&reader.line);
    if (read) {
        do {
            stage_set(draft->stage, line_offset(&reader.line));
            read = obj_line_read(&reader);
        } while (read && line_next(&reader.line));
    }
    if (read) draft_drop_missing(draft);
    if (read && draft->import->own_materials) obj_materials_read(draft, &reader.materials);
    free(reader.materials.used.items);
    free(reader.materials.libraries.items);
    return read;
}
