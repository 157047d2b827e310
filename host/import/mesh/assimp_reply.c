// Writes and reads the reply of a process that reads a mesh. It has a header, arrays, and a mark at the end.
#include "host/base/array.h"
#include "host/import/mesh/assimp_process.h"
#include "host/import/number.h"

#include <stdlib.h>
#include <string.h>

enum { MESSAGES_MAX = 64, MATERIALS_MAX = 1 << 20, LIGHTS_MAX = 1 << 16 };

static const char magic[8] = "glntmsh";

typedef struct {
    uint64_t is_error;
    char text[512];
} ReplyMessage;

// A texture in a file, or one whose bytes are embedded in the mesh's.
typedef struct {
    char path[1024];
    uint64_t byte_count; // 0 for a file
} ReplyTexture;

// A material, whose image is 1 + the index of a texture of the reply.
typedef struct {
    Material look;
    char name[64];
} ReplyMaterial;

// The arrays of a reply that are not the draft's.
typedef struct {
    ARRAY_OF(ReplyMessage) messages;
    ARRAY_OF(ReplyTexture) textures;
    Text texture_bytes; // of all embedded textures, in order
    ARRAY_OF(ReplyMaterial) materials;
    ARRAY_OF(Light) lights;
} ReplyLists;

enum { LIST_COUNT = 5, ARRAY_COUNT = LIST_COUNT + 6 };

typedef struct {
    char magic[8];
    uint64_t is_read, has_normals, has_uvs, has_camera;
    uint64_t warning_count; // including those beyond the limit, which are not sent
    Camera camera;
    uint64_t counts[ARRAY_COUNT];
} ReplyHeader;

typedef struct {
    void **items;
    size_t *count, *capacity, size;
    uint64_t most;
} ReplyArray;

typedef struct {
    ReplyArray items[ARRAY_COUNT];
} ReplyArrays;

#define REPLY_ARRAY(array, most)                                                                             \
    {                                                                                                        \
        (void **)&(array).items, &(array).count, &(array).capacity, sizeof *(array).items, most              \
    }

// Returns the lists and then the draft's arrays.
static ReplyArrays arrays_of(MeshDraft *draft, ReplyLists *lists)
{
    return (ReplyArrays){
        {REPLY_ARRAY(lists->messages, MESSAGES_MAX), REPLY_ARRAY(lists->textures, SCENE_TEXTURES_MAX),
         REPLY_ARRAY(lists->texture_bytes, SIZE_MAX), REPLY_ARRAY(lists->materials, MATERIALS_MAX),
         REPLY_ARRAY(lists->lights, LIGHTS_MAX), REPLY_ARRAY(draft->positions, SIZE_MAX),
         REPLY_ARRAY(draft->normals, SIZE_MAX), REPLY_ARRAY(draft->uvs, SIZE_MAX),
         REPLY_ARRAY(draft->corners[DRAFT_POSITION], SIZE_MAX), REPLY_ARRAY(draft->polygons, SIZE_MAX),
         REPLY_ARRAY(draft->materials, SIZE_MAX)}};
}

static void lists_free(ReplyLists *lists)
{
    free(lists->messages.items);
    free(lists->textures.items);
    text_free(&lists->texture_bytes);
    free(lists->materials.items);
    free(lists->lights.items);
}

static ReplyLists lists_of(const MeshDraft *draft)
{
    ReplyLists lists = {0};
    const Scene *scene = draft->scene;
    const MessageList *messages = draft->import->report->messages;
    const MeshView *view = draft->import->view;
    for (size_t i = 0; i < messages->count; i++) {
        ReplyMessage message = {.is_error = messages->items[i].severity == MESSAGE_ERROR};
        snprintf(message.text, sizeof message.text, "%s", messages->items[i].text);
        array_push(lists.messages, message);
    }
    for (size_t i = 0; i < scene->textures.count; i++) {
        const SceneTexture *from = &scene->textures.items[i];
        ReplyTexture texture = {.byte_count = from->bytes.count};
        snprintf(texture.path, sizeof texture.path, "%s", from->path);
        array_push(lists.textures, texture);
        text_append(&lists.texture_bytes, text_c(&from->bytes), from->bytes.count);
    }
    for (size_t i = 0; i < scene->materials.count; i++) {
        ReplyMaterial material = {.look = scene->materials.items[i]};
        snprintf(material.name, sizeof material.name, "%s", scene->material_names.items[i]);
        array_push(lists.materials, material);
    }
    for (size_t i = 0; view && i < view->lights.count; i++)
        array_push(lists.lights, view->lights.items[i]);
    return lists;
}

