// `.dat`, the scenes of the Tachyon ray tracer (John E. Stone, Tachyon documentation, "Scene description
// files"): keywords in any case and their values, separated by whitespace. docs/scene-format.md says what is
// read and how it maps to glint.
#include "host/import/dat.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/place.h"
#include "host/scene/mesh.h"
#include "host/scene/portable.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

// Moves to the next line with a word on it unless words are left on this one.
static void reach_word(DatReader *reader)
{
    while (!line_peek(&reader->line).length && line_next(&reader->line, '#'))
        continue;
}

Word dat_peek(DatReader *reader)
{
    reach_word(reader);
    return line_peek(&reader->line);
}

Word dat_word(DatReader *reader)
{
    reach_word(reader);
    return line_word(&reader->line);
}

bool dat_is(Word word, const char *keyword)
{
    return word.length == strlen(keyword) && strncasecmp(word.text, keyword, word.length) == 0;
}

bool dat_skip(DatReader *reader, const char *keyword)
{
    const bool is_next = dat_is(dat_peek(reader), keyword);
    if (is_next) dat_word(reader);
    return is_next;
}

void dat_warn(DatReader *reader, size_t offset, const char *format, ...)
{
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (!report_repeats(&reader->report, NULL, 0, 0, text))
        report_warning(&reader->report, offset, "%s", text);
}

bool dat_expect(DatReader *reader, const char *keyword)
{
    const Word word = dat_peek(reader);
    if (dat_skip(reader, keyword)) return true;
    if (!word.length) return report_error(&reader->report, word.offset, "'%s' is missing", keyword);
    return report_error(&reader->report, word.offset, "'%s' is missing before '%.*s'", keyword,
                        word_shown(word), word.text);
}

// Reads the next word as a number. A word that is none may start the next statement, so it stays.
static bool value_in_range_read(DatReader *reader, const char *name, const Range *range, double *value)
{
    reach_word(reader);
    const size_t start = reader->line.at;
    const bool read = line_number(&reader->line, name, range, value);
    if (!read) reader->line.at = start;
    return read;
}

static bool value_read(DatReader *reader, const char *name, double *value)
{
    return value_in_range_read(reader, name, NULL, value);
}

static bool whole_number_read(DatReader *reader, const char *name, const Range *range, unsigned *value)
{
    reach_word(reader);
    const size_t start = reader->line.at;
    const bool read = line_whole_number(&reader->line, name, range, value);
    if (!read) reader->line.at = start;
    return read;
}

bool dat_number(DatReader *reader, const char *keyword, double *value)
{
    return dat_expect(reader, keyword) && value_read(reader, keyword, value);
}

bool dat_components(DatReader *reader, const char *name, Vector3 *vector)
{
    return value_read(reader, name, &vector->x) && value_read(reader, name, &vector->y) &&
           value_read(reader, name, &vector->z);
}

static bool coordinates_read(DatReader *reader, const char *name, Vector3 *vector)
{
    if (!dat_components(reader, name, vector)) return false;
    vector->z = -vector->z;
    return true;
}

bool dat_vector(DatReader *reader, const char *keyword, Vector3 *vector)
{
    return dat_expect(reader, keyword) && coordinates_read(reader, keyword, vector);
}

static bool point_of_object_read(DatReader *reader, const char *keyword, Vector3 *point)
{
    if (!dat_vector(reader, keyword, point)) return false;
    reader->bounds = bounds_join(reader->bounds, (Bounds){*point, *point});
    return true;
}

// Reads the number of things that follow.
static bool count_read(DatReader *reader, const char *name, unsigned *count)
{
    static const Range range_count = {0, INT32_MAX, false, "from 0 to 2147483647"};
    return whole_number_read(reader, name, &range_count, count);
}

static bool resolution_read(DatReader *reader)
{
    const size_t offset = reader->line.start;
    if (reader->has_resolution) return report_error(&reader->report, offset, "a second resolution");
    reader->has_resolution = true;
    return whole_number_read(reader, "width", &range_pixels, &reader->scene->width) &&
           whole_number_read(reader, "height", &range_pixels, &reader->scene->height);
}

