// `.rt`, the scenes of miniRT: one element per line, fields separated by blanks, vectors by commas.
// docs/scene-format.md lists what is read.
#include "host/base/array.h"
#include "host/import/line.h"
#include "host/import/load.h"
#include "host/scene/portable.h"

#include <string.h>

typedef struct {
    Report report;
    Line line;
    Scene *scene;
    bool lenient;
    bool has_ambient, has_camera, has_size;
} RtReader;

static const Range range_axis = {-1, 1, false, "from -1 to 1"},
                   range_ratio = {0, 1, false, "from 0 to 1 (0 or more with --lenient)"};

static bool color_read(Line *line, Color *color)
{
    if (!line_comma_vector(line, "color", &range_byte, color)) return false;
    *color = vector_scale(*color, 1.0 / 255);
    return true;
}

// Reads a unit vector. Normalizes the other lengths that files often have, and leaves zero unchanged.
static bool unit_vector_read(Line *line, const char *name, Vector3 *axis)
{
    const double tolerated = 0.01; // files round to two or three digits
    size_t offset = line_peek(line).offset;
    if (!line_comma_vector(line, name, &range_axis, axis)) return false;
    if (!vector_is_zero(*axis) && fabs(vector_length(*axis) - 1) > tolerated)
        report_warning(line->report, offset, "'%s' is not a unit vector; it is normalized", name);
    *axis = vector_normalize(*axis);
    return true;
}

static bool axis_read(Line *line, const char *name, Vector3 *axis)
{
    size_t offset = line_peek(line).offset;
    return unit_vector_read(line, name, axis) &&
           (!vector_is_zero(*axis) || report_error(line->report, offset, "'%s' must not be zero", name));
}

// Requires the end of the line. With --lenient, skips the rest, such as textures.
static bool element_end(RtReader *reader)
{
    const Word first = line_peek(&reader->line);
    if (!reader->lenient && first.length > 0)
        return report_error(&reader->report, first.offset,
                            "the line must end before '%.*s'; --lenient skips it", WORD_TEXT(first));
    for (Word word; (word = line_word(&reader->line)).length;)
        report_warning(&reader->report, word.offset, "'%.*s' is skipped", WORD_TEXT(word));
    return true;
}

// Returns whether specular and shininess follow. With --lenient a single number is an unknown field.
static bool finish_follows(const RtReader *reader)
{
    Line ahead = reader->line;
    return word_is_number(line_word(&ahead)) && (!reader->lenient || word_is_number(line_peek(&ahead)));
}

// Reads the optional specular and shininess at the end of an object's line.
static bool finish_read(RtReader *reader, Material *material)
{
    Line *line = &reader->line;
    if (finish_follows(reader) &&
        !(line_number(line, "specular", &range_unit, &material->specular.largest) &&
          line_number(line, "shininess", &range_not_negative, &material->shininess)))
        return false;
    return element_end(reader);
}

static bool material_read(RtReader *reader, Material *material)
{
    return color_read(&reader->line, &material->color) && finish_read(reader, material);
}

// Reads the brightness of a light, which is at most 1 unless --lenient is given.
static bool ratio_read(RtReader *reader, double *ratio)
{
    const size_t offset = line_peek(&reader->line).offset;
    const Range *range = reader->lenient ? &range_not_negative : &range_ratio;
    if (!line_number(&reader->line, "ratio", range, ratio)) return false;
    if (*ratio > 1) report_warning(&reader->report, offset, "'ratio' is above 1; it is used unchanged");
    return true;
}

static bool ambient_read(RtReader *reader)
{
    double ratio;
    Color color;
    if (!line_is_first(&reader->line, &reader->has_ambient, "ambient light") || !ratio_read(reader, &ratio) ||
        !color_read(&reader->line, &color) || !element_end(reader))
        return false;
    reader->scene->ambient = vector_scale(color, ratio);
    return true;
}