void assimp_reply_write(MeshDraft *draft, FILE *reply, bool is_read)
{
    ReplyHeader header = {.is_read = is_read,
                          .has_normals = draft->is_shared[DRAFT_NORMAL],
                          .has_uvs = draft->is_shared[DRAFT_UV],
                          .warning_count = draft->import->report->warning_count};
    ReplyLists lists = lists_of(draft);
    const ReplyArrays arrays = arrays_of(draft, &lists);
    const MeshView *view = draft->import->view;
    if (view) header.has_camera = view->has_camera;
    if (view) header.camera = view->camera;
    memcpy(header.magic, magic, sizeof magic);
    for (size_t i = 0; i < ARRAY_COUNT; i++)
        header.counts[i] = i < LIST_COUNT || is_read ? *arrays.items[i].count : 0;
    fwrite(&header, sizeof header, 1, reply);
    for (size_t i = 0; i < ARRAY_COUNT; i++)
        if (header.counts[i] > 0)
            fwrite(*arrays.items[i].items, arrays.items[i].size, *arrays.items[i].count, reply);
    fwrite(magic, sizeof magic, 1, reply);
    lists_free(&lists);
}

// Reads the arrays. Memory grows only with the bytes that arrive.
static bool arrays_read(const ReplyArrays *arrays, FILE *reply, const uint64_t counts[ARRAY_COUNT])
{
    enum { CHUNK = 1 << 16 };
    for (size_t i = 0; i < ARRAY_COUNT; i++) {
        const ReplyArray *array = &arrays->items[i];
        if (counts[i] > array->most) return false;
        while (*array->count < counts[i]) {
            const uint64_t left = counts[i] - *array->count;
            const size_t count = left < CHUNK ? (size_t)left : CHUNK;
            if (*array->count + count > *array->capacity)
                *array->items =
                    array_grow(*array->items, array->capacity, *array->count + count, array->size);
            if (fread((char *)*array->items + *array->count * array->size, array->size, count, reply) !=
                count)
                return false;
            *array->count += count;
        }
    }
    return true;
}

// Reads the header and the arrays. Returns false if the reply is incomplete.
static bool mesh_reply_read(MeshDraft *draft, FILE *reply, ReplyHeader *header, ReplyLists *lists)
{
    char end[sizeof magic];
    const ReplyArrays arrays = arrays_of(draft, lists);
    return fread(header, sizeof *header, 1, reply) == 1 && memcmp(header->magic, magic, sizeof magic) == 0 &&
           arrays_read(&arrays, reply, header->counts) && fread(end, sizeof end, 1, reply) == 1 &&
           memcmp(end, magic, sizeof magic) == 0;
}

static void messages_add(MeshDraft *draft, const ReplyLists *lists, uint64_t warning_count)
{
    Report *report = draft->import->report;
    size_t received_count = 0;
    for (size_t i = 0; i < lists->messages.count; i++) {
        ReplyMessage *message = &lists->messages.items[i];
        message->text[sizeof message->text - 1] = '\0';
        received_count += !message->is_error;
        if (message->is_error)
            draft_refuse(draft, "%s", message->text);
        else
            draft_warn(draft, "%s", message->text);
    }
    if (warning_count > received_count &&
        !report_repeats(report, MESSAGE_WARNING, draft->import->path, 0, ""))
        report->warning_count += (size_t)warning_count - received_count;
}

// Sets `textures` to the scene's index of each texture. Returns false if their bytes are not those of the
// reply.
static bool textures_add(MeshDraft *draft, const ReplyLists *lists, uint32_t textures[SCENE_TEXTURES_MAX])
{
    const Text *all = &lists->texture_bytes;
    size_t at = 0;
    for (size_t i = 0; i < lists->textures.count; i++) {
        ReplyTexture *from = &lists->textures.items[i];
        if (from->byte_count > all->count - at) return false;
        const Source bytes = {.bytes = text_c(all) + at, .length = (size_t)from->byte_count};
        char owner[32];
        snprintf(owner, sizeof owner, "image %u", (unsigned)i);
        from->path[sizeof from->path - 1] = '\0';
        textures[i] = bytes.length > 0 ? draft_add_embedded_texture(draft, &bytes, TEXTURE_COLORS, owner)
                                       : draft_add_texture(draft, from->path, TEXTURE_COLORS, owner);
        at += bytes.length;
    }
    return at == all->count;
}

// Copies the members of a material that assimp_read sets. Returns false if one is out of range.
static bool material_copy(const Material *from, const uint32_t *textures, size_t texture_count,
                          Material *material)
{
    const uint32_t texture = from->image.texture;
    if (!numbers_are_sound(from->color) || !numbers_are_sound(from->diffuse) ||
        !numbers_are_sound(from->emission) || !number_is_sound(from->ambient) ||
        !number_is_sound(from->specular.largest) || !number_is_sound(from->shininess) ||
        !range_holds(&range_unit, from->transmission.largest) ||
        !(from->ior > 0 && from->ior <= NUMBER_MAX) || texture > texture_count ||
        from->image.wraps[0] > TEXTURE_MIRRORED || from->image.wraps[1] > TEXTURE_MIRRORED)
        return false;
    *material = material_default();
    material->color = from->color;
    material->ambient = from->ambient;
    material->diffuse = from->diffuse;
    material->specular.largest = from->specular.largest;
    material->shininess = from->shininess;
    material->transmission.largest = from->transmission.largest;
    material->emission = from->emission;
    material->ior = from->ior;
    memcpy(material->image.wraps, from->image.wraps, sizeof from->image.wraps);
    material->image.texture = texture > 0 ? textures[texture - 1] : 0;
    return true;
}

