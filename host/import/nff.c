// `.nff`, Eric Haines' Neutral File Format: elements made of words separated by whitespace.
// docs/scene-format.md lists what is read and how lights and materials map to glint's.
#include "host/base/array.h"
#include "host/import/line.h"
#include "host/import/load.h"
#include "host/scene/polygon.h"
#include "host/scene/portable.h"

#include <stdlib.h>

typedef struct {
    Report report;
    Line line;
    Scene *scene;
    uint32_t material; // of what follows
    bool has_material, has_background, has_view, has_fault;
    ARRAY_OF(size_t) white_lights;      // indices of the lights without a color
    ARRAY_OF(Vector3) corners, normals; // of the polygon being read
    PolygonTriangles triangles;
} NffReader;

static const Range range_corner_count = {3, 16384, false, "from 3 to 16384"};

static bool color_read(NffReader *reader, Color *color)
{
    return line_vector(&reader->line, "color", &range_not_negative, color);
}

static bool size_read(Line *line, const char *name, const Range *range, void *value)
{
    unsigned *size = value;
    (void)name;
    return line_whole_number(line, "width", range, &size[0]) &&
           line_whole_number(line, "height", range, &size[1]);
}

typedef struct {
    Vector3 from, at, up;
    double angle, hither; // glint has no near clipping plane
    unsigned size[2];
} NffView;

// The first four are required.
static const LineField view_keys[] = {
    {"from", line_vector, offsetof(NffView, from), NULL},
    {"at", line_vector, offsetof(NffView, at), NULL},
    {"up", line_vector, offsetof(NffView, up), NULL},
    {"angle", line_number, offsetof(NffView, angle), &range_half_turn},
    {"hither", line_number, offsetof(NffView, hither), NULL},
    {"resolution", size_read, offsetof(NffView, size), &range_pixels},
};
enum { VIEW_REQUIRED = 4, VIEW_KEYS = COUNT_OF(view_keys) };

static size_t view_key_index(Word word)
{
    size_t index = 0;
    while (index < VIEW_KEYS && !word_is(word, view_keys[index].name))
        index++;
    return index;
}

static bool view_read(NffReader *reader)
{
    const size_t offset = reader->line.start;
    if (!line_is_first(&reader->line, &reader->has_view, "view")) return false;
    if (reader->scene->objects.count)
        return report_error(&reader->report, offset, "the view must precede the objects");
    NffView view = {0};
    bool seen[VIEW_KEYS] = {false};
    while (line_reach_word(&reader->line)) {
        const Word word = line_peek(&reader->line);
        const size_t index = view_key_index(word);
        if (index == VIEW_KEYS) break;
        const LineField *key = &view_keys[index];
        if (seen[index]) return report_error(&reader->report, word.offset, "'%s' is given twice", key->name);
        seen[index] = true;
        line_word(&reader->line);
        if (!line_field(&reader->line, key, &view) || !line_end(&reader->line)) return false;
    }
    for (size_t i = 0; i < VIEW_REQUIRED; i++)
        if (!seen[i]) return report_error(&reader->report, offset, "the view lacks '%s'", view_keys[i].name);
    if (vectors_equal(view.from, view.at))
        return report_error(&reader->report, offset, "'from' and 'at' must differ");
    Scene *scene = reader->scene;
    scene->camera = (Camera){.position = view.from,
                             .look_at = view.at,
                             .up = view.up,
                             .field_axis = FIELD_VERTICAL,
                             .half_tangent = portable_tangent(view.angle * (M_PI / 360))};
    scene->width = view.size[0];
    scene->height = view.size[1];
    return true;
}

static bool background_read(NffReader *reader)
{
    return line_is_first(&reader->line, &reader->has_background, "background") &&
           color_read(reader, &reader->scene->background) && line_end(&reader->line);
}

static bool light_read(NffReader *reader)
{
    Light light = {.type = LIGHT_POINT};
    if (!line_vector(&reader->line, "position", NULL, &light.position)) return false;
    if (!line_peek(&reader->line).length)
        array_push(reader->white_lights, reader->scene->lights.count);
    else if (!color_read(reader, &light.color))
        return false;
    array_push(reader->scene->lights, light);
    return line_end(&reader->line);
}