// What a camera's block says.
typedef struct {
    double zoom, aspect, frustum[4]; // frustum: left, right, bottom, top at a distance of 1
    bool has_frustum;
    Vector3 center, view, up;
} CameraBlock;

static bool projection_read(DatReader *reader)
{
    double unused;
    if (!dat_skip(reader, "projection")) return true;
    const Word name = dat_word(reader);
    if (dat_is(name, "orthographic")) {
        reader->orthographic_height = 1;
        report_warning(&reader->report, name.offset,
                       "the orthographic projection becomes one in perspective from afar");
    } else if (dat_is(name, "perspective_dof")) {
        report_warning(&reader->report, name.offset, "depth of field is not shown: all is in focus");
        return dat_number(reader, "focallength", &unused) && dat_number(reader, "aperture", &unused);
    } else if (dat_is(name, "fisheye")) {
        report_warning(&reader->report, name.offset, "the fisheye projection becomes one in perspective");
    } else if (!dat_is(name, "perspective")) {
        return report_error(&reader->report, name.offset, "unknown projection '%.*s'", word_shown(name),
                            name.text);
    }
    return true;
}

// glint takes the rays per pixel and their depth from the command line.
static bool camera_block_read(DatReader *reader, CameraBlock *block)
{
    double unused;
    if (!projection_read(reader) || !dat_expect(reader, "zoom") ||
        !value_in_range_read(reader, "zoom", &range_positive, &block->zoom) ||
        !dat_expect(reader, "aspectratio"))
        return false;
    const size_t offset = dat_peek(reader).offset;
    if (!value_in_range_read(reader, "aspectratio", &range_positive, &block->aspect)) return false;
    if (block->aspect != 1)
        report_warning(&reader->report, offset, "'aspectratio' is not used: pixels are square");
    if (!dat_number(reader, "antialiasing", &unused) || !dat_number(reader, "raydepth", &unused) ||
        !dat_vector(reader, "center", &block->center) || !dat_vector(reader, "viewdir", &block->view) ||
        !dat_vector(reader, "updir", &block->up))
        return false;
    block->has_frustum = dat_skip(reader, "frustum");
    for (int i = 0; i < 4 && block->has_frustum; i++)
        if (!value_read(reader, "frustum", &block->frustum[i])) return false;
    return dat_expect(reader, "end_camera");
}

static bool camera_read(DatReader *reader)
{
    const size_t offset = reader->line.start;
    CameraBlock block;
    if (reader->has_camera) return report_error(&reader->report, offset, "a second camera");
    reader->has_camera = true;
    if (!camera_block_read(reader, &block)) return false;
    if (vector_is_zero(block.view))
        return report_error(&reader->report, offset, "'viewdir' must not be zero");
    double height = 1 / block.zoom;
    if (block.has_frustum) {
        const double *f = block.frustum;
        height = f[3] - f[2];
        if (!(f[1] > f[0] && height > 0))
            return report_error(&reader->report, offset, "'frustum' must be left, right, bottom and top");
        if (f[0] != -f[1] || f[2] != -f[3])
            report_warning(&reader->report, offset, "the camera's frustum is not centered: its middle moves");
        reader->scene->camera.frame_aspect = (f[1] - f[0]) / height;
    }
    Camera *camera = &reader->scene->camera;
    camera->position = block.center;
    // far from the origin a step of 1 may be lost in rounding
    const double step = fmax(1, vector_length(block.center));
    camera->look_at = vector_add(block.center, vector_scale(vector_normalize(block.view), step));
    camera->up = block.up;
    camera->field_axis = FIELD_VERTICAL;
    camera->half_tangent = height / 2;
    if (reader->orthographic_height > 0) reader->orthographic_height = height;
    return true;
}

static bool background_read(DatReader *reader)
{
    return dat_components(reader, "background", &reader->scene->background);
}

static bool fading_read(DatReader *reader)
{
    DatFading fading = {.light = reader->scene->lights.count, .offset = dat_peek(reader).offset};
    if (!dat_skip(reader, "attenuation")) return true;
    if (!dat_number(reader, "constant", &fading.fading[0]) ||
        !dat_number(reader, "linear", &fading.fading[1]) ||
        !dat_number(reader, "quadratic", &fading.fading[2]))
        return false;
    array_push(reader->fadings, fading);
    return true;
}

