#include "host/view/camera_file.h"

#include "host/import/yaml/animation.h"
#include "host/import/yaml/yaml.h"
#include "host/view/camera_yaml.h"
#include <string.h>

typedef struct {
    YamlReader reader;
    Scene scene; // its camera alone
    const YamlNode *camera;
} CameraFile;

static void camera_file_free(CameraFile *file)
{
    yaml_tree_free(&file->reader.tree);
    scene_free(&file->scene);
}

// Reports an error and returns false if a value of the camera has keys.
static bool camera_is_constant(CameraFile *file)
{
    YamlReader *reader = &file->reader;
    const YamlNode *key = file->camera->kind == YAML_MAPPING ? yaml_first(&reader->tree, file->camera) : NULL;
    for (const YamlNode *value; key; key = yaml_next(&reader->tree, value)) {
        value = yaml_next(&reader->tree, key);
        if (yaml_has_keys(reader, value))
            return report_error(&reader->report, value->offset,
                                "the camera cannot be written: it is animated");
    }
    return true;
}

static bool camera_file_read(CameraFile *file, const Source *source, MessageList *messages)
{
    *file = (CameraFile){.reader.report = report_open(source, messages)};
    YamlReader *reader = &file->reader;
    reader->scene = &file->scene;
    if (yaml_tree_read(&reader->tree, &reader->report, 0, NULL)) {
        const YamlNode *root = reader->tree.nodes.items;
        file->camera = root->kind == YAML_MAPPING ? field_node(reader, root, "camera") : root;
        const YamlNode *include = root->kind == YAML_MAPPING ? field_node(reader, root, "include") : root;
        if (file->camera == root && include != root)
            report_error(&reader->report, include->offset,
                         "the camera cannot be written: it is in an included file");
        else if (file->camera == root)
            report_error(&reader->report, root->offset, "the scene has no camera");
        else if (camera_is_constant(file))
            yaml_read_camera(reader, file->camera);
    }
    if (report_close(&reader->report)) return true;
    camera_file_free(file);
    return false;
}

// A copy of the source with some values replaced. The source is copied up to `next`.
typedef struct {
    const Source *source;
    size_t next;
    Text *text;
} Copy;

static void copy_until(Copy *copy, size_t offset)
{
    text_append(copy->text, copy->source->bytes + copy->next, offset - copy->next);
    copy->next = offset;
}

// Spaces in front of a place where a key starts; other bytes, such as those of `camera: {`, count as spaces.
static size_t indentation(const Source *source, size_t offset)
{
    size_t start = offset;
    while (start > 0 && source->bytes[start - 1] != '\n')
        start--;
    return offset - start;
}

static void up_insert(Copy *copy, const CameraFile *file, const YamlNode *key, Vector3 up)
{
    const char *before = copy->source->bytes + key->offset - 1; // a quoted key's offset is behind its quote
    const bool is_quoted = *before == '"' || *before == '\'';
    const size_t offset = key->offset - is_quoted;
    copy_until(copy, offset);
    text_appendf(copy->text, is_quoted ? "\"up\": " : "up: ");
    vector_write_yaml(copy->text, up);
    if (copy->source->bytes[file->camera->offset] == '{')
        text_appendf(copy->text, ", ");
    else
        text_appendf(copy->text, "\n%*s", (int)indentation(copy->source, offset), "");
}

// Writes the new value of a key. Returns false if it has not changed. Where the camera turned, the new
// position has turned.
static bool value_write(Text *text, const char *key, const Camera *old, const Camera *camera, bool has_turn)
{
    const bool is_moved = !vectors_equal(old->position, camera->position) ||
                          !vectors_equal(old->look_at, camera->look_at) ||
                          !vectors_equal(old->up, camera->up);
    const struct {
        const char *name;
        Vector3 old, new;
    } members[] = {{"position", old->position, camera->position},
                   {"look_at", old->look_at, camera->look_at},
                   {"up", old->up, camera->up}};
    for (size_t i = 0; i < sizeof members / sizeof *members; i++)
        if (strcmp(key, members[i].name) == 0) {
            if (vectors_equal(members[i].old, members[i].new) && !(i == 0 && is_moved && has_turn))
                return false;
            vector_write_yaml(text, members[i].new);
            return true;
        }
    if (is_moved && strcmp(key, "turn") == 0) {
        number_write_yaml(text, 0);
        return true;
    }
    if (strcmp(key, "height") != 0 || old->half_tangent == camera->half_tangent) return false;
    number_write_yaml(text, 2 * camera->half_tangent);
    return true;
}

static bool values_replace(Copy *copy, CameraFile *file, const Camera *camera)
{
    YamlReader *reader = &file->reader;
    if (camera->lens_radius > 0 && camera_focal_distance(camera) == 0)
        return report_error(&reader->report, file->camera->offset,
                            "the camera cannot be written: 'focus' lies behind it");
    const Camera *old = &file->scene.camera;
    const bool has_up = field_node(reader, file->camera, "up") != file->camera;
    const bool has_turn = field_node(reader, file->camera, "turn") != file->camera;
    bool lacks_up = !has_up && !vectors_equal(old->up, camera->up);
    for (const YamlNode *key = yaml_first(&reader->tree, file->camera), *value; key;
         key = yaml_next(&reader->tree, value)) {
        value = yaml_next(&reader->tree, key);
        if (key->offset < copy->next || value->offset < key->offset)
            return report_error(&reader->report, key->offset,
                                "the camera cannot be written: it has an alias");
        if (lacks_up) up_insert(copy, file, key, camera->up);
        lacks_up = false;
        Text written = {0};
        if (!value_write(&written, yaml_text(&reader->tree, key), old, camera, has_turn)) continue;
        copy_until(copy, value->offset);
        text_append(copy->text, written.items, written.count);
        text_free(&written);
        copy->next = value->end;
    }
    copy_until(copy, copy->source->length);
    return true;
}

bool camera_replace(Text *text, const Source *source, const Camera *camera, MessageList *messages)
{
    *text = (Text){0};
    CameraFile file;
    if (!camera_file_read(&file, source, messages)) return false;
    Copy copy = {.source = source, .text = text};
    bool replaced = values_replace(&copy, &file, camera);
    report_close(&file.reader.report);
    camera_file_free(&file);
    if (!replaced) text_free(text);
    return replaced;
}
