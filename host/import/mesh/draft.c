#include "host/import/mesh/draft.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/image/image.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

const char *const draft_part_names[DRAFT_PART_COUNT] = {
    [DRAFT_POSITION] = "vertex", [DRAFT_UV] = "texture coordinate", [DRAFT_NORMAL] = "normal"};

const char draft_animations[] = "animations are not played; nodes keep their pose in the file",
           draft_skins[] = "skins are ignored; the mesh keeps its shape at its node",
           draft_morphs[] = "morph targets are ignored; the mesh keeps its shape",
           draft_colors[] = "vertex colors are ignored; the material's color is used",
           draft_view[] = "cameras and lights of a mesh are ignored; those of the scene are used",
           draft_cameras[] = "only the first camera is used",
           draft_no_uvs[] = "the mesh has no coordinates for its texture; the material's color is used";

static void draft_report(const MeshDraft *draft, MessageSeverity severity, const char *text)
{
    const MeshImport *import = draft->import;
    const bool is_scene = import->offset == MESSAGE_WHOLE_FILE; // whose path the report adds
    if (!report_repeats(import->report, severity, import->path, 0, text))
        report_message(import->report, severity, import->offset, "%s%s%s", is_scene ? "" : import->path,
                       is_scene ? "" : ": ", text);
}

bool draft_refuse(MeshDraft *draft, const char *format, ...)
{
    OWNED char *text = NULL;
    ARGUMENTS_FORMAT(text, format);
    draft_report(draft, MESSAGE_ERROR, text);
    return false;
}

bool draft_refuse_vertices(MeshDraft *draft)
{
    return draft_refuse(draft, "the mesh has too many vertices; at most %u are supported",
                        DRAFT_VERTICES_MAX);
}

void draft_warn(MeshDraft *draft, const char *format, ...)
{
    OWNED char *text = NULL;
    ARGUMENTS_FORMAT(text, format);
    draft_report(draft, MESSAGE_WARNING, text);
}

bool draft_fails(MeshDraft *draft, size_t offset, const char *format, ...)
{
    OWNED char *text = NULL;
    ARGUMENTS_FORMAT(text, format);
    return draft->places == DRAFT_NO_PLACES ? draft_refuse(draft, "%s", text)
           : draft->places == DRAFT_BYTES   ? draft_refuse(draft, "byte %zu: %s", offset, text)
                                            : report_error(&draft->report, offset, "%s", text);
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
                       "a face names %s %zu (counted from %zu), but the file has only %zu; it is ignored",
                       draft_part_names[part], needed->index - 1 + draft->first_index, draft->first_index,
                       count);
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
    OWNED char *given = text_format("%.*s", (int)length, name);
    for (char *at = given; *at; at++)
        if (*at == '\\') *at = '/';
    OWNED char *path = text_format("%.*s%s", is_absolute(given) ? 0 : folder_length, from, given);
    OWNED char *near = text_format("%.*s%s", folder_length, from, file_base_name(given));
    *is_moved = file_obstacle(path) && !file_obstacle(near);
    return memory_release(*is_moved ? &near : &path);
}

const char *texture_fallback(TextureContent content)
{
    return content == TEXTURE_COLORS    ? "the material's color is used"
           : content == TEXTURE_OPACITY ? "nothing is cut out"
                                        : "normals are not tilted";
}

char *texture_obstacle(const char *path, TextureContent content)
{
    const char *obstacle = file_obstacle(path), *fallback = texture_fallback(content);
    return obstacle ? text_format("cannot read '%.100s': %s; %s", path, obstacle, fallback)
           : image_is_known(path)
               ? NULL
               : text_format("'%.100s' is not a PNG, JPEG, PPM or EXR; %s", path, fallback);
}

uint32_t draft_add_checked_texture(MeshDraft *draft, const char *path, TextureContent content,
                                   const char *owner)
{
    const uint32_t texture = scene_add_texture(draft->scene, path, NULL, content, draft->import->offset);
    if (texture == 0)
        draft_warn(draft, "%s: a scene may have at most %d images; %s", owner, SCENE_TEXTURES_MAX,
                   texture_fallback(content));
    return texture;
}

uint32_t draft_add_texture(MeshDraft *draft, const char *path, TextureContent content, const char *owner)
{
    scene_file_named(draft->import->options, path);
    OWNED char *obstacle = texture_obstacle(path, content);
    if (!obstacle) return draft_add_checked_texture(draft, path, content, owner);
    draft_warn(draft, "%s: %s", owner, obstacle);
    return 0;
}

uint32_t draft_add_embedded_texture(MeshDraft *draft, const Source *bytes, TextureContent content,
                                    const char *owner)
{
    if (!image_bytes_are_known(bytes->bytes, bytes->length)) {
        draft_warn(draft, "%s: the image is not a PNG, JPEG, PPM or EXR; %s", owner,
                   texture_fallback(content));
        return 0;
    }
    OWNED char *path = text_format("%s: %s", draft->import->path, owner);
    const uint32_t texture = draft_add_checked_texture(draft, path, content, owner);
    Text *copy = texture > 0 ? &draft->scene->textures.items[texture - 1].bytes : NULL;
    if (copy && copy->count == 0) text_append(copy, bytes->bytes, bytes->length);
    return texture;
}

bool draft_end_face(MeshDraft *draft, size_t offset)
{
    const size_t first = draft->face_start, count = draft->corners[DRAFT_POSITION].count - first;
    if (count > DRAFT_POLYGON_MAX)
        return draft_fails(draft, offset, "a face has %zu corners; at most %d are supported", count,
                           DRAFT_POLYGON_MAX);
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