static bool material_read(NffReader *reader)
{
    Material material = material_default();
    Line *line = &reader->line;
    double ior;
    reader->has_material = true;
    if (!color_read(reader, &material.color) ||
        !line_number(line, "Kd", &range_not_negative, &material.ambient) ||
        !line_number(line, "Ks", &range_unit, &material.specular.largest) ||
        !line_number(line, "Shine", &range_not_negative, &material.shininess) ||
        !line_number(line, "T", &range_unit, &material.transmission.largest))
        return false;
    const Range *range = material.transmission.largest > 0 ? &range_positive : &range_not_negative;
    if (!line_number(line, "index of refraction", range, &ior) || !line_end(line)) return false;
    if (ior > 0) material.ior = ior;
    material.diffuse = vector_all(material.ambient);
    material.reflection = material.specular;
    material.shadow = SHADOW_FULL;
    reader->material = scene_add_material(reader->scene, &material, "");
    return true;
}

static void object_add(NffReader *reader, Object object)
{
    if (!reader->has_material) {
        report_warning(&reader->report, reader->line.start, "no material precedes this object; it is white");
        Material white = material_default();
        reader->material = scene_add_material(reader->scene, &white, "");
        reader->has_material = true;
    }
    object.material = reader->material;
    array_push(reader->scene->objects, object);
}

static bool sphere_read(NffReader *reader)
{
    Object object = {.type = SHAPE_SPHERE};
    double radius;
    if (!line_vector(&reader->line, "center", NULL, &object.as.sphere.center)) return false;
    const size_t offset = value_peek(&reader->line).offset;
    if (!line_number(&reader->line, "radius", NULL, &radius) || !line_end(&reader->line)) return false;
    if (radius == 0) return report_error(&reader->report, offset, "'radius' must not be zero");
    object.as.sphere.radius = fabs(radius);
    object.as.sphere.only_inside = radius < 0;
    object_add(reader, object);
    return true;
}

// Reads a cone, or a cylinder if both radii are equal.
static bool cone_read(NffReader *reader)
{
    Vector3 base, apex;
    double base_radius, apex_radius;
    size_t offset = reader->line.start;
    if (!line_vector(&reader->line, "base", NULL, &base) ||
        !line_number(&reader->line, "radius", NULL, &base_radius) ||
        !line_vector(&reader->line, "apex", NULL, &apex) ||
        !line_number(&reader->line, "radius", NULL, &apex_radius) || !line_end(&reader->line))
        return false;
    Vector3 axis = vector_subtract(apex, base);
    const char *fault = NULL;
    if (vector_is_zero(axis)) fault = "a cone's base and apex must differ";
    if (base_radius * apex_radius < 0) fault = "a cone's radii must not have different signs";
    if (base_radius == 0 && apex_radius == 0) fault = "a cone's radii must not both be zero";
    if (fault) return report_error(&reader->report, offset, "%s", fault);
    bool only_inside = base_radius < 0 || apex_radius < 0;
    Object object;
    if (base_radius == apex_radius) {
        object = (Object){.type = SHAPE_CYLINDER,
                          .as.cylinder = {.from = base,
                                          .axis = axis,
                                          .radius = fabs(base_radius),
                                          .finite = true,
                                          .only_inside = only_inside}};
    } else {
        object = (Object){.type = SHAPE_CONE,
                          .as.cone = {.from = base,
                                      .axis = axis,
                                      .radius = {fabs(base_radius), fabs(apex_radius)},
                                      .finite = true,
                                      .only_inside = only_inside}};
    }
    object_add(reader, object);
    return true;
}

static bool corners_read(NffReader *reader, bool smooth)
{
    unsigned count;
    if (!line_whole_number(&reader->line, "vertex count", &range_corner_count, &count)) return false;
    reader->corners.count = reader->normals.count = 0;
    for (unsigned i = 0; i < count; i++) {
        Vector3 corner, normal = {0, 0, 0};
        if (!line_vector(&reader->line, "vertex", NULL, &corner)) return false;
        if (smooth) {
            const size_t offset = value_peek(&reader->line).offset;
            if (!line_vector(&reader->line, "normal", NULL, &normal)) return false;
            if (vector_is_zero(normal))
                return report_error(&reader->report, offset, "'normal' must not be zero");
        }
        array_push(reader->corners, corner);
        array_push(reader->normals, normal);
    }
    return line_end(&reader->line);
}

