// Reads the JSON text of glTF and its values, and warns of features that are not shown.
#include "host/import/mesh/gltf.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/import/number.h"

#include <stdlib.h>
#include <string.h>

// A JSON text's numbers take about 20 times its bytes in memory.
enum { JSON_BYTES_MAX = 1 << 28 };

static const char *const extensions_read[] = {
    "KHR_lights_punctual",   "KHR_materials_emissive_strength", "KHR_materials_ior",
    "KHR_materials_unlit",   "KHR_materials_transmission",      "KHR_materials_volume",
    "KHR_mesh_quantization", "KHR_texture_transform",
};

bool gltf_fails(Gltf *gltf, const GltfItem *item, const char *format, ...)
{
    if (item->is_wrong) return false;
    OWNED char *text = NULL;
    ARGUMENTS_FORMAT(text, format);
    gltf->has_failed |= !gltf->is_optional;
    if (gltf->is_optional)
        draft_warn(gltf->draft, "%s %s; it is ignored", item->path, text);
    else
        draft_refuse(gltf->draft, "%s %s", item->path, text);
    return false;
}

void gltf_warn(Gltf *gltf, const GltfItem *item, const char *format, ...)
{
    OWNED char *text = NULL;
    ARGUMENTS_FORMAT(text, format);
    draft_warn(gltf->draft, "%s %s", item->path, text);
}

void gltf_warn_once(Gltf *gltf, const GltfItem *item, const char *text)
{
    if (!report_repeats(&gltf->draft->report, MESSAGE_WARNING, NULL, 0, text))
        draft_warn(gltf->draft, "%s: %s", item->path, text);
}

// Returns the JSON value, or NULL for null, which some writers have in place of a missing value.
static const json_t *json_not_null(const json_t *json)
{
    return json_is_null(json) ? NULL : json;
}

GltfItem gltf_member(const GltfItem *item, const char *key)
{
    GltfItem member = {.json = json_not_null(json_object_get(item->json, key)), .is_wrong = item->is_wrong};
    const int length =
        snprintf(member.path, sizeof member.path, "%s%s", item->path, item->path[0] ? "." : "");
    if (length < (int)sizeof member.path)
        snprintf(member.path + length, sizeof member.path - (size_t)length, "%s", key);
    return member;
}

static GltfItem gltf_any_element(const GltfItem *item, size_t index)
{
    GltfItem element = {.json = json_not_null(json_array_get(item->json, index)), .is_wrong = item->is_wrong};
    const int length = snprintf(element.path, sizeof element.path, "%s", item->path);
    if (length < (int)sizeof element.path)
        snprintf(element.path + length, sizeof element.path - (size_t)length, "[%zu]", index);
    return element;
}

// Returns the item. Reports one of another type and returns it as missing.
static GltfItem item_of_type(Gltf *gltf, GltfItem item, json_type type)
{
    static const char *const names[] = {
        [JSON_OBJECT] = "an object", [JSON_ARRAY] = "an array", [JSON_STRING] = "a string"};
    if (item.json && json_typeof(item.json) != type) {
        gltf_fails(gltf, &item, "must be %s", names[type]);
        item.json = NULL;
        item.is_wrong = true;
    }
    return item;
}

GltfItem gltf_object(Gltf *gltf, const GltfItem *item, const char *key)
{
    return item_of_type(gltf, gltf_member(item, key), JSON_OBJECT);
}

GltfItem gltf_array(Gltf *gltf, const GltfItem *item, const char *key)
{
    return item_of_type(gltf, gltf_member(item, key), JSON_ARRAY);
}

GltfItem gltf_string(Gltf *gltf, const GltfItem *item, const char *key)
{
    return item_of_type(gltf, gltf_member(item, key), JSON_STRING);
}

GltfItem gltf_element(Gltf *gltf, const GltfItem *array, size_t index)
{
    return item_of_type(gltf, gltf_any_element(array, index), JSON_OBJECT);
}

GltfItem gltf_root(const Gltf *gltf)
{
    return (GltfItem){.json = gltf->root};
}

static GltfItem gltf_root_array(Gltf *gltf, const char *key)
{
    const GltfItem root = gltf_root(gltf);
    return gltf_array(gltf, &root, key);
}

GltfItem gltf_entry(Gltf *gltf, const char *array, size_t index)
{
    const GltfItem entries = gltf_root_array(gltf, array);
    return gltf_element(gltf, &entries, index);
}

size_t gltf_count(Gltf *gltf, const char *array)
{
    return json_array_size(gltf_root_array(gltf, array).json);
}

GltfItem gltf_extension(Gltf *gltf, const GltfItem *item, const char *name)
{
    const GltfItem extensions = gltf_object(gltf, item, "extensions");
    return gltf_object(gltf, &extensions, name);
}

// Returns a number or a text as the file has it. The caller frees it.
static char *json_describe(const json_t *json)
{
    const char *const kind = json_is_array(json) ? "an array" : json_is_object(json) ? "an object" : NULL;
    char *text = kind ? NULL : json_dumps(json, JSON_ENCODE_ANY | JSON_REAL_PRECISION(6));
    return text ? text : memory_copy_text(kind ? kind : "nothing");
}