static bool light_end(DatReader *reader, Light light)
{
    const size_t offset = dat_peek(reader).offset;
    if (!dat_expect(reader, "color") || !dat_components(reader, "color", &light.color)) return false;
    if (!vector_is_zero(vector_min(light.color, vector_all(0))))
        return report_error(&reader->report, offset, "'color' must be 0 or more");
    if (light.kind != LIGHT_POINT && vector_is_zero(light.direction))
        return report_error(&reader->report, offset, "'direction' must not be zero");
    array_push(reader->scene->lights, light);
    return true;
}

static bool light_place_read(DatReader *reader, Light *light)
{
    double radius;
    if (!dat_vector(reader, "center", &light->position)) return false;
    const size_t offset = dat_peek(reader).offset;
    if (!dat_number(reader, "rad", &radius)) return false;
    if (radius > 0) dat_warn(reader, offset, "lights are not visible themselves");
    return true;
}

static bool light_read(DatReader *reader)
{
    Light light = {.kind = LIGHT_POINT};
    return light_place_read(reader, &light) && fading_read(reader) && light_end(reader, light);
}

static bool directional_light_read(DatReader *reader)
{
    Light light = {.kind = LIGHT_DIRECTIONAL};
    return dat_vector(reader, "direction", &light.direction) && light_end(reader, light);
}

static bool spotlight_read(DatReader *reader)
{
    static const Range range_falloff = {0, 180, true, "greater than 0 and less than 180"};
    Light light = {.kind = LIGHT_SPOT};
    double start;
    if (!light_place_read(reader, &light) || !dat_vector(reader, "direction", &light.direction) ||
        !dat_number(reader, "falloff_start", &start) || !dat_expect(reader, "falloff_end") ||
        !value_in_range_read(reader, "falloff_end", &range_falloff, &light.half_angle))
        return false;
    light.penumbra = light.half_angle - fmin(fmax(start, 0), light.half_angle);
    return fading_read(reader) && light_end(reader, light);
}

// Reads the texture and adds the object, unless it has a size that is not above 0, which Tachyon never hits.
static bool object_end(DatReader *reader, Object object, double size, size_t offset)
{
    if (!dat_texture(reader, &object.material)) return false;
    if (size > 0)
        array_push(reader->scene->objects, object);
    else
        dat_warn(reader, offset, "a %s without size or direction is not shown", shape_names[object.kind]);
    return true;
}

static bool sphere_read(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.kind = SHAPE_SPHERE};
    return point_of_object_read(reader, "center", &object.as.sphere.center) &&
           dat_number(reader, "rad", &object.as.sphere.radius) &&
           object_end(reader, object, object.as.sphere.radius, offset);
}

static bool plane_read(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.kind = SHAPE_PLANE};
    return dat_vector(reader, "center", &object.as.plane.point) &&
           dat_vector(reader, "normal", &object.as.plane.normal) &&
           object_end(reader, object, !vector_is_zero(object.as.plane.normal), offset);
}

static bool cylinder_read(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.kind = SHAPE_CYLINDER};
    return dat_vector(reader, "center", &object.as.cylinder.from) &&
           dat_vector(reader, "axis", &object.as.cylinder.axis) &&
           dat_number(reader, "rad", &object.as.cylinder.radius) &&
           object_end(reader, object, vector_is_zero(object.as.cylinder.axis) ? 0 : object.as.cylinder.radius,
                      offset);
}

static bool finite_cylinder_read(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.kind = SHAPE_CYLINDER, .as.cylinder.finite = true};
    Vector3 apex;
    if (!point_of_object_read(reader, "base", &object.as.cylinder.from) ||
        !point_of_object_read(reader, "apex", &apex) ||
        !dat_number(reader, "rad", &object.as.cylinder.radius))
        return false;
    object.as.cylinder.axis = vector_subtract(apex, object.as.cylinder.from);
    return object_end(reader, object, vector_is_zero(object.as.cylinder.axis) ? 0 : object.as.cylinder.radius,
                      offset);
}