static bool camera_read(RtReader *reader, Camera *camera)
{
    Line *line = &reader->line;
    Vector3 position, direction;
    double fov_degrees;
    if (!line_comma_vector(line, "position", NULL, &position)) return false;
    size_t offset = line_peek(line).offset;
    if (!unit_vector_read(line, "direction", &direction) ||
        !line_number(line, "fov", &range_half_turn, &fov_degrees) || !element_end(reader))
        return false;
    if (vector_is_zero(direction)) {
        report_warning(&reader->report, offset, "'direction' is zero; the camera looks along +z");
        direction = (Vector3){0, 0, 1};
    }
    camera_look_along(camera, position, direction);
    camera->up = (Vector3){0, 1, 0};
    camera->field_axis = FIELD_HORIZONTAL;
    camera->half_tangent = portable_tangent(fov_degrees * (M_PI / 360));
    return true;
}

static bool only_camera_read(RtReader *reader)
{
    return line_is_first(&reader->line, &reader->has_camera, "camera") &&
           camera_read(reader, &reader->scene->camera);
}

// Reads the older subject's `c`, which a file may repeat.
static bool one_camera_read(RtReader *reader)
{
    if (!reader->has_camera) return only_camera_read(reader);
    report_warning(&reader->report, reader->line.start, "only the first camera is used");
    Camera unused = {0};
    return camera_read(reader, &unused);
}

static bool light_read(RtReader *reader)
{
    Line *line = &reader->line;
    Light light = {.type = LIGHT_POINT, .color = {1, 1, 1}};
    double ratio;
    if (!line_comma_vector(line, "position", NULL, &light.position) || !ratio_read(reader, &ratio) ||
        (line_peek(line).length && !color_read(line, &light.color)) || !element_end(reader))
        return false;
    light.color = vector_scale(light.color, ratio);
    array_push(reader->scene->lights, light);
    return true;
}

static bool resolution_read(RtReader *reader)
{
    return line_is_first(&reader->line, &reader->has_size, "resolution") &&
           line_whole_number(&reader->line, "width", &range_pixels, &reader->scene->width) &&
           line_whole_number(&reader->line, "height", &range_pixels, &reader->scene->height) &&
           element_end(reader);
}

static bool sphere_read(RtReader *reader)
{
    Object object = {.type = SHAPE_SPHERE};
    Material material = material_default();
    double diameter;
    if (!line_comma_vector(&reader->line, "center", NULL, &object.as.sphere.center) ||
        !line_number(&reader->line, "diameter", &range_positive, &diameter) ||
        !material_read(reader, &material))
        return false;
    object.as.sphere.radius = diameter / 2;
    scene_add_object(reader->scene, object, &material);
    return true;
}

static bool plane_read(RtReader *reader)
{
    Object object = {.type = SHAPE_PLANE};
    Material material = material_default();
    if (!line_comma_vector(&reader->line, "point", NULL, &object.as.plane.point) ||
        !axis_read(&reader->line, "normal", &object.as.plane.normal) || !material_read(reader, &material))
        return false;
    scene_add_object(reader->scene, object, &material);
    return true;
}

static bool cylinder_read(RtReader *reader)
{
    Line *line = &reader->line;
    Object object = {.type = SHAPE_CYLINDER, .as.cylinder = {.finite = true, .caps = true}};
    Material material = material_default();
    Vector3 center, axis;
    double diameter, height;
    if (!line_comma_vector(line, "center", NULL, &center) || !axis_read(line, "axis", &axis)) return false;
    const Word third = line_peek_vector(line);
    const bool color_first = memchr(third.text, ',', third.length) != NULL;
    if (color_first) {
        report_warning(&reader->report, third.offset,
                       "the color is accepted although it precedes the diameter and the height");
        if (!color_read(line, &material.color)) return false;
    }
    if (!line_number(line, "diameter", &range_positive, &diameter) ||
        !line_number(line, "height", &range_positive, &height) ||
        !(color_first ? finish_read(reader, &material) : material_read(reader, &material)))
        return false;
    object.as.cylinder.from = vector_subtract(center, vector_scale(axis, height / 2));
    object.as.cylinder.axis = vector_scale(axis, height);
    object.as.cylinder.radius = diameter / 2;
    scene_add_object(reader->scene, object, &material);
    return true;
}

