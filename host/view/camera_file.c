#include "host/view/camera_file.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/yaml/yaml.h"
#include "host/view/camera_yaml.h"
#include <string.h>

typedef struct {
    YamlReader reader;
    Scene scene; // only its camera is used
    const YamlNode *camera;
} CameraFile;

static void camera_file_free(CameraFile *file)
{
    yaml_tree_free(&file->reader.tree);
    scene_free(&file->scene);
}

static bool is_zero(const YamlReader *reader, const YamlNode *node)
{
    double number = 1;
    const char *text = yaml_text(&reader->tree, node);
    return number_read(text, strlen(text), &number) == NUMBER_READ && number == 0;
}

// Reads the camera at a frame of the animation, and leaves the tree as it is in the file.
static void animated_camera_read(CameraFile *file, uint32_t frame)
{
    YamlReader *reader = &file->reader;
    YamlTree *tree = &reader->tree;
    const size_t count = tree->nodes.count;
    OWNED YamlNode *nodes = memory_allocate(count, sizeof *nodes);
    memcpy(nodes, tree->nodes.items, count * sizeof *nodes);
    const YamlNode *turn = field_node(reader, file->camera, "turn");
    const bool can_turn = turn != file->camera && !is_zero(reader, turn);
    const SceneOptions options = {.frame = frame};
    reader->options = &options;
    if (can_turn)
        report_error(&reader->report, turn->offset,
                     "no key can be recorded: the camera's positions would be turned; remove 'turn'");
    else if (yaml_animate(reader))
        yaml_read_camera(reader, field_node(reader, tree->nodes.items, "camera"));
    reader->options = NULL;
    memcpy(tree->nodes.items, nodes, count * sizeof *nodes);
    tree->nodes.count = count;
    file->camera = field_node(reader, tree->nodes.items, "camera");
}

// Reports an error and returns false if a value of the camera has keys.
static bool camera_is_constant(CameraFile *file)
{
    YamlReader *reader = &file->reader;
    const YamlNode *key = file->camera->type == YAML_MAPPING ? yaml_first(&reader->tree, file->camera) : NULL;
    for (const YamlNode *value; key; key = yaml_next(&reader->tree, value)) {
        value = yaml_next(&reader->tree, key);
        if (yaml_has_keys(reader, value))
            return report_error(&reader->report, value->offset,
                                "the camera cannot be written: it is animated; K records a key");
    }
    return true;
}