static bool integer_read(Gltf *gltf, const GltfItem *item, size_t low, size_t high, size_t *value)
{
    // writers of floating-point numbers add a fraction of 0
    const double real = json_number_value(item->json);
    const bool is_whole = json_is_integer(item->json) || (fabs(real) <= 0x1p53 && real == floor(real));
    const json_int_t number = json_is_integer(item->json) ? json_integer_value(item->json)
                              : is_whole                  ? (json_int_t)real
                                                          : -1;
    if (!json_is_number(item->json) || number < 0 || (uint64_t)number < low || (uint64_t)number > high) {
        OWNED char *found = json_describe(item->json);
        return gltf_fails(gltf, item, "must be an integer from %zu to %zu, not %.40s", low, high, found);
    }
    *value = (size_t)number;
    return true;
}

static bool index_read(Gltf *gltf, const GltfItem *item, const char *array, size_t *index)
{
    const GltfItem entries = gltf_root_array(gltf, array);
    const size_t count = json_array_size(entries.json);
    size_t found = 0;
    if (count == 0)
        return !entries.is_wrong && gltf_fails(gltf, item, "refers to '%s', which the file lacks", array);
    if (!integer_read(gltf, item, 0, count - 1, &found)) return false;
    if (!gltf_any_element(&entries, found).json)
        return gltf_fails(gltf, item, "refers to %s[%zu], which is null", array, found);
    *index = found;
    return true;
}

bool gltf_integer(Gltf *gltf, const GltfItem *item, const char *key, size_t low, size_t high, size_t *value)
{
    const GltfItem member = gltf_member(item, key);
    return !member.json || integer_read(gltf, &member, low, high, value);
}

bool gltf_index(Gltf *gltf, const GltfItem *item, const char *key, const char *array, size_t *index)
{
    const GltfItem member = gltf_member(item, key);
    return !member.json || index_read(gltf, &member, array, index);
}

bool gltf_element_index(Gltf *gltf, const GltfItem *list, size_t element, const char *array, size_t *index)
{
    const GltfItem item = gltf_any_element(list, element);
    return index_read(gltf, &item, array, index);
}

static bool json_number_is_sound(const json_t *json)
{
    return json_is_number(json) && fabs(json_number_value(json)) <= NUMBER_MAX;
}

bool gltf_numbers(Gltf *gltf, const GltfItem *item, const char *key, size_t count, double *values)
{
    const GltfItem member = gltf_member(item, key);
    if (!member.json) return true;
    bool is_sound = count == 1 || json_array_size(member.json) == count;
    for (size_t i = 0; i < count && is_sound; i++)
        is_sound = json_number_is_sound(count == 1 ? member.json : json_array_get(member.json, i));
    if (!is_sound && count == 1)
        return gltf_fails(gltf, &member, "must be a number of at most %g in magnitude", NUMBER_MAX);
    if (!is_sound)
        return gltf_fails(gltf, &member, "must be %zu numbers of at most %g in magnitude", count, NUMBER_MAX);
    for (size_t i = 0; i < count; i++)
        values[i] = json_number_value(count == 1 ? member.json : json_array_get(member.json, i));
    return true;
}

static bool extension_is_read(const char *name)
{
    for (size_t i = 0; i < COUNT_OF(extensions_read); i++)
        if (strcmp(name, extensions_read[i]) == 0) return true;
    return false;
}

// Lists the extensions that are not read, up to NAMES_BYTES_MAX bytes.
static Text extensions_unread(Gltf *gltf, const GltfItem *list)
{
    enum { NAMES_BYTES_MAX = 200 };
    Text names = {0};
    for (size_t i = 0; i < json_array_size(list->json) && names.count < NAMES_BYTES_MAX; i++) {
        const GltfItem item = item_of_type(gltf, gltf_any_element(list, i), JSON_STRING);
        const char *name = json_string_value(item.json);
        if (name && !extension_is_read(name))
            text_appendf(&names, "%s%.60s", names.count > 0 ? ", " : "", name);
    }
    return names;
}

static bool extensions_check(Gltf *gltf)
{
    const GltfItem required = gltf_root_array(gltf, "extensionsRequired");
    OwnedText needed_names = extensions_unread(gltf, &required);
    if (needed_names.count > 0)
        return gltf_fails(gltf, &required, "has %s, which glint does not support; export the file without it",
                          text_c(&needed_names));
    gltf->is_optional = true;
    const GltfItem used = gltf_root_array(gltf, "extensionsUsed");
    OwnedText used_names = extensions_unread(gltf, &used);
    gltf->is_optional = false;
    if (used_names.count > 0)
        gltf_warn(gltf, &used, "has %s, which glint does not support; what they add is missing",
                  text_c(&used_names));
    return true;
}