static bool any_polygon_read(NffReader *reader, bool smooth)
{
    size_t offset = reader->line.start;
    if (!corners_read(reader, smooth)) return false;
    switch (polygon_triangulate(reader->corners.items, reader->corners.count, &reader->triangles)) {
    case POLYGON_WITHOUT_AREA:
        report_warning(&reader->report, offset, "the polygon has no area and is never hit");
        break;
    case POLYGON_CROSSED:
        report_warning(&reader->report, offset, "the polygon intersects itself; only parts of it are filled");
        break;
    case POLYGON_CUT:
        break;
    }
    for (size_t i = 0; i < reader->triangles.count; i++) {
        Object object = {.type = SHAPE_TRIANGLE, .as.triangle.smooth = smooth};
        for (size_t k = 0; k < 3; k++) {
            uint32_t corner = reader->triangles.items[i][k];
            object.as.triangle.vertices[k] = reader->corners.items[corner];
            object.as.triangle.normals[k] = reader->normals.items[corner];
        }
        object_add(reader, object);
    }
    return true;
}

static bool polygon_read(NffReader *reader)
{
    return any_polygon_read(reader, false);
}

static bool patch_read(NffReader *reader)
{
    return any_polygon_read(reader, true);
}

// Each `read` reads the words after an element's name up to the end of a line. Reports the first error and
// returns false.
static const struct {
    const char *name;
    bool (*read)(NffReader *reader);
} elements[] = {
    {"v", view_read}, {"b", background_read}, {"l", light_read},   {"f", material_read},
    {"c", cone_read}, {"s", sphere_read},     {"p", polygon_read}, {"pp", patch_read},
};

// Reads an element. After an error, skips the rest of its line and the lines that may belong to it.
static void element_read(void *context)
{
    NffReader *reader = context;
    Word name = line_word(&reader->line);
    for (size_t i = 0; i < COUNT_OF(elements); i++) {
        if (!word_is(name, elements[i].name)) continue;
        reader->has_fault = !elements[i].read(reader);
        if (reader->has_fault) line_skip(&reader->line);
        return;
    }
    line_skip(&reader->line);
    bool is_number = word_is_number(name);
    if (reader->has_fault && (is_number || view_key_index(name) < VIEW_KEYS)) return;
    reader->has_fault = true;
    if (is_number)
        report_error(&reader->report, name.offset, "an element is expected, not the number %.*s",
                     WORD_TEXT(name));
    else
        report_error(&reader->report, name.offset, "unknown element '%.*s'", WORD_TEXT(name));
}

// Sets the intensities, which the format leaves unspecified. Its author proposes this formula for each of n
// lights without a color, and for ambient light (Haines, Standard Procedural Databases, README, File
// structure).
static void lights_finish(NffReader *reader)
{
    Scene *scene = reader->scene;
    if (!scene->lights.count) return;
    double intensity = sqrt((double)scene->lights.count) / (2 * (double)scene->lights.count);
    Color white = {intensity, intensity, intensity};
    scene->ambient = white;
    for (size_t i = 0; i < reader->white_lights.count; i++)
        scene->lights.items[reader->white_lights.items[i]].color = white;
}

bool scene_read_nff(Scene *scene, const Source *source, MessageList *messages)
{
    *scene = (Scene){.color_meaning = COLORS_DISPLAY};
    NffReader reader = {.report = report_open(source, messages), .scene = scene};
    reader.line = line_first(&reader.report, '#');
    reader.line.spans_lines = true;
    if (line_is_text(&reader.line)) {
        if (!line_elements(&reader.line, scene, element_read, &reader))
            report_error(&reader.report, 0, "the scene is empty");
        else if (!reader.has_view && !report_is_full(&reader.report))
            report_error(&reader.report, source->length, "the scene has no view; an element 'v' adds one");
    }
    lights_finish(&reader);
    free(reader.white_lights.items);
    free(reader.corners.items);
    free(reader.normals.items);
    free(reader.triangles.items);
    return scene_finish(scene, &reader.report, &(SceneOptions){0});
}
