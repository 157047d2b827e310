#include "host/import/mesh/draft.h"
#include "host/base/file.h"
#include "host/base/text.h"
#include "host/image/image.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

const char *const draft_part_names[DRAFT_PART_COUNT] = {
    [DRAFT_POSITION] = "vertex", [DRAFT_UV] = "texture coordinate", [DRAFT_NORMAL] = "normal"};

static void draft_report(const MeshDraft *draft, MessageSeverity severity, const char *text)
{
    const MeshImport *import = draft->import;
    const bool is_scene = import->offset == MESSAGE_WHOLE_FILE; // whose path the report adds
    if (!report_repeats(import->report, import->path, severity, 0, text))
        report_message(import->report, severity, import->offset, "%s%s%s", is_scene ? "" : import->path,
                       is_scene ? "" : ": ", text);
}

bool draft_refuse(MeshDraft *draft, const char *format, ...)
{
    char *text;
    ARGUMENTS_FORMAT(text, format);
    draft_report(draft, MESSAGE_ERROR, text);
    free(text);
    return false;
}

void draft_warn(MeshDraft *draft, const char *format, ...)
{
    char *text;
    ARGUMENTS_FORMAT(text, format);
    draft_report(draft, MESSAGE_WARNING, text);
    free(text);
}

bool draft_fails(MeshDraft *draft, size_t offset, const char *format, ...)
{
    char *text;
    ARGUMENTS_FORMAT(text, format);
    if (draft->places == DRAFT_NO_PLACES)
        draft_refuse(draft, "%s", text);
    else if (draft->places == DRAFT_BYTES)
        draft_refuse(draft, "byte %zu: %s", offset, text);
    else
        report_error(&draft->report, offset, "%s", text);
    free(text);
    return false;
}

size_t draft_part_count(const MeshDraft *draft, DraftPart part)
{
    return part == DRAFT_POSITION ? draft->positions.count
           : part == DRAFT_UV     ? draft->uvs.count
                                  : draft->normals.count;
}

void draft_record_index(MeshDraft *draft, DraftPart part, size_t index, size_t offset)
{
    if (index >= draft->needed[part].index) draft->needed[part] = (DraftPlace){index + 1, offset};
}

void draft_begin_part(MeshDraft *draft, DraftPart part, size_t corner)
{
    DraftIndices *indices = &draft->corners[part];
    array_reserve(*indices, corner + 1);
    for (; indices->count < corner; indices->count++)
        indices->items[indices->count] = DRAFT_NONE;
}

static void indices_drop(MeshDraft *draft, DraftPart part)
{
    const DraftPlace *needed = &draft->needed[part];
    DraftIndices *indices = &draft->corners[part];
    const size_t count = draft_part_count(draft, part);
    size_t kept = 0;
    for (size_t i = 0; i < indices->count; i++) {
        if (indices->items[i] >= count) indices->items[i] = DRAFT_NONE;
        kept += indices->items[i] != DRAFT_NONE;
    }
    if (kept == 0) indices->count = 0;
    if (needed->index > count)
        report_warning(&draft->report, needed->offset,
                       "a face names %s %zu (from %zu); there are %zu: not used", draft_part_names[part],
                       needed->index - 1 + draft->first_index, draft->first_index, count);
    draft->needed[part].index = 0;
}

void draft_drop_missing(MeshDraft *draft)
{
    indices_drop(draft, DRAFT_UV);
    indices_drop(draft, DRAFT_NORMAL);
}

void draft_fill_parts(MeshDraft *draft)
{
    while (draft->is_shared[DRAFT_NORMAL] && draft->normals.count < draft->positions.count)
        array_push(draft->normals, ((Vector3){0, 0, 0}));
    while (draft->is_shared[DRAFT_UV] && draft->uvs.count < draft->positions.count)
        draft_add_uv(draft, 0, 0);
}

void draft_share_part(MeshDraft *draft, DraftPart part)
{
    draft->is_shared[part] = true;
    draft_fill_parts(draft);
}