// Cylinders between successive points, and a sphere at each point.
static bool polycylinder_read(DatReader *reader)
{
    const size_t offset = reader->line.start;
    unsigned count;
    double radius;
    struct {
        Vector3 *items;
        size_t count, capacity;
    } points = {0};
    bool read = dat_expect(reader, "points") && count_read(reader, "points", &count);
    for (unsigned i = 0; read && i < count; i++) {
        Vector3 point;
        read = coordinates_read(reader, "points", &point);
        array_push(points, point);
    }
    uint32_t material;
    read = read && dat_number(reader, "rad", &radius) && dat_texture(reader, &material);
    if (read && !(radius > 0)) dat_warn(reader, offset, "a polycylinder without a radius is not shown");
    for (size_t i = 0; read && radius > 0 && i < points.count; i++) {
        const Vector3 point = points.items[i];
        const Vector3 axis = i > 0 ? vector_subtract(points.items[i - 1], point) : (Vector3){0, 0, 0};
        reader->bounds = bounds_join(reader->bounds, (Bounds){point, point});
        const Object sphere = {.kind = SHAPE_SPHERE,
                               .material = material,
                               .as.sphere = {point, radius, false}},
                     cylinder = {
                         .kind = SHAPE_CYLINDER,
                         .material = material,
                         .as.cylinder = {.from = point, .axis = axis, .radius = radius, .finite = true}};
        array_push(reader->scene->objects, sphere);
        if (!vector_is_zero(axis)) array_push(reader->scene->objects, cylinder);
    }
    free(points.items);
    return read;
}

static void mesh_add(DatReader *reader, Mesh *mesh, uint32_t material)
{
    const Object object = {
        .kind = SHAPE_MESH, .material = material, .as.mesh.index = (uint32_t)reader->scene->meshes.count};
    array_push(reader->scene->meshes, *mesh);
    array_push(reader->scene->objects, object);
}

// A ring with a hole, as triangles: the circles deviate by less than a ten-thousandth of their radius.
static Mesh ring_mesh(Vector3 center, Vector3 normal, double inner, double outer)
{
    enum { SEGMENTS = 256 };
    Mesh mesh = {.vertices = memory_allocate(2 * SEGMENTS, sizeof *mesh.vertices),
                 .vertex_count = 2 * SEGMENTS,
                 .triangles = memory_allocate(2 * SEGMENTS, sizeof *mesh.triangles),
                 .triangle_count = 2 * SEGMENTS};
    const Vector3 n = vector_normalize(normal);
    const Vector3 other = fabs(n.x) < 0.5 ? (Vector3){1, 0, 0} : (Vector3){0, 1, 0};
    const Vector3 u = vector_normalize(vector_cross(n, other)), v = vector_cross(n, u);
    for (uint32_t i = 0; i < SEGMENTS; i++) {
        const double angle = i * (2 * M_PI / SEGMENTS);
        const Vector3 toward =
            vector_add(vector_scale(u, portable_cosine(angle)), vector_scale(v, portable_sine(angle)));
        const uint32_t at = 2 * i, next = 2 * ((i + 1) % SEGMENTS);
        mesh.vertices[at] = vector_add(center, vector_scale(toward, inner));
        mesh.vertices[at + 1] = vector_add(center, vector_scale(toward, outer));
        memcpy(mesh.triangles[at], (uint32_t[3]){at, at + 1, next + 1}, sizeof mesh.triangles[at]);
        memcpy(mesh.triangles[at + 1], (uint32_t[3]){at, next + 1, next}, sizeof mesh.triangles[at]);
    }
    return mesh;
}

static bool ring_read(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.kind = SHAPE_DISC};
    Vector3 center, normal;
    double inner, outer;
    if (!point_of_object_read(reader, "center", &center) || !dat_vector(reader, "normal", &normal) ||
        !dat_number(reader, "inner", &inner) || !dat_number(reader, "outer", &outer))
        return false;
    object.as.disc.center = center;
    object.as.disc.normal = normal;
    object.as.disc.radius = outer;
    const double width = vector_is_zero(normal) ? 0 : outer - fmax(inner, 0);
    if (inner <= 0 || width <= 0) return object_end(reader, object, width, offset);
    if (!dat_texture(reader, &object.material)) return false;
    Mesh mesh = ring_mesh(center, normal, inner, outer);
    mesh_add(reader, &mesh, object.material);
    return true;
}