// Reads the bonus part's cone: its base center, its axis towards the tip and its height.
static bool cone_read(RtReader *reader)
{
    Line *line = &reader->line;
    Object object = {.type = SHAPE_CONE, .as.cone = {.finite = true, .caps = true}};
    Material material = material_default();
    Vector3 axis;
    double diameter, height;
    if (!line_comma_vector(line, "base", NULL, &object.as.cone.from) || !axis_read(line, "axis", &axis) ||
        !line_number(line, "diameter", &range_positive, &diameter) ||
        !line_number(line, "height", &range_positive, &height) || !material_read(reader, &material))
        return false;
    object.as.cone.axis = vector_scale(axis, height);
    object.as.cone.radius[0] = diameter / 2;
    scene_add_object(reader->scene, object, &material);
    return true;
}

// Reads a square with one pair of horizontal sides, because the subject leaves the rotation about the normal
// unspecified.
static bool square_read(RtReader *reader)
{
    Vector3 center, normal;
    Material material = material_default();
    double side;
    if (!line_comma_vector(&reader->line, "center", NULL, &center) ||
        !axis_read(&reader->line, "normal", &normal) ||
        !line_number(&reader->line, "side", &range_positive, &side) || !material_read(reader, &material))
        return false;
    Vector3 level = vector_cross((Vector3){0, 1, 0}, normal);
    level = vector_is_zero(level) ? (Vector3){1, 0, 0} : vector_normalize(level);
    Vector3 across = vector_scale(vector_cross(normal, level), side / 2);
    level = vector_scale(level, side / 2);
    Vector3 low = vector_subtract(center, across), high = vector_add(center, across);
    Vector3 corners[4] = {vector_subtract(low, level), vector_add(low, level), vector_add(high, level),
                          vector_subtract(high, level)};
    uint32_t index = scene_add_material(reader->scene, &material, "");
    for (size_t i = 1; i <= 2; i++) {
        Object half = {.type = SHAPE_TRIANGLE,
                       .material = index,
                       .as.triangle = {.vertices = {corners[0], corners[i], corners[i + 1]}}};
        array_push(reader->scene->objects, half);
    }
    return true;
}

static bool triangle_read(RtReader *reader)
{
    Object object = {.type = SHAPE_TRIANGLE};
    Material material = material_default();
    for (size_t i = 0; i < 3; i++) {
        if (!line_comma_vector(&reader->line, "vertex", NULL, &object.as.triangle.vertices[i])) return false;
    }
    if (!material_read(reader, &material)) return false;
    scene_add_object(reader->scene, object, &material);
    return true;
}

// Each `read` reads the rest of its line. Reports the first error and returns false.
static const struct {
    const char *name;
    bool (*read)(RtReader *reader);
} elements[] = {
    {"A", ambient_read},   {"C", only_camera_read}, {"c", one_camera_read}, {"L", light_read},
    {"l", light_read},     {"R", resolution_read},  {"sp", sphere_read},    {"pl", plane_read},
    {"cy", cylinder_read}, {"co", cone_read},       {"sq", square_read},    {"tr", triangle_read},
};

static void element_read(void *context)
{
    RtReader *reader = context;
    Word name = line_word(&reader->line);
    for (size_t i = 0; i < COUNT_OF(elements); i++) {
        if (word_is(name, elements[i].name)) {
            elements[i].read(reader);
            return;
        }
    }
    if (reader->lenient)
        report_warning(&reader->report, name.offset, "unknown element '%.*s'; it is skipped",
                       WORD_TEXT(name));
    else
        report_error(&reader->report, name.offset, "unknown element '%.*s'; --lenient skips it",
                     WORD_TEXT(name));
}

bool scene_read_rt(Scene *scene, const Source *source, const SceneOptions *options, MessageList *messages)
{
    *scene = (Scene){.color_meaning = COLORS_DISPLAY};
    RtReader reader = {.report = report_open(source, messages), .scene = scene, .lenient = options->lenient};
    reader.line = line_first(&reader.report, '#');
    reader.line.joins_blanks = reader.lenient;
    if (line_is_text(&reader.line)) {
        if (!line_elements(&reader.line, scene, element_read, &reader))
            report_error(&reader.report, 0, "the scene is empty");
        else if (!reader.has_camera && !report_is_full(&reader.report))
            report_error(&reader.report, source->length,
                         "the scene has no camera; a line that begins with C adds one");
    }
    return scene_finish(scene, &reader.report, options);
}
