// `.cfg`, the scenes of the program in Mouad Sidqi's Ray Tracing in C explained: blocks such as `=>sphere :`
// with one key per line. docs/scene-format.md lists what is read.
#include "host/base/array.h"
#include "host/import/line.h"
#include "host/import/load.h"
#include "host/scene/portable.h"

#include <string.h>

static const Range range_radians = {0, M_PI_2, true, "greater than 0 and less than pi/2"};
// Colors above 255 are clamped to it, as in that program.
static const Range range_color = {0, INFINITY, false, "from 0 to 255"};
static const double COLOR_MAX = 255;

// Holds the values of any block.
typedef struct {
    Vector3 position, look_at, center, normal, color, diffuse, intensity;
    double radius, angle, specular;
} BlockValues;

// The keys, in the order in which messages name those that a block lacks.
enum { POSITION, LOOK_AT, INTENSITY, RADIUS, ANGLE, CENTER, NORMAL, COLOR, DIFFUSE, SPECULAR, KEY_COUNT };

static const LineField keys[KEY_COUNT] = {
    [POSITION] = {"position", line_vector, offsetof(BlockValues, position), NULL},
    [LOOK_AT] = {"look_at", line_vector, offsetof(BlockValues, look_at), NULL},
    [INTENSITY] = {"intensity", line_vector, offsetof(BlockValues, intensity), &range_not_negative},
    [RADIUS] = {"radius", line_number, offsetof(BlockValues, radius), &range_positive},
    [ANGLE] = {"angle", line_number, offsetof(BlockValues, angle), &range_radians},
    [CENTER] = {"center", line_vector, offsetof(BlockValues, center), NULL},
    [NORMAL] = {"normal", line_vector, offsetof(BlockValues, normal), NULL},
    [COLOR] = {"color", line_vector, offsetof(BlockValues, color), &range_color},
    [DIFFUSE] = {"diffuse", line_vector, offsetof(BlockValues, diffuse), &range_not_negative},
    [SPECULAR] = {"specular", line_number, offsetof(BlockValues, specular), &range_not_negative},
};

typedef struct {
    Report report;
    Line line;
    Scene *scene;
    bool has_camera;
} CfgReader;

typedef enum { BLOCK_CAMERA, BLOCK_LIGHT, BLOCK_OBJECT } BlockType;

typedef struct {
    const char *name;
    BlockType type;
    unsigned keys; // bits, all required
    void (*finish)(CfgReader *reader, const BlockValues *values);
} Block;

static void camera_finish(CfgReader *reader, const BlockValues *values)
{
    reader->scene->camera = (Camera){
        .position = values->position,
        .look_at = values->look_at,
        .up = {0, 1, 0},
        .field_axis = FIELD_HORIZONTAL,
        .half_tangent = 0.25, // the program's frame of width 1 at a focal length of 2
    };
}

static void light_finish(CfgReader *reader, const BlockValues *values)
{
    Light light = {.type = LIGHT_POINT, .position = values->position, .color = values->intensity};
    array_push(reader->scene->lights, light);
}

static void object_finish(CfgReader *reader, const BlockValues *values, Object object)
{
    Material material = material_default();
    material.color = vector_scale(values->color, 1 / COLOR_MAX);
    material.diffuse = values->diffuse;
    material.specular.largest = values->specular;
    material.shininess = 30;
    scene_add_object(reader->scene, object, &material);
}

static void sphere_finish(CfgReader *reader, const BlockValues *values)
{
    Object object = {.type = SHAPE_SPHERE, .as.sphere = {.center = values->center, .radius = values->radius}};
    object_finish(reader, values, object);
}

static void plane_finish(CfgReader *reader, const BlockValues *values)
{
    Object object = {.type = SHAPE_PLANE, .as.plane = {.point = values->position, .normal = values->normal}};
    object_finish(reader, values, object);
}

static void cylinder_finish(CfgReader *reader, const BlockValues *values)
{
    Object object = {
        .type = SHAPE_CYLINDER,
        .as.cylinder = {.from = values->center, .axis = values->normal, .radius = values->radius}};
    object_finish(reader, values, object);
}

static void cone_finish(CfgReader *reader, const BlockValues *values)
{
    Object object = {.type = SHAPE_CONE,
                     .as.cone = {.from = values->center,
                                 .axis = values->normal,
                                 .slope = portable_tangent(values->angle)}};
    object_finish(reader, values, object);
}

enum { OBJECT_KEYS = 1 << COLOR | 1 << DIFFUSE | 1 << SPECULAR };

static const Block blocks[] = {
    {"camera", BLOCK_CAMERA, 1 << POSITION | 1 << LOOK_AT, camera_finish},
    {"light", BLOCK_LIGHT, 1 << POSITION | 1 << INTENSITY, light_finish},
    {"sphere", BLOCK_OBJECT, 1 << RADIUS | 1 << CENTER | OBJECT_KEYS, sphere_finish},
    {"plane", BLOCK_OBJECT, 1 << POSITION | 1 << NORMAL | OBJECT_KEYS, plane_finish},
    {"cylinder", BLOCK_OBJECT, 1 << RADIUS | 1 << CENTER | 1 << NORMAL | OBJECT_KEYS, cylinder_finish},
    {"cone", BLOCK_OBJECT, 1 << ANGLE | 1 << CENTER | 1 << NORMAL | OBJECT_KEYS, cone_finish},
};