static bool box_read(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.kind = SHAPE_BOX};
    Vector3 a, b;
    if (!point_of_object_read(reader, "min", &a) || !point_of_object_read(reader, "max", &b)) return false;
    object.as.box.min = vector_min(a, b);
    object.as.box.max = vector_max(a, b);
    return object_end(reader, object, 1, offset);
}

static bool vertices_read(DatReader *reader, Object *object)
{
    static const char *const names[] = {"v0", "v1", "v2"};
    for (int i = 0; i < 3; i++)
        if (!point_of_object_read(reader, names[i], &object->as.triangle.vertices[i])) return false;
    return true;
}

static bool normals_read(DatReader *reader, Object *object)
{
    static const char *const names[] = {"n0", "n1", "n2"};
    object->as.triangle.smooth = true;
    for (int i = 0; i < 3; i++)
        if (!dat_vector(reader, names[i], &object->as.triangle.normals[i])) return false;
    for (int i = 0; i < 3; i++)
        object->as.triangle.smooth &= !vector_is_zero(object->as.triangle.normals[i]);
    return true;
}

static bool triangle_read(DatReader *reader)
{
    Object object = {.kind = SHAPE_TRIANGLE};
    return vertices_read(reader, &object) && object_end(reader, object, 1, 0);
}

static bool smooth_triangle_read(DatReader *reader)
{
    Object object = {.kind = SHAPE_TRIANGLE};
    return vertices_read(reader, &object) && normals_read(reader, &object) &&
           object_end(reader, object, 1, 0);
}

// Returns the mean of the colors of a triangle's vertices.
static Color mean_color(DatReader *reader, size_t offset, const Color *a, const Color *b, const Color *c)
{
    if (!vectors_equal(*a, *b) || !vectors_equal(*a, *c))
        dat_warn(reader, offset, "triangles have the mean of the colors of their vertices");
    const Color mean = vector_scale(vector_add(vector_add(*a, *b), *c), 1.0 / 3);
    return vector_max(vectors_equal(*a, *b) && vectors_equal(*a, *c) ? *a : mean, vector_all(0));
}

// Adds a material of that color unless the last one has it.
static uint32_t material_of_color(DatReader *reader, Material material, Color color)
{
    Scene *scene = reader->scene;
    material.color = color;
    const size_t count = scene->materials.count;
    if (count > 0 && memcmp(&scene->materials.items[count - 1], &material, sizeof material) == 0)
        return (uint32_t)count - 1;
    return scene_add_material(scene, &material, "");
}

static bool colored_triangle_read(DatReader *reader)
{
    static const char *const names[] = {"c0", "c1", "c2"};
    const size_t offset = reader->line.start;
    Object object = {.kind = SHAPE_TRIANGLE};
    Color colors[3];
    Material material;
    if (!vertices_read(reader, &object) || !normals_read(reader, &object)) return false;
    for (int i = 0; i < 3; i++)
        if (!dat_expect(reader, names[i]) || !dat_components(reader, names[i], &colors[i])) return false;
    if (!dat_texture_body(reader, &material)) return false;
    const Color color = mean_color(reader, offset, &colors[0], &colors[1], &colors[2]);
    object.material = material_of_color(reader, material, color);
    array_push(reader->scene->objects, object);
    return true;
}

// A vertex array being read.
typedef struct {
    Mesh mesh;
    Color *colors; // one for each vertex, or NULL
    Material material;
    uint32_t material_index;
    struct {
        uint32_t (*items)[3];
        size_t count, capacity;
    } triangles;
    struct {
        uint32_t *items;
        size_t count, capacity;
    } materials;
} VertexArray;

// Reads a vector for each vertex. Returns NULL with an error.
static Vector3 *vectors_read(DatReader *reader, const char *name, unsigned count, bool are_colors)
{
    struct {
        Vector3 *items;
        size_t count, capacity;
    } vectors = {0};
    array_reserve(vectors, 1);
    for (unsigned i = 0; i < count; i++) {
        Vector3 vector = {0};
        if (!(are_colors ? dat_components : coordinates_read)(reader, name, &vector)) {
            free(vectors.items);
            return NULL;
        }
        array_push(vectors, vector);
    }
    return vectors.items;
}