static bool camera_file_read(CameraFile *file, const Source *source, const uint32_t *frame,
                             MessageList *messages)
{
    *file = (CameraFile){.reader.report = report_open(source, messages)};
    YamlReader *reader = &file->reader;
    reader->scene = &file->scene;
    if (yaml_tree_read(&reader->tree, &reader->report, 0, NULL)) {
        const YamlNode *root = reader->tree.nodes.items;
        file->camera = root->type == YAML_MAPPING ? field_node(reader, root, "camera") : root;
        const YamlNode *include = root->type == YAML_MAPPING ? field_node(reader, root, "include") : root;
        if (file->camera == root && include != root)
            report_error(&reader->report, include->offset,
                         "the camera cannot be written: it is in an included file");
        else if (file->camera == root)
            report_error(&reader->report, root->offset, "the scene has no camera");
        else if (frame)
            animated_camera_read(file, *frame);
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

// Returns the spaces in front of a key's place. Other bytes, as in `camera: {`, count as spaces.
static size_t indentation(const Source *source, size_t offset)
{
    size_t start = offset;
    while (start > 0 && source->bytes[start - 1] != '\n')
        start--;
    return offset - start;
}

// Returns the quote of a key like this one, or "". The offset of a quoted key is behind its quote.
static const char *quote_of(const Source *source, const YamlNode *key)
{
    const char before = source->bytes[key->offset - 1];
    return before == '"' || before == '\'' ? "\"" : "";
}

// Inserts a key in front of another of a mapping.
static void pair_insert(Copy *copy, const YamlNode *mapping, const YamlNode *next, const char *key,
                        const Text *value)
{
    const char *quote = quote_of(copy->source, next);
    const size_t offset = next->offset - strlen(quote);
    copy_until(copy, offset);
    text_appendf(copy->text, "%s%s%s: %s", quote, key, quote, text_c(value));
    if (copy->source->bytes[mapping->offset] == '{')
        text_appendf(copy->text, ", ");
    else
        text_appendf(copy->text, "\n%*s", (int)indentation(copy->source, offset), "");
}

// Adds a key behind the last one of a mapping. In a block it is on a new line, behind a comment.
static void pair_append(Copy *copy, const YamlNode *mapping, const YamlNode *last, size_t end,
                        const char *key, const Text *value)
{
    const Source *source = copy->source;
    const char *quote = quote_of(source, last);
    const bool is_block = source->bytes[mapping->offset] != '{';
    while (is_block && end < source->length && source->bytes[end] != '\n')
        end++;
    copy_until(copy, end);
    if (is_block)
        text_appendf(copy->text, "\n%*s", (int)indentation(source, last->offset - strlen(quote)), "");
    else
        text_appendf(copy->text, ", ");
    text_appendf(copy->text, "%s%s%s: %s", quote, key, quote, text_c(value));
}

// Replaces the value of a key. A list in a block may begin in the column of its key; other values may not.
static void value_replace(Copy *copy, const YamlNode *key, const YamlNode *value, const char *text)
{
    const Source *source = copy->source;
    copy_until(copy, value->offset);
    const bool is_flush = indentation(source, value->offset) <= indentation(source, key->offset);
    text_appendf(copy->text, "%s%s", is_flush ? " " : "", text);
    copy->next = value->end;
}

// Records the new value of an animated key, or of one that becomes animated. Returns false with a message if
// the keys have no separate place in the file.
static bool value_record(Copy *copy, CameraFile *file, const YamlNode *name, const YamlNode *animated,
                         uint32_t frame, const Text *value)
{
    YamlReader *reader = &file->reader;
    char key[16];
    snprintf(key, sizeof key, "%u", frame);
    if (!yaml_has_keys(reader, animated)) {
        const char *quote = quote_of(copy->source, name);
        OwnedText text = {0};
        text_appendf(&text, "{%skeys%s: {%s%s%s: %s}}", quote, quote, quote, key, quote, text_c(value));
        value_replace(copy, name, animated, text_c(&text));
        return true;
    }
    const YamlNode *keys = field_node(reader, animated, "keys"), *old;
    for (const YamlNode *next = yaml_first(&reader->tree, keys);; next = yaml_next(&reader->tree, old)) {
        old = yaml_next(&reader->tree, next);
        const char *text = yaml_text(&reader->tree, next);
        double number;
        if (next->offset < animated->offset || old->offset < next->offset)
            return report_error(&reader->report, animated->offset,
                                "no key can be recorded: the camera's keys have an alias");
        number_read(text, strlen(text), &number);
        if (number == frame) value_replace(copy, next, old, text_c(value));
        if (number > frame) pair_insert(copy, keys, next, key, value);
        const bool is_last = number < frame && !yaml_next(&reader->tree, old);
        if (is_last) pair_append(copy, keys, next, old->end, key, value);
        if (is_last || number >= frame) return true;
    }
}

// Writes the new value of a key. Returns false if it has not changed and is not recorded. After a move the
// key `turn` becomes 0, because the new position includes it.
static bool value_write(Text *text, const char *key, const Camera *old, const Camera *camera, bool has_turn,
                        bool is_recorded)
{
    const bool has_position = !vectors_equal(old->position, camera->position),
               has_target = !vectors_equal(old->look_at, camera->look_at),
               has_up = !vectors_equal(old->up, camera->up), is_moved = has_position || has_target || has_up;
    const struct {
        const char *key;
        bool has_changed;
        const Vector3 *vector; // NULL for a number
        double number;
    } values[] = {{"position", has_position || (is_moved && has_turn), &camera->position, 0},
                  {"look_at", has_target, &camera->look_at, 0},
                  {"up", has_up, &camera->up, 0},
                  {"turn", is_moved, NULL, 0},
                  {"height", old->half_tangent != camera->half_tangent, NULL, 2 * camera->half_tangent}};
    size_t i = 0;
    while (i < COUNT_OF(values) && strcmp(key, values[i].key) != 0)
        i++;
    if (i == COUNT_OF(values) || !(is_recorded || values[i].has_changed)) return false;
    if (values[i].vector)
        vector_write_yaml(text, *values[i].vector);
    else
        number_write_yaml(text, values[i].number);
    return true;
}

// Returns whether a value gets a key when one of the camera is recorded. An `up` without keys does not,
// because moves only make it upright.
static bool gets_key(const YamlReader *reader, const char *key, const YamlNode *value)
{
    return strcmp(key, "position") == 0 || strcmp(key, "look_at") == 0 || strcmp(key, "height") == 0 ||
           (strcmp(key, "up") == 0 && yaml_has_keys(reader, value));
}

static bool values_replace(Copy *copy, CameraFile *file, const Camera *camera, const uint32_t *frame)
{
    YamlReader *reader = &file->reader;
    if (camera->lens.radius > 0 && camera_focal_distance(camera) == 0)
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
        if (lacks_up) {
            OwnedText up = {0};
            vector_write_yaml(&up, camera->up);
            pair_insert(copy, file->camera, key, "up", &up);
        }
        lacks_up = false;
        OwnedText written = {0};
        const char *name = yaml_text(&reader->tree, key);
        const bool records = frame && gets_key(reader, name, value);
        if (!value_write(&written, name, old, camera, has_turn, records)) continue;
        if (!records)
            value_replace(copy, key, value, text_c(&written));
        else if (!value_record(copy, file, key, value, *frame, &written))
            return false;
    }
    copy_until(copy, copy->source->length);
    return true;
}

bool camera_replace(Text *text, const Source *source, const Camera *camera, const uint32_t *frame,
                    MessageList *messages)
{
    *text = (Text){0};
    CameraFile file;
    if (!camera_file_read(&file, source, frame, messages)) return false;
    Copy copy = {.source = source, .text = text};
    bool replaced = values_replace(&copy, &file, camera, frame);
    camera_file_free(&file);
    if (!replaced) text_free(text);
    return replaced;
}