static bool materials_add(MeshDraft *draft, const ReplyLists *lists, const uint32_t *textures)
{
    for (size_t i = 0; i < lists->materials.count; i++) {
        ReplyMaterial *from = &lists->materials.items[i];
        Material material;
        if (!material_copy(&from->look, textures, lists->textures.count, &material)) return false;
        from->name[sizeof from->name - 1] = '\0';
        scene_add_material(draft->scene, &material, from->name);
    }
    return true;
}

// Copies the members of the camera and the lights that assimp_read sets, whose values mesh_scene.c checks.
static bool reply_view_add(MeshDraft *draft, const ReplyLists *lists, const ReplyHeader *header)
{
    MeshView *view = draft->import->view;
    if (!view) return lists->lights.count == 0 && !header->has_camera;
    for (size_t i = 0; i < lists->lights.count; i++)
        array_push(view->lights, lists->lights.items[i]);
    for (size_t i = 0; i < view->lights.count; i++)
        memset(&view->lights.items[i].area, 0, sizeof view->lights.items[i].area);
    if (header->has_camera) {
        const Camera *from = &header->camera;
        view->has_camera = true;
        view->camera = (Camera){.position = from->position,
                                .look_at = from->look_at,
                                .up = from->up,
                                .field_axis = from->field_axis,
                                .half_tangent = from->half_tangent,
                                .frame_aspect = from->frame_aspect};
    }
    return true;
}

// Returns whether the polygons are in order, within the corners, and separated by whole triangles.
static bool polygons_are_sound(const MeshDraft *draft)
{
    const size_t corner_count = draft->corners[DRAFT_POSITION].count;
    size_t at = 0;
    for (size_t i = 0; i < draft->polygons.count; i++) {
        const DraftPolygon *polygon = &draft->polygons.items[i];
        if (polygon->first_corner < at || polygon->first_corner > corner_count ||
            (polygon->first_corner - at) % 3 > 0 || polygon->corner_count < 4 ||
            polygon->corner_count > DRAFT_POLYGON_MAX ||
            polygon->corner_count > corner_count - polygon->first_corner)
            return false;
        at = polygon->first_corner + polygon->corner_count;
    }
    return (corner_count - at) % 3 == 0;
}

static bool runs_are_sound(MeshDraft *draft, size_t material_count)
{
    const uint32_t first_material = (uint32_t)(draft->scene->materials.count - material_count);
    size_t at = 0;
    for (size_t i = 0; i < draft->materials.count; i++) {
        DraftMaterialRun *run = &draft->materials.items[i];
        if ((i == 0 && run->first_corner > 0) || run->first_corner < at ||
            run->first_corner > draft->corners[DRAFT_POSITION].count || run->material >= material_count)
            return false;
        at = run->first_corner;
        run->material += first_material;
    }
    return true;
}

static bool draft_is_sound(MeshDraft *draft, const ReplyHeader *header, size_t material_count)
{
    const size_t position_count = draft->positions.count;
    if (position_count >= DRAFT_NONE || draft->normals.count != (header->has_normals ? position_count : 0) ||
        draft->uvs.count != (header->has_uvs ? position_count : 0))
        return false;
    draft->is_shared[DRAFT_NORMAL] = header->has_normals != 0;
    draft->is_shared[DRAFT_UV] = header->has_uvs != 0;
    const DraftIndices *corners = &draft->corners[DRAFT_POSITION];
    for (size_t i = 0; i < corners->count; i++)
        if (corners->items[i] >= position_count) return false;
    return polygons_are_sound(draft) && runs_are_sound(draft, material_count);
}

bool assimp_reply_read(MeshDraft *draft, FILE *reply, bool *read)
{
    ReplyHeader header;
    ReplyLists lists = {0};
    uint32_t textures[SCENE_TEXTURES_MAX];
    bool is_sound = mesh_reply_read(draft, reply, &header, &lists) && header.warning_count <= UINT32_MAX;
    if (is_sound) messages_add(draft, &lists, header.warning_count);
    is_sound = is_sound && textures_add(draft, &lists, textures) && materials_add(draft, &lists, textures) &&
               reply_view_add(draft, &lists, &header) &&
               draft_is_sound(draft, &header, lists.materials.count);
    lists_free(&lists);
    if (is_sound) *read = header.is_read != 0;
    return is_sound;
}