static void array_triangle_add(DatReader *reader, VertexArray *array, const uint32_t corners[3],
                               size_t offset)
{
    uint32_t material = array->material_index;
    if (array->colors)
        material = material_of_color(reader, array->material,
                                     mean_color(reader, offset, &array->colors[corners[0]],
                                                &array->colors[corners[1]], &array->colors[corners[2]]));
    array_reserve(array->triangles, 1);
    memcpy(array->triangles.items[array->triangles.count++], corners, sizeof *array->triangles.items);
    array_push(array->materials, material);
}

// Reads the vertices of a strip, in which each one after the second ends a triangle, or of `count` triangles.
static bool faces_read(DatReader *reader, VertexArray *array, bool is_strip)
{
    const size_t offset = reader->line.start;
    const char *name = is_strip ? "tristrip" : "trimesh";
    unsigned count;
    if (!count_read(reader, name, &count)) return false;
    uint32_t corners[3] = {0};
    const size_t index_count = (is_strip ? 1 : 3) * (size_t)count;
    for (size_t i = 0; i < index_count; i++) {
        unsigned index;
        const size_t index_offset = dat_peek(reader).offset;
        if (!count_read(reader, name, &index)) return false;
        if (index >= array->mesh.vertex_count)
            return report_error(&reader->report, index_offset,
                                "a triangle names vertex %u (from 0); there are %zu", index,
                                array->mesh.vertex_count);
        if (is_strip) {
            corners[0] = corners[1];
            corners[1] = corners[2];
            corners[2] = index;
        } else {
            corners[i % 3] = index;
        }
        const bool is_odd = is_strip && i % 2 == 1;
        const uint32_t turned[3] = {corners[is_odd], corners[!is_odd], corners[2]};
        if (is_strip ? i >= 2 : i % 3 == 2) array_triangle_add(reader, array, turned, offset);
    }
    return true;
}

static bool array_parts_read(DatReader *reader, VertexArray *array)
{
    unsigned count;
    if (!dat_expect(reader, "numverts") || !count_read(reader, "numverts", &count) ||
        !dat_expect(reader, "coords"))
        return false;
    array->mesh.vertex_count = count;
    array->mesh.vertices = vectors_read(reader, "coords", count, false);
    if (!array->mesh.vertices || !dat_expect(reader, "normals")) return false;
    array->mesh.normals = vectors_read(reader, "normals", count, false);
    if (!array->mesh.normals) return false;
    for (unsigned i = 0; i < count; i++) {
        const Vector3 vertex = array->mesh.vertices[i];
        reader->bounds = bounds_join(reader->bounds, (Bounds){vertex, vertex});
        array->mesh.normals[i] = vector_normalize(array->mesh.normals[i]);
    }
    while (!dat_skip(reader, "end_vertexarray")) {
        if (dat_skip(reader, "colors")) {
            free(array->colors);
            array->colors = vectors_read(reader, "colors", count, true);
            if (!array->colors) return false;
        } else if (dat_skip(reader, "texture")) {
            if (!dat_texture_body(reader, &array->material)) return false;
            array->material_index = scene_add_material(reader->scene, &array->material, "");
        } else if (dat_skip(reader, "tristrip")) {
            if (!faces_read(reader, array, true)) return false;
        } else if (dat_skip(reader, "trimesh")) {
            if (!faces_read(reader, array, false)) return false;
        } else {
            return dat_expect(reader, "end_vertexarray");
        }
    }
    return true;
}

static bool vertex_array_read(DatReader *reader)
{
    VertexArray array = {.material = dat_texture_default()};
    array.material_index = scene_add_material(reader->scene, &array.material, "");
    const bool read = array_parts_read(reader, &array);
    array.mesh.triangles = array.triangles.items;
    array.mesh.materials = array.materials.items;
    array.mesh.triangle_count = array.triangles.count;
    if (read && array.mesh.triangle_count > 0) {
        mesh_join_vertices(&array.mesh);
        mesh_add(reader, &array.mesh, array.material_index);
    } else {
        mesh_free(&array.mesh);
    }
    free(array.colors);
    return read;
}

