#include "host/import/load.h"

#include "host/base/array.h"
#include "host/base/file.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/import/mesh/mesh_import.h"
#include "host/import/textures.h"
#include <ctype.h>
#include <string.h>
#include <strings.h>

void scene_file_named(const SceneOptions *options, const char *path)
{
    if (options && options->file_named) options->file_named(options->context, path);
}

bool scene_finish(Scene *scene, Report *report, const SceneOptions *options)
{
    if (report->error_count == 0) textures_decode(scene, report, options);
    if (!report_close(report)) {
        scene_free(scene);
        return false;
    }
    if (!scene->objects.count)
        message_add_at(report->messages, MESSAGE_WARNING, report->source, MESSAGE_WHOLE_FILE,
                       "the scene has no objects, so only the background is shown");
    if (!scene->lights.count)
        message_add_at(report->messages, MESSAGE_WARNING, report->source, MESSAGE_WHOLE_FILE,
                       "the scene has no lights, so only ambient light and emission are shown");
    return true;
}

static bool ends_with(const char *path, const char *ending)
{
    size_t length = strlen(path), ending_length = strlen(ending);
    return length > ending_length && !strcasecmp(path + length - ending_length, ending);
}

bool scene_is_yaml(const char *path)
{
    return strcmp(path, "-") == 0 || ends_with(path, ".yaml") || ends_with(path, ".yml") ||
           ends_with(path, ".json");
}

static bool scene_read(Scene *scene, const Source *source, const SceneOptions *options, MessageList *messages)
{
    if (ends_with(source->file, ".rt")) return scene_read_rt(scene, source, options, messages);
    if (ends_with(source->file, ".cfg")) return scene_read_cfg(scene, source, messages);
    if (ends_with(source->file, ".nff")) return scene_read_nff(scene, source, messages);
    if (scene_is_yaml(source->file)) return scene_read_yaml(scene, source, options, messages);
    return scene_read_dat(scene, source, options, messages);
}

// Returns whether the first word after comments begins a Tachyon scene, whose file may have any name.
static bool begins_dat(const char *path)
{
    static const char begin[] = "begin_scene";
    char text[1 << 14];
    FILE *file = file_obstacle(path) ? NULL : fopen(path, "rbe");
    const size_t length = file ? fread(text, 1, sizeof text, file) : 0;
    if (file) fclose(file);
    size_t at = 0;
    for (bool is_comment = false; at < length; at++) {
        is_comment = text[at] == '#' || (is_comment && text[at] != '\n' && text[at] != '\r');
        if (!is_comment && !isspace((unsigned char)text[at])) break;
    }
    return length - at >= strlen(begin) && strncasecmp(text + at, begin, strlen(begin)) == 0;
}

static bool has_scene_ending(const char *path)
{
    static const char *const endings[] = {".rt", ".cfg", ".nff", ".dat"};
    bool is_known = scene_is_yaml(path);
    for (size_t i = 0; i < COUNT_OF(endings); i++)
        is_known |= ends_with(path, endings[i]);
    return is_known;
}

bool scene_is_known(const char *path)
{
    return has_scene_ending(path) || mesh_is_known(path);
}

static bool file_load(Scene *scene, const char *path, const SceneOptions *options, MessageList *messages)
{
    *scene = (Scene){0};
    const bool is_known = has_scene_ending(path);
    if (options->override_count > 0 && !scene_is_yaml(path))
        return message_error(messages,
                             "%s: only values of YAML scenes (.yaml, .yml or .json) can be replaced", path);
    if (!is_known && mesh_is_known(path)) return scene_read_mesh(scene, path, options, messages);
    if (!is_known && !begins_dat(path))
        return message_error(messages,
                             "%s: the name of a scene must end in .yaml, .yml, .json, .rt, .cfg, .nff, "
                             ".dat or the ending of a mesh, such as .obj, .ply, .stl, .gltf, .glb, .fbx or "
                             ".dae",
                             path);
    OwnedText text = {0};
    stage_begin(options->stage, "reading", path, 0);
    if (!text_read_file(&text, path, messages)) return false;
    const Source source = {.file = path, .bytes = text_c(&text), .length = text.count};
    if (!scene_read(scene, &source, options, messages)) return false;
    scene->text_hash = hash_bytes(HASH_START, text.items, text.count); // a pipe is not read again
    for (size_t i = 0; i < scene->included.count; i++)
        scene->text_hash = hash_bytes(scene->text_hash, &scene->included.items[i].hash, sizeof(uint64_t));
    for (const Source *set = scene->overrides; set; set = set->next)
        scene->text_hash = hash_bytes(scene->text_hash, set->bytes, set->length + 1);
    if (scene->animation.has_keys)
        scene->text_hash = hash_bytes(scene->text_hash, &options->frame, sizeof options->frame);
    return true;
}

// Replaces the camera with that of another scene, whose file counts as included. Drops that scene's
// warnings, nearly all of which concern content that is not rendered.
static bool camera_load(Scene *scene, const SceneOptions *options, MessageList *messages)
{
    for (size_t i = 0; i < options->override_count; i++)
        if (strncmp(options->overrides[i], "camera", 6) == 0 && strchr(".[=", options->overrides[i][6]))
            return message_error(messages, "%s %s cannot change the camera, which is that of '%s'",
                                 options->override_name, options->overrides[i], options->camera);
    SceneOptions camera_options = *options;
    camera_options.camera = NULL;
    camera_options.override_count = 0;
    scene_file_named(options, options->camera);
    OwnedScene other = {0};
    OwnedMessageList found = {0};
    if (!file_load(&other, options->camera, &camera_options, &found)) {
        message_list_move(messages, &found);
        return false;
    }
    scene->camera = other.camera;
    scene->animation.has_keys |= other.animation.has_keys;
    scene->animation.frame = options->frame;
    if (scene->animation.frame_count == 0) scene->animation.frame_count = other.animation.frame_count;
    if (scene->animation.frame_rate == 0) scene->animation.frame_rate = other.animation.frame_rate;
    if (!scene->animation.has_shutter) scene->animation.shutter = other.animation.shutter;
    scene->text_hash = hash_bytes(scene->text_hash, &other.text_hash, sizeof other.text_hash);
    const IncludedFile file = {memory_copy_text(options->camera), other.text_hash};
    array_push(scene->included, file);
    return true;
}

bool scene_load(Scene *scene, const char *path, const SceneOptions *options, MessageList *messages)
{
    if (!file_load(scene, path, options, messages)) return false;
    if (!options->camera || camera_load(scene, options, messages)) return true;
    scene_free(scene);
    return false;
}