// Reads a key and its value, and adds the key to those that were seen.
static bool key_read(CfgReader *reader, const Block *block, BlockValues *values, unsigned *seen)
{
    Line *line = &reader->line;
    const Word word = line_word(line);
    unsigned key = 0;
    if (word_is(word, "transfo") && block->type == BLOCK_OBJECT) {
        report_warning(&reader->report, word.offset, "'transfo' is not supported; the object is not moved");
        return true;
    }
    while (key < KEY_COUNT && !((block->keys >> key & 1) && word_is(word, keys[key].name)))
        key++;
    if (key == KEY_COUNT)
        return report_error(&reader->report, word.offset, "unknown %s key '%.*s'", block->name,
                            WORD_TEXT(word));
    if (*seen >> key & 1)
        return report_error(&reader->report, word.offset, "'%s' is given twice", keys[key].name);
    *seen |= 1u << key;
    const size_t offset = line_peek(line).offset;
    const bool read = line_field(line, &keys[key], values);
    if (read && key == NORMAL && vector_is_zero(values->normal))
        return report_error(&reader->report, offset, "'normal' must not be zero");
    if (read && key == COLOR && vector_largest(values->color) > COLOR_MAX) {
        report_warning(&reader->report, offset, "'color' exceeds 255 and is clamped");
        values->color = vector_min(values->color, vector_all(COLOR_MAX));
    }
    return read && line_end(line);
}

static bool word_opens_block(Word word)
{
    return word.length >= 2 && !memcmp(word.text, "=>", 2);
}

// Reads up to the closing brace. Reports an error and returns false if the block cannot be used.
static bool block_read(CfgReader *reader, const Block *block, size_t start, BlockValues *values)
{
    Line *line = &reader->line;
    unsigned seen = 0;
    bool all_read = true;
    for (;;) {
        const Line before = *line;
        if (!line_next_filled(line))
            return report_error(&reader->report, reader->report.source->length, "'}' is missing");
        Word word = line_peek(line);
        if (word_opens_block(word)) {
            *line = before; // the next block is still read
            return report_error(&reader->report, word.offset, "'}' is missing");
        }
        if (word_is(word, "}")) break;
        all_read &= key_read(reader, block, values, &seen);
    }
    line_word(line);
    all_read &= line_end(line);
    for (unsigned key = 0; key < KEY_COUNT; key++)
        if ((block->keys & ~seen) >> key & 1)
            all_read = report_error(&reader->report, start, "the %s lacks '%s'", block->name, keys[key].name);
    return all_read;
}

// Returns the block opened by a line such as `=>sphere :`. Reports an error and returns NULL if the name is
// unknown.
static const Block *block_find(CfgReader *reader)
{
    Word arrow = line_word(&reader->line);
    Word name = {.text = arrow.text + 2, .offset = arrow.offset + 2, .length = arrow.length - 2};
    if (!name.length) name = line_word(&reader->line);
    if (name.length && name.text[name.length - 1] == ':')
        name.length--;
    else if (word_is(line_peek(&reader->line), ":"))
        line_word(&reader->line);
    else {
        report_error(&reader->report, line_peek(&reader->line).offset, "':' is missing");
        return NULL;
    }
    for (size_t i = 0; i < COUNT_OF(blocks); i++) {
        if (word_is(name, blocks[i].name)) return line_end(&reader->line) ? &blocks[i] : NULL;
    }
    report_error(&reader->report, name.offset, "unknown block '%.*s'", WORD_TEXT(name));
    return NULL;
}

static void block_skip(Line *line)
{
    while (line_next(line) && !word_is(line_peek(line), "}"))
        continue;
}

static void block_open(CfgReader *reader)
{
    Line *line = &reader->line;
    size_t start = line_peek(line).offset;
    const Block *block = block_find(reader);
    if (!block) {
        block_skip(line);
        return;
    }
    if (block->type == BLOCK_CAMERA) line_is_first(line, &reader->has_camera, "camera");
    const bool has_line = line_next_filled(line);
    if (!has_line || !word_is(line_peek(line), "{")) {
        report_error(&reader->report, has_line ? line->start : line_offset(line), "'{' is missing");
        return;
    }
    line_word(line);
    line_end(line);
    const bool is_camera = block->type == BLOCK_CAMERA;
    BlockValues values = {0};
    if (!block_read(reader, block, start, &values)) return;
    if (is_camera && vector_is_zero(vector_subtract(values.look_at, values.position)))
        report_error(&reader->report, start, "'look_at' must differ from 'position'");
    block->finish(reader, &values);
}

static void block_read_or_skip(void *context)
{
    CfgReader *reader = context;
    const Word word = line_peek(&reader->line);
    if (word_opens_block(word))
        block_open(reader);
    else
        report_warning(&reader->report, word.offset, "'%.*s' is not in a block and is skipped",
                       WORD_TEXT(word));
}

bool scene_read_cfg(Scene *scene, const Source *source, MessageList *messages)
{
    *scene = (Scene){.color_meaning = COLORS_DISPLAY, .ambient = {0.2, 0.2, 0.2}};
    CfgReader reader = {.report = report_open(source, messages), .scene = scene};
    reader.line = line_first(&reader.report, '\n');
    if (line_is_text(&reader.line)) {
        line_elements(&reader.line, scene, block_read_or_skip, &reader);
        if (!reader.has_camera && !report_is_full(&reader.report))
            report_error(&reader.report, source->length,
                         "the scene has no camera; a block '=>camera' adds one");
    }
    return scene_finish(scene, &reader.report, &(SceneOptions){0});
}