static bool asset_check(Gltf *gltf)
{
    const GltfItem root = gltf_root(gltf), asset = gltf_object(gltf, &root, "asset");
    const GltfItem needed =
        gltf_member(&asset, gltf_member(&asset, "minVersion").json ? "minVersion" : "version");
    const char *version = json_string_value(needed.json);
    if (!version) return gltf_fails(gltf, &needed, "is missing; glint reads glTF 2.0");
    return strcmp(version, "2.0") == 0 ||
           (strncmp(version, "2.", 2) == 0 && strcmp(needed.path, "asset.version") == 0) ||
           gltf_fails(gltf, &needed, "is '%.20s'; glint reads glTF 2.0", version);
}

static bool json_text_read(Gltf *gltf, const char *text, size_t length, size_t offset)
{
    json_error_t error;
    if (length > JSON_BYTES_MAX)
        return draft_refuse(gltf->draft, "the JSON text has %zu bytes; at most %d are supported", length,
                            JSON_BYTES_MAX);
    gltf->root = json_loadb(text, length, JSON_REJECT_DUPLICATES, &error);
    // the position is past the faulty word
    const size_t position = error.position > 0 ? (size_t)error.position - 1 : 0;
    if (!gltf->root)
        return draft_fails(gltf->draft, offset + position, "the JSON is malformed: %s", error.text);
    return json_is_object(gltf->root) || draft_fails(gltf->draft, offset, "the JSON text must be an object");
}

// Reads a GLB file, which has a header of 12 bytes and then chunks of a length, a type and bytes. The first
// chunk is JSON and the optional second one BIN.
static bool glb_read(Gltf *gltf, const Source *source)
{
    enum { HEADER_BYTES = 12, CHUNK_BYTES = 8, CHUNK_JSON = 0x4E4F534A, CHUNK_BINARY = 0x004E4942 };
    MeshDraft *draft = gltf->draft;
    draft->places = DRAFT_BYTES;
    if (source->length < HEADER_BYTES + CHUNK_BYTES)
        return draft_refuse(draft, "the file is too short to be a GLB file");
    const uint32_t version = little_endian_at(source->bytes + 4);
    if (version != 2) return draft_fails(draft, 4, "the GLB version is %u; glint reads version 2", version);
    size_t at = HEADER_BYTES;
    for (int i = 0; i < 2 && source->length - at >= CHUNK_BYTES; i++) {
        const size_t length = little_endian_at(source->bytes + at);
        const uint32_t type = little_endian_at(source->bytes + at + 4);
        if (length > source->length - at - CHUNK_BYTES)
            return draft_fails(draft, at, "the file ends within a chunk of %zu bytes", length);
        const char *bytes = source->bytes + at + CHUNK_BYTES;
        if (i == 0 && type != CHUNK_JSON) return draft_fails(draft, at + 4, "the first chunk must be JSON");
        if (i == 0 && !json_text_read(gltf, bytes, length, at + CHUNK_BYTES)) return false;
        if (i == 1 && type == CHUNK_BINARY) gltf->binary = (GltfBuffer){.bytes = bytes, .length = length};
        at += CHUNK_BYTES + length;
    }
    return true;
}

static void gltf_open(Gltf *gltf)
{
    gltf->buffer_count = gltf_count(gltf, "buffers");
    gltf->buffers = memory_allocate_zeroed(gltf->buffer_count, sizeof *gltf->buffers);
    gltf->is_visited = memory_allocate_zeroed(gltf_count(gltf, "nodes"), sizeof *gltf->is_visited);
    gltf->is_optional = true;
    gltf->materials = memory_allocate_zeroed(gltf_count(gltf, "materials") + 1, sizeof *gltf->materials);
    const size_t image_count = gltf_count(gltf, "images");
    gltf->images = memory_allocate(2 * image_count, sizeof *gltf->images);
    memset(gltf->images, 0xff, 2 * image_count * sizeof *gltf->images);
    gltf->is_optional = false;
}

static void gltf_close(Gltf *gltf)
{
    for (size_t i = 0; i < gltf->buffer_count; i++)
        text_free(&gltf->buffers[i].owned);
    free(gltf->buffers);
    free(gltf->materials);
    free(gltf->images);
    free(gltf->is_visited);
    json_decref(gltf->root);
}

bool gltf_read(MeshDraft *draft)
{
    const Source *source = &draft->source;
    Gltf gltf = {.draft = draft};
    const bool is_binary = source->length >= 4 && memcmp(source->bytes, "glTF", 4) == 0;
    const size_t mark = source->length >= 3 && memcmp(source->bytes, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    bool read = is_binary ? glb_read(&gltf, source)
                          : json_text_read(&gltf, source->bytes + mark, source->length - mark, mark);
    if (read) {
        gltf_open(&gltf);
        const GltfItem root = gltf_root(&gltf), animations = gltf_member(&root, "animations");
        if (animations.json) gltf_warn_once(&gltf, &animations, draft_animations);
        read = asset_check(&gltf) && extensions_check(&gltf) && gltf_scene_read(&gltf) && !gltf.has_failed;
    }
    draft->places = DRAFT_NO_PLACES;
    gltf_close(&gltf);
    return read;
}