static bool occlusion_read(DatReader *reader)
{
    Vector3 unused;
    double number;
    dat_warn(reader, dat_peek(reader).offset, "ambient occlusion is not shown");
    return dat_expect(reader, "ambient_color") && dat_components(reader, "ambient_color", &unused) &&
           dat_number(reader, "rescale_direct", &number) && dat_number(reader, "samples", &number);
}

static bool shader_mode_read(DatReader *reader)
{
    double unused;
    const Word quality = dat_word(reader);
    if (!dat_is(quality, "full"))
        dat_warn(reader, quality.offset,
                 "shader mode '%.*s' leaves something out, such as shadows: shown in full",
                 word_shown(quality), quality.text);
    while (!dat_skip(reader, "end_shader_mode")) {
        const Line before = reader->line;
        const Word word = dat_word(reader);
        bool read = true;
        if (dat_is(word, "trans_vmd"))
            reader->dims_clear = true;
        else if (dat_is(word, "trans_orig"))
            reader->dims_clear = false;
        else if (dat_is(word, "trans_raster3d"))
            dat_warn(reader, word.offset,
                     "'trans_raster3d' is not used: opacity does not depend on the angle");
        else if (dat_is(word, "shadow_filter_off"))
            dat_warn(reader, word.offset,
                     "'shadow_filter_off' is not used: transparent objects cast shadows");
        else if (dat_is(word, "trans_max_surfaces"))
            read = value_read(reader, "trans_max_surfaces", &unused);
        else if (dat_is(word, "ambient_occlusion"))
            read = occlusion_read(reader);
        else if (!dat_is(word, "fog_vmd") && !dat_is(word, "shadow_filter_on")) {
            reader->line = before;
            read = dat_expect(reader, "end_shader_mode");
        }
        if (!read) return false;
    }
    return true;
}

static bool scene_end(DatReader *reader)
{
    reader->is_at_end = true;
    return true;
}

static bool nothing_read(DatReader *reader)
{
    (void)reader;
    return true;
}

// Each reads what follows its keyword. Reports the first error and returns false.
static const struct {
    const char *keyword;
    bool (*read)(DatReader *reader);
} statements[] = {
    {"begin_scene", nothing_read},
    {"resolution", resolution_read},
    {"shader_mode", shader_mode_read},
    {"camera", camera_read},
    {"background", background_read},
    {"light", light_read},
    {"directional_light", directional_light_read},
    {"spotlight", spotlight_read},
    {"texdef", dat_texture_definition},
    {"texalias", dat_texture_alias},
    {"sphere", sphere_read},
    {"plane", plane_read},
    {"cylinder", cylinder_read},
    {"fcylinder", finite_cylinder_read},
    {"polycylinder", polycylinder_read},
    {"ring", ring_read},
    {"box", box_read},
    {"tri", triangle_read},
    {"stri", smooth_triangle_read},
    {"vcstri", colored_triangle_read},
    {"vertexarray", vertex_array_read},
    {"end_clipgroup", nothing_read},
    {"end_scene", scene_end},
};

// What is not shown, and how many words after the keyword could be taken for another statement.
static const struct {
    const char *keyword;
    int word_count;
} not_shown[] = {
    {"background_gradient", 0}, {"fog", 0},   {"imagedef", 4},  {"include", 1},         {"mgffile", 1},
    {"scalarvol", 0},           {"scape", 0}, {"sky_light", 0}, {"start_clipgroup", 0}, {"tpolyfile", 0},
};

enum {
    STATEMENT_COUNT = sizeof statements / sizeof *statements,
    NOT_SHOWN_COUNT = sizeof not_shown / sizeof *not_shown
};

static size_t statement_find(Word word)
{
    size_t index = 0;
    while (index < STATEMENT_COUNT && !dat_is(word, statements[index].keyword))
        index++;
    return index;
}

static size_t not_shown_find(Word word)
{
    size_t index = 0;
    while (index < NOT_SHOWN_COUNT && !dat_is(word, not_shown[index].keyword))
        index++;
    return index;
}