static bool is_absolute(const char *path)
{
    const bool has_drive = isalpha((unsigned char)path[0]) && path[1] == ':';
    const char first = has_drive ? path[2] : path[0];
    return first == '/' || first == '\\';
}

char *draft_find_file(const char *from, const char *name, size_t length, bool *is_moved)
{
    const char *slash = strrchr(from, '/');
    const int folder_length = slash ? (int)(slash + 1 - from) : 0;
    char *given = text_format("%.*s", (int)length, name);
    for (char *at = given; *at; at++)
        if (*at == '\\') *at = '/';
    char *path = text_format("%.*s%s", is_absolute(given) ? 0 : folder_length, from, given),
         *near = text_format("%.*s%s", folder_length, from, file_base_name(given));
    *is_moved = file_obstacle(path) && !file_obstacle(near);
    free(given);
    free(*is_moved ? path : near);
    return *is_moved ? near : path;
}

const char *texture_fallback(TextureContent content)
{
    return content == TEXTURE_COLORS    ? "the color is used"
           : content == TEXTURE_OPACITY ? "nothing is cut out"
                                        : "normals are not tilted";
}

static uint32_t texture_add(MeshDraft *draft, const char *path, TextureContent content, const char *owner)
{
    const uint32_t texture = scene_add_texture(draft->scene, path, NULL, content, draft->import->offset);
    if (texture == 0)
        draft_warn(draft, "%s: too many images in one scene: %s", owner, texture_fallback(content));
    return texture;
}

uint32_t draft_add_texture(MeshDraft *draft, const char *path, TextureContent content, const char *owner)
{
    scene_file_named(draft->import->options, path);
    const char *obstacle = file_obstacle(path);
    if (!obstacle && image_is_known(path)) return texture_add(draft, path, content, owner);
    draft_warn(draft, "%s: cannot read '%.100s': %s: %s", owner, path,
               obstacle ? obstacle : "not a PNG, JPEG, PPM or EXR", texture_fallback(content));
    return 0;
}

uint32_t draft_add_embedded_texture(MeshDraft *draft, const Source *bytes, TextureContent content,
                                    const char *owner)
{
    if (!image_bytes_are_known(bytes->bytes, bytes->length)) {
        draft_warn(draft, "%s: not a PNG, JPEG, PPM or EXR: %s", owner, texture_fallback(content));
        return 0;
    }
    char *path = text_format("%s: %s", draft->import->path, owner);
    const uint32_t texture = texture_add(draft, path, content, owner);
    free(path);
    Text *copy = texture > 0 ? &draft->scene->textures.items[texture - 1].bytes : NULL;
    if (copy && copy->count == 0) text_append(copy, bytes->bytes, bytes->length);
    return texture;
}

bool draft_end_face(MeshDraft *draft, size_t offset)
{
    const size_t first = draft->face_start, count = draft->corners[DRAFT_POSITION].count - first;
    if (count > DRAFT_POLYGON_MAX)
        return draft_fails(draft, offset, "a face of %zu corners; %d is the most", count, DRAFT_POLYGON_MAX);
    if (count < 3) {
        if (count > 0 && !draft->has_short_faces)
            draft_warn(draft, "faces of one or two corners are not shown");
        draft->has_short_faces |= count > 0;
        for (int part = 0; part < DRAFT_PART_COUNT; part++)
            if (draft->corners[part].count > first) draft->corners[part].count = first;
        return true;
    }
    if (count > 3) array_push(draft->polygons, ((DraftPolygon){first, count}));
    draft->face_start += count;
    return true;
}

void draft_free(MeshDraft *draft)
{
    free(draft->positions.items);
    free(draft->normals.items);
    free(draft->uvs.items);
    for (int part = 0; part < DRAFT_PART_COUNT; part++)
        free(draft->corners[part].items);
    free(draft->polygons.items);
    free(draft->materials.items);
    free(draft->unread.items);
}