// Skips what belongs to a statement, up to the next one.
static void statement_skip(DatReader *reader)
{
    for (Word word = dat_peek(reader); word.length; word = dat_peek(reader)) {
        if (statement_find(word) < STATEMENT_COUNT || not_shown_find(word) < NOT_SHOWN_COUNT) return;
        dat_word(reader);
    }
}

static void statement_read(DatReader *reader)
{
    const Word word = dat_word(reader);
    const size_t index = statement_find(word), lost = not_shown_find(word);
    if (index < STATEMENT_COUNT && statements[index].read(reader)) return;
    if (lost < NOT_SHOWN_COUNT) {
        dat_warn(reader, word.offset, "'%s' is not shown", not_shown[lost].keyword);
        for (int i = 0; i < not_shown[lost].word_count; i++)
            dat_word(reader);
    } else if (index == STATEMENT_COUNT) {
        report_error(&reader->report, word.offset, "unknown statement '%.*s'", word_shown(word), word.text);
    }
    statement_skip(reader);
}

// Lights do not fade in glint. Each gets its strength at the center of the objects.
static void lights_finish(DatReader *reader)
{
    const Bounds *bounds = &reader->bounds;
    const Vector3 center = bounds_is_empty(bounds) ? reader->scene->camera.look_at
                                                   : vector_scale(vector_add(bounds->min, bounds->max), 0.5);
    for (size_t i = 0; i < reader->fadings.count; i++) {
        const DatFading *fading = &reader->fadings.items[i];
        if (fading->light >= reader->scene->lights.count) continue; // an error was reported
        Light *light = &reader->scene->lights.items[fading->light];
        const double d = vector_length(vector_subtract(light->position, center));
        const double divisor = fading->fading[0] + d * (fading->fading[1] + d * fading->fading[2]);
        light->color = divisor > 0
                           ? vector_min(vector_scale(light->color, 1 / divisor), vector_all(NUMBER_MAX))
                           : (Color){0, 0, 0};
        if (fading->fading[1] != 0 || fading->fading[2] != 0)
            dat_warn(reader, fading->offset,
                     "lights do not fade with distance: each has its strength at the center of the objects");
    }
}

// From so far the frame has its size at the center of the objects, where the lines of sight are nearly
// parallel.
static void orthographic_finish(DatReader *reader)
{
    const double frames = 256;
    const double height = reader->orthographic_height;
    if (height == 0) return;
    const Bounds *bounds = &reader->bounds;
    Camera *camera = &reader->scene->camera;
    const Vector3 forward = vector_normalize(vector_subtract(camera->look_at, camera->position));
    const Vector3 center =
        bounds_is_empty(bounds) ? camera->look_at : vector_scale(vector_add(bounds->min, bounds->max), 0.5);
    const double depth = vector_dot(vector_subtract(center, camera->position), forward);
    const double distance = fmin(frames * height, NUMBER_MAX);
    camera->position = vector_add(camera->position, vector_scale(forward, depth - distance));
    camera->look_at = vector_add(camera->position, vector_scale(forward, distance));
    camera->half_tangent = height / 2 / distance;
}

bool scene_read_dat(Scene *scene, const Source *source, MessageList *messages)
{
    *scene = (Scene){.color_meaning = COLORS_DISPLAY, .ambient = {1, 1, 1}};
    DatReader reader = {.report = report_open(source, messages), .scene = scene, .bounds = bounds_empty()};
    if (line_open(&reader.line, &reader.report)) {
        Places places = places_open(source);
        if (!dat_is(dat_peek(&reader), "begin_scene"))
            report_error(&reader.report, dat_peek(&reader).offset, "a scene starts with 'begin_scene'");
        while (!report_is_full(&reader.report) && !reader.is_at_end && dat_peek(&reader).length) {
            const size_t offset = dat_peek(&reader).offset;
            statement_read(&reader);
            places_note(&places, scene, offset);
        }
        places_close(&places);
        if (!reader.has_camera && !report_is_full(&reader.report))
            report_error(&reader.report, source->length, "no camera: a block 'camera'");
    }
    lights_finish(&reader);
    orthographic_finish(&reader);
    free(reader.textures.items);
    free(reader.slots);
    free(reader.fadings.items);
    return scene_finish(scene, &reader.report);
}
